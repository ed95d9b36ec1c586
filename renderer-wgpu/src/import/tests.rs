//! Turns published frames into the claim that the device's copies are these frames, whole.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::{
    readback,
    test_gpu::{gpu, skip},
};
use photonstream_protocol::{
    AccessMode, ChannelName, ChunkSet, FrameSource, Publisher, Reading, Runtime, SegmentSpec,
    StatisticsRecord,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub(super) fn importing() -> Option<Gpu> {
    match Gpu::headless_importing(&AdapterChoice { name: None, software: true }) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    }
}

pub(super) struct Channel {
    _root: tempfile::TempDir,
    runtime: Runtime,
    name: ChannelName,
    pub(super) publisher: Publisher,
}

impl Channel {
    pub(super) fn new(capacity: u32) -> Self {
        let root = tempfile::tempdir().unwrap();
        let runtime = Runtime::at(root.path());
        let name: ChannelName = "import".parse().unwrap();
        let spec = SegmentSpec {
            vsl_capacity: capacity,
            distance_capacity: 0,
            object_capacity: 1,
            light_capacity: 1,
            scene_text_capacity: 64,
            notice_capacity: 64,
            scene_hash: 7,
            slots: 3,
        };
        let publisher = Publisher::create_in(&runtime, &name, &spec).unwrap();
        Self { _root: root, runtime, name, publisher }
    }

    pub(super) fn subscriber(&self, mode: AccessMode) -> Subscriber {
        Subscriber::attach_in(&self.runtime, &self.name, mode).unwrap()
    }
}

/// Sets its flag when dropped.
struct Stopping<'a>(&'a AtomicBool);

impl Drop for Stopping<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Every word of frame `frame` follows from the frame and its place.
fn records(count: usize, frame: u64) -> Vec<VslRecord> {
    let f = frame as f32;
    (0..count)
        .map(|i| VslRecord {
            changed_frame: frame,
            generation: frame as u32,
            object: i as u32,
            position: [f, i as f32, f + 0.5],
            area: f,
            normal: [i as f32, f, 1.0],
            standard_error: f,
            flux: [f, f, i as f32],
            mean_age_s: f,
        })
        .collect()
}

pub(super) fn publish(publisher: &mut Publisher, vsls: &[VslRecord]) -> u64 {
    let mut changed = ChunkSet::for_records(vsls.len());
    (0..vsls.len().div_ceil(64)).for_each(|chunk| changed.insert(chunk));
    let source = FrameSource {
        vsls,
        changed: Some(&changed),
        patches: &[],
        patches_changed: None,
        distances: &[],
        distances_changed: None,
        objects: &[],
        lights: &[],
        statistics: &StatisticsRecord::default(),
        scene_text: "",
        notice: "",
        config_generation: 0,
        simulation_time_s: 0.0,
    };
    publisher.publish(&source).unwrap()
}

fn copied(gpu: &Gpu, imported: &ImportedSegment) -> Vec<VslRecord> {
    let all = readback::buffer::<VslRecord>(gpu, imported.records()).unwrap();
    all[..imported.count() as usize].to_vec()
}

/// Five frames of different sizes, among them none and all that fit: the copy is what a subscriber reads.
#[test]
fn copies_are_the_frames_that_a_subscriber_reads() {
    let Some(gpu) = importing() else { return };
    let mut channel = Channel::new(1_000);
    let mut subscriber = channel.subscriber(AccessMode::Mapped);
    let mut imported = ImportedSegment::new(&gpu, &subscriber).unwrap();
    assert_eq!(imported.epoch(), subscriber.epoch());
    assert_eq!(imported.copy_newest(&gpu).unwrap(), None, "nothing is published yet");
    for (frame, count) in (1..).zip([700, 1_000, 0, 64, 65]) {
        publish(&mut channel.publisher, &records(count, frame));
        assert_eq!(imported.copy_newest(&gpu).unwrap(), Some(frame));
        assert_eq!(imported.copy_newest(&gpu).unwrap(), None);
        assert_eq!(subscriber.read().unwrap(), Reading::New);
        assert_eq!(copied(&gpu, &imported), subscriber.frame().unwrap().vsls, "{count} records");
    }
    assert_eq!(imported.dropped(), 0);
}

