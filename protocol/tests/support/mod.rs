//! Turns a frame number into the content every word of that frame must have, and runs tests in child processes.
#![allow(dead_code, unreachable_pub, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use photonstream_protocol::{
    ChunkSet, FrameSource, LightRecord, ObjectRecord, PatchRecord, SegmentSpec, StatisticsRecord, VslFrame,
    VslRecord,
};

/// Capacities for `vsls` lights.
pub fn spec(vsls: u32) -> SegmentSpec {
    SegmentSpec {
        vsl_capacity: vsls,
        distance_capacity: 0,
        object_capacity: 100,
        light_capacity: 8,
        scene_text_capacity: 4096,
        notice_capacity: 256,
        scene_hash: 0xabc,
        slots: 3,
    }
}

/// Frame in which chunk `chunk` last changed, at `frame`: chunk c changes every 1 + c mod 7 frames.
pub fn version(chunk: usize, frame: u64) -> u64 {
    let period = 1 + chunk as u64 % 7;
    1 + (frame - 1) / period * period
}

/// A frame whose every word follows from its number and its place.
#[derive(Default)]
pub struct Content {
    pub vsls: Vec<VslRecord>,
    /// Those of `vsls`, which change with them.
    pub patches: Vec<PatchRecord>,
    pub objects: Vec<ObjectRecord>,
    pub lights: Vec<LightRecord>,
    pub statistics: StatisticsRecord,
    pub text: String,
    pub notice: String,
    pub changed: ChunkSet,
    pub frame: u64,
}

fn vsl(i: usize, version: u64) -> VslRecord {
    let v = (version % 100_000) as f32;
    let x = i as f32;
    VslRecord {
        changed_frame: version,
        generation: version as u32,
        object: i as u32,
        position: [x, v, x + v],
        area: v + 1.0,
        normal: [v, x, -v],
        standard_error: v * 0.5,
        flux: [v, v + 1.0, x],
        mean_age_s: -v,
    }
}

fn patch(i: usize, version: u64) -> PatchRecord {
    let (x, v) = (i as f32, (version % 100_000) as f32);
    PatchRecord { corners: std::array::from_fn(|k| x + v * k as f32), count: version as u32, area: v }
}

impl Content {
    /// The content of `frame` with `count` lights.
    pub fn new(count: usize, frame: u64) -> Self {
        let mut content = Self::default();
        content.advance(count, frame);
        content
    }

    /// Moves on to a later frame.
    pub fn advance(&mut self, count: usize, frame: u64) {
        self.changed = ChunkSet::for_records(count);
        self.vsls.resize(count, VslRecord::default());
        self.patches.resize(count, PatchRecord::default());
        for (c, chunk) in self.vsls.chunks_mut(64).enumerate() {
            let version = version(c, frame);
            if version == frame || self.frame + 1 != frame {
                self.changed.insert(c);
                for (i, record) in chunk.iter_mut().enumerate() {
                    *record = vsl(c * 64 + i, version);
                    self.patches[c * 64 + i] = patch(c * 64 + i, version);
                }
            }
        }
        self.objects = (0..70)
            .map(|id| ObjectRecord {
                id,
                generation: frame as u32,
                world_from_object: [frame as f64 + f64::from(id); 12],
                ..ObjectRecord::default()
            })
            .collect();
        self.lights = vec![LightRecord { enabled: 1, power: [frame as f32; 3], ..LightRecord::default() }; 3];
        self.statistics =
            StatisticsRecord { paths_total: frame, paths_per_s: frame as f64, ..Default::default() };
        self.text = format!("# scene, generation {}\n", frame / 10).repeat(1 + (frame / 10 % 5) as usize);
        self.notice = "refused, ".repeat((frame / 7 % 4) as usize);
        self.frame = frame;
    }

    /// As the publisher takes it; `named` hands over the set of changed chunks.
    pub fn source(&self, named: bool) -> FrameSource<'_> {
        FrameSource {
            vsls: &self.vsls,
            changed: named.then_some(&self.changed),
            patches: &self.patches,
            patches_changed: named.then_some(&self.changed),
            distances: &[],
            distances_changed: None,
            objects: &self.objects,
            lights: &self.lights,
            statistics: &self.statistics,
            scene_text: &self.text,
            notice: &self.notice,
            config_generation: self.frame / 10,
            simulation_time_s: self.frame as f64 * 0.25,
        }
    }
}

/// Panics unless every word of a frame is what its number demands.
pub fn check(frame: &VslFrame) {
    let f = frame.frame;
    for (i, record) in frame.vsls.iter().enumerate() {
        assert_eq!(*record, vsl(i, version(i / 64, f)), "light {i} of frame {f}");
    }
    assert!(frame.patches.len() == frame.vsls.len(), "patches of frame {f}");
    for (i, record) in frame.patches.iter().enumerate() {
        assert_eq!(*record, patch(i, version(i / 64, f)), "patch {i} of frame {f}");
    }
    let expected = Content::new(0, f);
    assert_eq!(frame.objects, expected.objects, "objects of frame {f}");
    assert_eq!(frame.lights, expected.lights, "lights of frame {f}");
    assert_eq!(frame.statistics.paths_total, f);
    assert_eq!(frame.statistics.paths_per_s, f as f64);
    assert_eq!(*frame.scene_text, *expected.text, "text of frame {f}");
    assert_eq!(*frame.notice, *expected.notice, "notice of frame {f}");
    assert_eq!((frame.config_generation, frame.simulation_time_s), (f / 10, f as f64 * 0.25));
}

/// Environment variable that makes a test run its child's part, with the runtime folder as value.
pub const CHILD: &str = "PHOTONSTREAM_TEST_CHILD";

/// The runtime folder, inside a child.
pub fn child_root() -> Option<std::path::PathBuf> {
    std::env::var_os(CHILD).map(Into::into)
}

/// A child process that is killed when dropped.
pub struct ChildGuard(pub Child, Option<BufReader<ChildStdout>>);

impl ChildGuard {
    /// Runs test `name` of this test binary as a child.
    pub fn spawn(name: &str, root: &Path) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", name, "--nocapture", "--test-threads=1", "--quiet"]);
        command.env(CHILD, root).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        Self(command.spawn().unwrap(), None)
    }

    /// SIGKILL, and wait.
    pub fn kill(&mut self) {
        let _ = self.0.kill();
        self.0.wait().unwrap();
    }

    /// Waits until the child prints a line that contains one of the words; returns the line.
    pub fn wait_for(&mut self, words: &[&str]) -> String {
        let child = &mut self.0;
        let lines = self.1.get_or_insert_with(|| BufReader::new(child.stdout.take().unwrap()));
        let mut line = String::new();
        while lines.read_line(&mut line).unwrap() > 0 {
            if words.iter().any(|word| line.contains(word)) {
                return line;
            }
            line.clear();
        }
        panic!("the child ended without printing one of {words:?}");
    }
}

impl Drop for ChildGuard {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A small deterministic generator for kill times and places (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % n
    }
}

impl Content {
    /// A source without lights, objects and text.
    pub fn default_source(statistics: &StatisticsRecord) -> FrameSource<'_> {
        FrameSource {
            vsls: &[],
            changed: None,
            patches: &[],
            patches_changed: None,
            distances: &[],
            distances_changed: None,
            objects: &[],
            lights: &[],
            statistics,
            scene_text: "",
            notice: "",
            config_generation: 0,
            simulation_time_s: 0.0,
        }
    }
}
