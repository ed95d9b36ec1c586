//! Turns the protocol's figures to hold into one table, `memcpy` and frames by turns in one run: `cargo bench --bench figures`.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use memmap2::MmapMut;
use photonstream_protocol::{
    AccessMode, ChannelName, ChunkSet, ControlServer, FrameSource, Liveness, NOTICE_CAPACITY, Publisher,
    Reading, Runtime, SegmentSpec, StatisticsRecord, Subscriber, VslRecord,
};

const ROUNDS: usize = 400;
/// Turns in which the rounds are divided.
const TURNS: usize = 8;
/// Set in the child process that is to be killed: the runtime folder, and whether it has a control socket.
const CHILD: [&str; 2] = ["PHOTONSTREAM_BENCH_ROOT", "PHOTONSTREAM_BENCH_SOCKET"];

fn main() {
    if let [Ok(root), Ok(socket)] = CHILD.map(std::env::var) {
        publish_until_killed(Path::new(&root), socket == "1");
    }
    // `cargo test --benches` only looks whether this starts.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    println!("median (fastest tenth) of {ROUNDS}, in us");
    for count in [10_000, 100_000] {
        frames(count);
    }
    deaths(true, 10);
    deaths(false, 3);
}

fn publisher(runtime: &Runtime, count: usize) -> Publisher {
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
    Publisher::create_in(runtime, &ChannelName::default(), &spec).unwrap()
}

fn publish(publisher: &mut Publisher, vsls: &[VslRecord], changed: &ChunkSet) {
    let frame = FrameSource {
        vsls,
        changed: Some(changed),
        patches: &[],
        patches_changed: None,
        distances: &[],
        distances_changed: None,
        objects: &[],
        lights: &[],
        statistics: &StatisticsRecord::default(),
        scene_text: "bench",
        notice: "",
        config_generation: 0,
        simulation_time_s: 0.0,
    };
    publisher.publish(&frame).unwrap();
}

fn attach(runtime: &Runtime) -> Subscriber {
    Subscriber::attach_in(runtime, &ChannelName::default(), AccessMode::Mapped).unwrap()
}

fn us(action: impl FnOnce()) -> f64 {
    let start = Instant::now();
    action();
    start.elapsed().as_secs_f64() * 1e6
}

/// Median and tenth percentile.
fn summary(mut times: Vec<f64>) -> (f64, f64) {
    times.sort_by(f64::total_cmp);
    (times[times.len() / 2], times[times.len() / 10])
}

/// `memcpy` from three buffers in turn into two, and whole and partial frames, by turns of some rounds.
fn frames(count: usize) {
    let root = tempfile::tempdir().unwrap();
    let runtime = Runtime::at(root.path());
    let mut publisher = publisher(&runtime, count);
    let mut subscriber = attach(&runtime);
    let vsls = vec![VslRecord { area: 1.0, flux: [1.0; 3], ..VslRecord::default() }; count];
    let bytes: &[u8] = bytemuck::cast_slice(&vsls);
    let all = ChunkSet::all(count);
    // Three buffers of shared memory, as a ring has them.
    let mut shared = MmapMut::map_anon(3 * bytes.len()).unwrap();
    let mut to = vec![bytes.to_vec(); 2];
    let mut times: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::new());
    let mut read = || while subscriber.read().unwrap() != Reading::New {};
    for _ in 0..TURNS {
        for round in 0..ROUNDS / TURNS {
            let buffer = round % 3 * bytes.len()..(round % 3 + 1) * bytes.len();
            shared[buffer.clone()].copy_from_slice(bytes);
            let (from, to) = (std::hint::black_box(&shared[buffer]), &mut to[round % 2]);
            times[0].push(us(|| std::hint::black_box(to).copy_from_slice(from)));
        }
        for _ in 0..ROUNDS / TURNS {
            times[1].push(us(|| publish(&mut publisher, &vsls, &all)));
            times[2].push(us(&mut read));
        }
        for round in 0..ROUNDS / TURNS {
            let mut changed = ChunkSet::for_records(count);
            (round % 50..all.range()).step_by(50).for_each(|chunk| changed.insert(chunk));
            publish(&mut publisher, &vsls, &changed);
            times[3].push(us(&mut read));
        }
    }
    let [copy, publish, whole, partial] = times.map(summary);
    println!(
        "{count} lights: memcpy {:.1} ({:.1}), publish all {:.1} ({:.1})",
        copy.0, copy.1, publish.0, publish.1
    );
    let ratio = (whole.0 / copy.0, whole.1 / copy.1);
    println!("  read all {:.1} ({:.1}) = {:.2} ({:.2}) x memcpy", whole.0, whole.1, ratio.0, ratio.1);
    println!("  read, 2 % of chunks changed {:.1} ({:.1})", partial.0, partial.1);
}

/// From `kill -9` of a simulator to `Gone` in a waiting reader.
fn deaths(socket: bool, kills: usize) {
    let mut times = Vec::new();
    for _ in 0..kills {
        let root = tempfile::tempdir().unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .env(CHILD[0], root.path())
            .env(CHILD[1], if socket { "1" } else { "0" })
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let runtime = Runtime::at(root.path());
        let (channel, limit) = (ChannelName::default(), Duration::from_secs(10));
        let mut reader =
            Subscriber::attach_wait_in(&runtime, &channel, AccessMode::Mapped, limit, &|| false).unwrap();
        // Frames are being read, and a socket that came after the segment is connected to.
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(700) {
            reader.read().unwrap();
            reader.wait(Duration::from_millis(10));
        }
        child.kill().unwrap();
        times.push(us(|| {
            while !matches!(reader.liveness(), Liveness::Gone { .. }) {
                reader.read().unwrap();
                reader.wait(Duration::from_millis(100));
            }
        }));
        child.wait().unwrap();
        photonstream_protocol::clean_in(&runtime).unwrap();
    }
    let slowest = times.iter().copied().fold(0.0, f64::max);
    let by = if socket { "closed socket" } else { "heartbeat" };
    let (median, _) = summary(times);
    println!(
        "death noticed by {by}, of {kills}: median {:.1} ms, slowest {:.1} ms",
        median / 1e3,
        slowest / 1e3
    );
}

/// 100 frames a second of 1 000 lights.
fn publish_until_killed(root: &Path, socket: bool) -> ! {
    let mut publisher = publisher(&Runtime::at(root), 1000);
    let _server = socket.then(|| ControlServer::start(&publisher).unwrap());
    let (vsls, all) = (vec![VslRecord::default(); 1000], ChunkSet::all(1000));
    loop {
        publish(&mut publisher, &vsls, &all);
        std::thread::sleep(Duration::from_millis(10));
    }
}