/// A publisher that overwrites slots while they are copied, 20 000 records of which all change: each copy that counts is
/// of one frame, frames go forward, and some are got. A copy takes about as long as publishing a frame here, so that
/// without the second look at the sequence about one in three would be torn. 1.5 s of pauses of 0 to 1.5 ms.
#[test]
fn nothing_is_torn_while_a_publisher_races() {
    let Some(gpu) = importing() else { return };
    const COUNT: usize = 20_000;
    let mut channel = Channel::new(COUNT as u32);
    let subscriber = channel.subscriber(AccessMode::Mapped);
    let mut imported = ImportedSegment::new(&gpu, &subscriber).unwrap();
    let stop = AtomicBool::new(false);
    let (mut frames, mut last) = (0, 0);
    std::thread::scope(|scope| {
        let (publisher, stop) = (&mut channel.publisher, &stop);
        scope.spawn(move || {
            let mut frame = 0;
            while !stop.load(Ordering::Relaxed) {
                frame += 1;
                assert_eq!(publish(publisher, &records(COUNT, frame)), frame);
                std::thread::sleep(Duration::from_micros(frame % 16 * 100));
            }
        });
        // Also where an assertion fails: the publisher has to end, or the scope never does.
        let _stopping = Stopping(stop);
        let end = Instant::now() + Duration::from_millis(1_500);
        while Instant::now() < end {
            let Some(frame) = imported.copy_newest(&gpu).unwrap() else { continue };
            assert!(frame > last, "frames go forward");
            (frames, last) = (frames + 1, frame);
            assert!(copied(&gpu, &imported) == records(COUNT, frame), "frame {frame} is torn");
        }
    });
    assert!(frames > 3, "{frames} frames, {} dropped", imported.dropped());
}

/// The pages live as long as the device's buffer: subscriber and publisher may go first.
#[test]
fn the_map_outlives_its_subscriber() {
    let Some(gpu) = importing() else { return };
    let mut channel = Channel::new(300);
    let subscriber = channel.subscriber(AccessMode::Mapped);
    let mut imported = ImportedSegment::new(&gpu, &subscriber).unwrap();
    publish(&mut channel.publisher, &records(300, 1));
    drop(subscriber);
    drop(channel);
    assert_eq!(imported.copy_newest(&gpu).unwrap(), Some(1));
    assert!(copied(&gpu, &imported) == records(300, 1));
}

#[test]
fn what_cannot_be_imported_is_named() {
    let Some(gpu) = gpu() else { return };
    let channel = Channel::new(10);
    let error = ImportedSegment::new(&gpu, &channel.subscriber(AccessMode::Mapped)).unwrap_err();
    assert!(
        matches!(&error, ImportError::Gpu(GpuError::Unsupported { lacks, .. }) if lacks.contains("external_memory_host")),
        "{error}"
    );
    let error = ImportedSegment::new(&gpu, &channel.subscriber(AccessMode::Strict)).unwrap_err();
    assert!(
        matches!(&error, ImportError::Gpu(GpuError::Unsupported { lacks, .. }) if lacks.contains("mapped")),
        "{error}"
    );
}

/// Every record changed: copied from imported pages, against read by the CPU and uploaded. Best of 40.
#[test]
#[ignore = "measures"]
fn import_against_upload() {
    let Some(gpu) = importing() else { return };
    for count in [1_000, 10_000, 100_000] {
        let mut channel = Channel::new(count);
        let mut subscriber = channel.subscriber(AccessMode::Mapped);
        let start = Instant::now();
        let mut imported = ImportedSegment::new(&gpu, &subscriber).unwrap();
        let importing = start.elapsed();
        let target = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(count) * RECORD_BYTES,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut best = [f64::INFINITY; 3];
        for frame in 1..=40 {
            publish(&mut channel.publisher, &records(count as usize, frame));
            let clock = |best: &mut f64, work: &mut dyn FnMut()| {
                let start = Instant::now();
                work();
                *best = best.min(start.elapsed().as_secs_f64() * 1e3);
            };
            clock(&mut best[0], &mut || assert_eq!(imported.copy_newest(&gpu).unwrap(), Some(frame)));
            clock(&mut best[1], &mut || while subscriber.read().unwrap() != Reading::New {});
            clock(&mut best[2], &mut || {
                let records = &subscriber.frame().unwrap().vsls;
                gpu.queue.write_buffer(&target, 0, bytemuck::cast_slice(records));
                gpu.queue.submit([]);
                gpu.wait().unwrap();
            });
        }
        let [copy, read, write] = best;
        println!(
            "{count} records: imported in {:.3} ms; copy_newest {copy:.3} ms; read {read:.3} + write_buffer {write:.3} = {:.3} ms",
            importing.as_secs_f64() * 1e3,
            read + write,
        );
    }
}
