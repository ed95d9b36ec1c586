//! Turns published frames into pictures through the renderer's own program: as many as asked for, or the last one
//! when the channel closes.
#![allow(clippy::unwrap_used)]

use photonstream_film::Film;
use photonstream_protocol::{
    ChannelName, FrameSource, LightRecord, NOTICE_CAPACITY, ObjectRecord, Publisher, Runtime, SegmentSpec,
    StatisticsRecord, VslRecord,
};
use photonstream_scene::Scene;
use photonstream_shading::LightShape;
use std::{
    path::Path,
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

/// A stand-in for a simulator: publishes a scene with some light.
struct Simulator {
    publisher: Publisher,
    scene: Scene,
}

impl Simulator {
    fn start(root: &Path) -> Self {
        let scene = crate::scenes::sphere([0.0; 3]);
        let spec = SegmentSpec {
            vsl_capacity: 64,
            distance_capacity: 0,
            object_capacity: 4,
            light_capacity: 4,
            scene_text_capacity: scene.resolved_text.len() as u32,
            notice_capacity: NOTICE_CAPACITY,
            scene_hash: scene.hash,
            slots: 3,
        };
        let channel: ChannelName = "pictures".parse().unwrap();
        Self { publisher: Publisher::create_in(&Runtime::at(root), &channel, &spec).unwrap(), scene }
    }

    /// Publishes a frame whose lamp and lights have the given power.
    fn publish(&mut self, power: f32, converged: bool) -> u64 {
        self.publish_moved(power, converged, 0.0)
    }

    fn publish_moved(&mut self, power: f32, converged: bool, shift: f64) -> u64 {
        let scene = &self.scene;
        let lights: Vec<_> = scene
            .lights
            .iter()
            .map(|l| {
                let LightShape::Point { position } = l.light.shape else { panic!("a point light") };
                let position = position.to_array();
                LightRecord {
                    enabled: 1,
                    power: [power; 3],
                    position,
                    object: u32::MAX,
                    ..LightRecord::default()
                }
            })
            .collect();
        let objects: Vec<_> = scene
            .objects
            .iter()
            .enumerate()
            .map(|(id, o)| {
                let mut world_from_object = o.world_from_rest.to_cols_array();
                world_from_object[9] += shift;
                let albedo = scene.materials[o.material.0 as usize].albedo.to_array();
                ObjectRecord { id: id as u32, world_from_object, albedo, ..ObjectRecord::default() }
            })
            .collect();
        let vsls = vec![
            VslRecord {
                position: [0.0, -0.99, 0.0],
                normal: [0.0, 1.0, 0.0],
                flux: [power; 3],
                area: 0.2,
                ..VslRecord::default()
            };
            8
        ];
        let statistics = StatisticsRecord {
            converged: u64::from(converged),
            pool_valid: 4096,
            ..StatisticsRecord::default()
        };
        let frame = FrameSource {
            vsls: &vsls,
            changed: None,
            patches: &[],
            patches_changed: None,
            distances: &[],
            distances_changed: None,
            objects: &objects,
            lights: &lights,
            statistics: &statistics,
            scene_text: &scene.resolved_text,
            notice: "",
            config_generation: 1,
            simulation_time_s: 0.0,
        };
        self.publisher.publish(&frame).unwrap()
    }
}

fn renderer(root: &Path, out: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_photonstream-renderer-cpu"))
        .args(["--channel", "pictures", "--size", "24x16", "--visibility", "none", "--out"])
        .arg(out)
        .args(arguments)
        .env("PHOTONSTREAM_RUNTIME_DIR", root)
        .env("PHOTONSTREAM_CACHE", "off")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The output of a child that has to end by itself; a watchdog of a minute kills one that hangs.
fn ended(mut child: Child) -> Output {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("the renderer hangs: {}", stderr(&child.wait_with_output().unwrap()));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{} does not come", path.display());
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn pictures_follow_the_frames() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    // Started first: it waits for the channel.
    let child = renderer(root.path(), &out, &["--frames", "3", "--show", "full,normal"]);
    let mut simulator = Simulator::start(root.path());
    let frame = simulator.publish(10.0, false);
    wait_for(&out.join("frame-0001.png"));
    let first = Film::read_exr(&out.join("frame-0001.exr")).unwrap();
    assert_eq!(first.metadata.frame, Some(frame));
    assert_eq!(first.metadata.scene_hash, Some(simulator.scene.hash));
    assert_eq!((first.metadata.photon_paths, first.metadata.vsls), (Some(4096), Some(8)));
    assert_eq!((first.width(), first.height(), first.layers().len()), (24, 16, 2));
    // The lamp of the frame counts, not that of the text.
    simulator.publish(20.0, false);
    wait_for(&out.join("frame-0002.png"));
    let full = |n: u32| {
        crate::scenes::mean(
            &Film::read_exr(&out.join(format!("frame-000{n}.exr"))).unwrap().layer("full").unwrap().pixels,
        )
    };
    assert!((full(2) / full(1) - 2.0).abs() < 1e-5, "twice the light is twice as bright");
    // Converged and at rest: the third picture repeats the second, and the renderer ends.
    simulator.publish(20.0, true);
    let output = ended(child);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!((full(3) / full(2) - 1.0).abs() < 1e-6);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(printed.lines().count(), 9, "three files a picture: {printed}");
    assert!(out.join("frame-0003-normal.png").exists());
    assert!(stderr(&output).contains("waiting"), "{}", stderr(&output));
}

#[test]
fn one_converged_picture_without_frames() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let mut simulator = Simulator::start(root.path());
    simulator.publish(10.0, false);
    let child = renderer(root.path(), &out, &[]);
    std::thread::sleep(Duration::from_millis(300));
    assert!(!out.exists(), "a picture before the light has converged");
    let last = simulator.publish(12.0, true);
    let output = ended(child);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(Film::read_exr(&out.join("frame-0001.exr")).unwrap().metadata.frame, Some(last));
}

#[test]
fn a_closed_channel_ends_it_with_the_last_frame() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let mut simulator = Simulator::start(root.path());
    let last = simulator.publish(10.0, false);
    let child = renderer(root.path(), &out, &[]);
    std::thread::sleep(Duration::from_millis(500));
    simulator.publisher.close();
    let output = ended(child);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(Film::read_exr(&out.join("frame-0001.exr")).unwrap().metadata.frame, Some(last));
}

