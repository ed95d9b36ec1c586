//! Turns the figures the protocol must hold into ratios and times of one run: `cargo bench -p photonstream-protocol`.
#![allow(clippy::unwrap_used, clippy::print_stderr, missing_docs)]

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use divan::{Bencher, counter::BytesCount};
use photonstream_protocol::{
    AccessMode, ChannelName, ChunkSet, FrameSource, NOTICE_CAPACITY, Publisher, Reading, Runtime,
    SegmentSpec, StatisticsRecord, Subscriber, VslRecord, monotonic_ns,
};

fn main() {
    divan::main();
}

struct Channel {
    _root: tempfile::TempDir,
    runtime: Runtime,
    name: ChannelName,
    publisher: Publisher,
    vsls: Vec<VslRecord>,
    statistics: StatisticsRecord,
}

impl Channel {
    fn new(count: usize) -> Self {
        let root = tempfile::tempdir().unwrap();
        let (runtime, name) = (Runtime::at(root.path()), ChannelName::default());
        let spec = SegmentSpec {
            vsl_capacity: count as u32,
            distance_capacity: 0,
            object_capacity: 16,
            light_capacity: 4,
            scene_text_capacity: 4096,
            notice_capacity: NOTICE_CAPACITY,
            scene_hash: 0,
            slots: 3,
        };
        let publisher = Publisher::create_in(&runtime, &name, &spec).unwrap();
        let vsls = vec![VslRecord { area: 1.0, flux: [1.0; 3], ..VslRecord::default() }; count];
        Self { _root: root, runtime, name, publisher, vsls, statistics: StatisticsRecord::default() }
    }

    fn publish(&mut self, changed: Option<&ChunkSet>) {
        let frame = FrameSource {
            vsls: &self.vsls,
            changed,
            patches: &[],
            patches_changed: None,
            distances: &[],
            distances_changed: None,
            objects: &[],
            lights: &[],
            statistics: &self.statistics,
            scene_text: "bench",
            notice: "",
            config_generation: 0,
            simulation_time_s: 0.0,
        };
        self.publisher.publish(&frame).unwrap();
    }

    fn attach(&self, mode: AccessMode) -> Subscriber {
        Subscriber::attach_in(&self.runtime, &self.name, mode).unwrap()
    }
}

fn read(subscriber: &mut Subscriber) {
    while subscriber.read().unwrap() != Reading::New {}
}

const COUNTS: [usize; 2] = [10_000, 100_000];

/// The measure of all: the same bytes by `memcpy`, from three buffers in turn into two, as the ring and its reader do.
#[divan::bench(args = COUNTS)]
fn memcpy(bencher: Bencher<'_, '_>, count: usize) {
    let from = std::cell::RefCell::new(vec![vec![VslRecord::default(); count]; 3]);
    let mut to = vec![vec![VslRecord::default(); count]; 2];
    let mut turn = 0;
    bencher
        .counter(BytesCount::new(count * 64))
        .with_inputs(|| {
            turn += 1;
            from.borrow_mut()[turn % 3].fill(VslRecord { generation: turn as u32, ..VslRecord::default() });
            turn
        })
        .bench_local_values(|turn| {
            divan::black_box(&mut to[turn % 2]).copy_from_slice(divan::black_box(&from.borrow()[turn % 3]));
        });
}

/// A full frame, all chunks new.
#[divan::bench(args = COUNTS)]
fn read_all(bencher: Bencher<'_, '_>, count: usize) {
    let mut channel = Channel::new(count);
    let all = ChunkSet::all(count);
    let mut subscriber = channel.attach(AccessMode::Mapped);
    let publisher = std::cell::RefCell::new(&mut channel);
    bencher
        .counter(BytesCount::new(count * 64))
        .with_inputs(|| publisher.borrow_mut().publish(Some(&all)))
        .bench_local_values(|()| read(&mut subscriber));
}

/// A full frame without a map.
#[divan::bench(args = COUNTS)]
fn read_all_strict(bencher: Bencher<'_, '_>, count: usize) {
    let mut channel = Channel::new(count);
    let all = ChunkSet::all(count);
    let mut subscriber = channel.attach(AccessMode::Strict);
    let publisher = std::cell::RefCell::new(&mut channel);
    bencher
        .counter(BytesCount::new(count * 64))
        .with_inputs(|| publisher.borrow_mut().publish(Some(&all)))
        .bench_local_values(|()| read(&mut subscriber));
}

/// A frame of which one chunk in 50 changed.
#[divan::bench(args = COUNTS)]
fn read_two_percent(bencher: Bencher<'_, '_>, count: usize) {
    let mut channel = Channel::new(count);
    let mut subscriber = channel.attach(AccessMode::Mapped);
    channel.publish(None);
    read(&mut subscriber);
    let publisher = std::cell::RefCell::new((&mut channel, 0));
    bencher
        .with_inputs(|| {
            let mut shared = publisher.borrow_mut();
            let (channel, turn) = &mut *shared;
            let mut changed = ChunkSet::for_records(count);
            for chunk in (*turn % 50..count.div_ceil(64)).step_by(50) {
                changed.insert(chunk);
            }
            *turn += 1;
            channel.publish(Some(&changed));
        })
        .bench_local_values(|()| read(&mut subscriber));
}

/// Publishing with all chunks named as changed.
#[divan::bench(args = COUNTS)]
fn publish_all(bencher: Bencher<'_, '_>, count: usize) {
    let mut channel = Channel::new(count);
    let all = ChunkSet::all(count);
    bencher.counter(BytesCount::new(count * 64)).bench_local(|| channel.publish(Some(&all)));
}

/// Publishing where the publisher compares, and finds every record changed.
#[divan::bench(args = COUNTS)]
fn publish_compared(bencher: Bencher<'_, '_>, count: usize) {
    let mut channel = Channel::new(count);
    bencher.counter(BytesCount::new(count * 64)).bench_local(|| {
        for vsl in &mut channel.vsls {
            vsl.flux[0] += 1.0;
        }
        channel.publish(None);
    });
}

/// From the call of `publish` to another thread holding the frame: median of 2 000, printed by the bench below.
fn latency_ns(spinning: bool) -> u64 {
    let mut channel = Channel::new(64);
    let mut subscriber = channel.attach(AccessMode::Mapped);
    let (stop, seen) = (AtomicBool::new(false), AtomicU64::new(0));
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut times = Vec::new();
            while !stop.load(Ordering::Relaxed) {
                if subscriber.read().unwrap() == Reading::New {
                    times.push(monotonic_ns() - subscriber.frame().unwrap().publish_time_ns);
                    seen.fetch_add(1, Ordering::Relaxed);
                } else if !spinning {
                    subscriber.wait(std::time::Duration::from_millis(100));
                }
            }
            times.sort_unstable();
            times[times.len() / 2]
        });
        for frame in 1..=2000 {
            channel.publish(None);
            while seen.load(Ordering::Relaxed) < frame {
                std::hint::spin_loop();
            }
            // A waiting reader is to be asleep again.
            let start = monotonic_ns();
            while monotonic_ns() - start < 20_000 {}
        }
        stop.store(true, Ordering::Relaxed);
        reader.join().unwrap()
    })
}

/// Publish to seen (64 records): one sample is the median of 2 000 frames.
#[divan::bench(args = [true, false], sample_count = 1, sample_size = 1)]
fn publish_to_seen_ns(bencher: Bencher<'_, '_>, spinning: bool) {
    bencher.bench_local(|| {
        let median = latency_ns(spinning);
        eprintln!(" publish to seen, {}: median {median} ns", if spinning { "spinning" } else { "futex" });
    });
}