#[test]
fn a_signal_ends_it_while_it_waits() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    // Nothing to attach to: it waits until it is told to stop.
    let child = renderer(root.path(), &out, &[]);
    std::thread::sleep(Duration::from_millis(500));
    let status = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    let output = ended(child);
    assert!(output.status.success(), "{}", stderr(&output));
}

/// The picture shows an object where the frame has it, not where the text puts it; a place that cannot be is told.
#[test]
fn moved_objects_are_followed() {
    let root = tempfile::tempdir().unwrap();
    let mut simulator = Simulator::start(root.path());
    let mut depth_after = |shift: f64, out: &str| {
        simulator.publish_moved(10.0, true, shift);
        let out = root.path().join(out);
        let output = ended(renderer(root.path(), &out, &["--show", "depth"]));
        let film = Film::read_exr(&out.join("frame-0001.exr"));
        (output, film.map(|film| film.layers()[0].pixels.clone()))
    };
    let (_, still) = depth_after(0.0, "still");
    let (output, moved) = depth_after(0.25, "moved");
    assert!(output.status.success(), "{}", stderr(&output));
    let (still, moved) = (still.unwrap(), moved.unwrap());
    assert_ne!(still, moved);
    assert_eq!(depth_after(0.0, "back").1.unwrap(), still);
    let (output, _) = depth_after(5e9, "beyond");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("object.sphere.world_from_loaded: found a vertex"),
        "{}",
        stderr(&output)
    );
}

const CHILD: &str = "PHOTONSTREAM_TEST_SIMULATOR";

/// Not a test of its own: the process that the next test kills. It publishes one frame of the given power.
#[test]
fn simulator_child() {
    let Ok(root) = std::env::var(CHILD) else { return };
    let power = std::env::var("PHOTONSTREAM_TEST_POWER").unwrap().parse().unwrap();
    let mut simulator = Simulator::start(Path::new(&root));
    simulator.publish(power, false);
    // Killed long before; ends by itself if the test is.
    std::thread::sleep(Duration::from_secs(60));
}

#[test]
fn a_killed_simulator_is_waited_for_and_its_successor_followed() {
    let root = tempfile::tempdir().unwrap();
    // Apart from the runtime folder, in which `clean` takes every folder for a channel's.
    let pictures = tempfile::tempdir().unwrap();
    let out = pictures.path().join("out");
    let simulate = |power: &str| {
        Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "attach::simulator_child"])
            .env(CHILD, root.path())
            .env("PHOTONSTREAM_TEST_POWER", power)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let mut renderer = renderer(root.path(), &out, &["--frames", "2"]);
    let mut first = simulate("10");
    wait_for(&out.join("frame-0001.png"));
    first.kill().unwrap();
    first.wait().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    assert!(renderer.try_wait().unwrap().is_none(), "the renderer ended with its simulator");
    let mut second = simulate("30");
    let output = ended(renderer);
    second.kill().unwrap();
    second.wait().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("the simulator has ended; keeping its last frame"),
        "{}",
        stderr(&output)
    );
    let mean = |n: u32| {
        let film = Film::read_exr(&out.join(format!("frame-000{n}.exr"))).unwrap();
        crate::scenes::mean(&film.layers()[0].pixels)
    };
    assert!((mean(2) / mean(1) - 3.0).abs() < 1e-5, "{} after {}", mean(2), mean(1));
    // What the killed simulator left in shared memory.
    photonstream_protocol::clean_in(&Runtime::at(root.path())).unwrap();
}
