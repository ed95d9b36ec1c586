//! Turns a story of edited assets into what a running renderer makes of it.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::published::tests::{ROOM, frame};
use clap::Parser;
use glam::Vec3;
use photonstream_film::Film;
use photonstream_protocol::{ChannelName, FrameSource, Publisher, Runtime, SegmentSpec};
use photonstream_scene::Scene;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    args: Args,
}

/// Shows nothing, and notes how many triangles there were to show.
#[derive(Default)]
struct Counting {
    triangles: Vec<usize>,
}

impl FrameRenderer for Counting {
    fn render(
        &mut self,
        scene: &Scene,
        _: &VslFrame,
        _: &crate::RenderOptions,
        _: Watch<'_>,
    ) -> Result<Rendered, RenderError> {
        self.triangles.push(scene.geometry.triangles.len());
        let mut film = Film::new(1, 1)?;
        film.push("full", vec![Vec3::ZERO])?;
        Ok(Rendered { film, stats: RenderStats::default() })
    }
}

/// Publishes a frame of `scene` in a segment of its own, as a simulator does with another scene.
fn publish(publisher: &mut Publisher, scene: &Scene) {
    let frame = frame(scene);
    publisher.replace_segment(&spec(scene)).unwrap();
    let source = FrameSource {
        vsls: &[],
        changed: None,
        patches: &[],
        patches_changed: None,
        distances: &[],
        distances_changed: None,
        objects: &frame.objects,
        lights: &frame.lights,
        statistics: &frame.statistics,
        scene_text: &frame.scene_text,
        notice: "",
        config_generation: 1,
        simulation_time_s: 0.0,
    };
    publisher.publish(&source).unwrap();
}

fn spec(scene: &Scene) -> SegmentSpec {
    SegmentSpec {
        vsl_capacity: 1,
        distance_capacity: 0,
        object_capacity: 16,
        light_capacity: 4,
        scene_text_capacity: 4096,
        notice_capacity: photonstream_protocol::NOTICE_CAPACITY,
        scene_hash: scene.hash,
        slots: 3,
    }
}

/// A mesh of which not all vertices are written.
const HALF: &str = "v 0 0 0\nf 1 2 3\n";

/// Four pictures are asked for. After the first one the mesh is edited under the same text: half of it is written when the
/// frame comes, then a group too many, then all of it, while no newer frame comes; then it is edited once more. The run
/// goes on through all of it, shows each whole mesh once, and no half of one. Before the first picture a scene that cannot
/// be loaded ends the run.
#[test]
fn a_bad_scene_in_mid_run_keeps_the_last_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roof.obj");
    let mesh = |faces: usize| {
        let face =
            |i| format!("v 0 {i} 0\nv 1 {i} 0\nv 0 {i} 1\nf {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3);
        (0..faces).map(face).collect::<String>()
    };
    let text =
        format!("origin_m = [0, 0, 0]\n{ROOM}[object.roof]\nmaterial = \"a\"\nobj = {{ path = {path:?} }}\n");
    let write = |content: &str| std::fs::write(&path, content).unwrap();
    let scene = |faces: usize| {
        write(&mesh(faces));
        Scene::from_resolved(&text).unwrap()
    };
    let scenes = [1, 2, 3].map(scene);
    let counts = scenes.each_ref().map(|scene| scene.geometry.triangles.len());

    let (runtime, channel) = (Runtime::at(folder.path().join("run")), ChannelName::default());
    let mut publisher = Publisher::create_in(&runtime, &channel, &spec(&scenes[0])).unwrap();
    let out = folder.path().to_str().unwrap();
    let args = Command::try_parse_from(["r", "--out", out, "--frames", "4"]).unwrap().args;
    let (cancelled, mut shown) = (AtomicBool::new(false), Counting::default());
    let mut subscriber = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let turns = |run: &mut Run<'_>, subscriber: &mut Subscriber, until: &dyn Fn(&Run<'_>) -> bool| {
        while !until(run) {
            assert_eq!(run.turn(subscriber).unwrap(), None);
            subscriber.wait(Duration::from_millis(5));
        }
    };

    let mut no_news = |_: &Written<'_>| {};
    let mut early = Run::new(&args, &mut shown, &cancelled, &mut no_news);
    write(HALF);
    publish(&mut publisher, &scenes[0]);
    let error = loop {
        match early.turn(&mut subscriber) {
            Err(error) => break error,
            Ok(ended) => assert_eq!(ended, None),
        }
    };
    assert!(matches!(error, RenderError::Scene { .. }), "{error}");

    let mut run = Run::new(&args, &mut shown, &cancelled, &mut no_news);
    write(&mesh(1));
    publish(&mut publisher, &scenes[0]);
    turns(&mut run, &mut subscriber, &|run| run.pictures == 1);
    write(HALF);
    publish(&mut publisher, &scenes[1]);
    turns(&mut run, &mut subscriber, &|run| run.refused.is_some());
    let reason = run.refused.clone();
    assert!(reason.as_ref().unwrap().contains("roof.obj"), "{reason:?}");
    write(&format!("{}g more\nf 1 2 3\n", mesh(2)));
    turns(&mut run, &mut subscriber, &|run| run.refused != reason);
    assert!(run.refused.as_ref().unwrap().contains("objects are published"), "{:?}", run.refused);
    assert_eq!(run.pictures, 1);
    write(&mesh(2));
    turns(&mut run, &mut subscriber, &|run| run.pictures == 2);
    assert_eq!((run.refused.as_deref(), run.last.as_ref().unwrap().frame), (None, publisher.frame()));
    write(&mesh(3));
    publish(&mut publisher, &scenes[2]);
    turns(&mut run, &mut subscriber, &|run| run.pictures == 3);
    publish(&mut publisher, &scenes[2]);
    while run.turn(&mut subscriber).unwrap() != Some(Ended::Done) {}
    assert_eq!(run.pictures, 4);
    assert_eq!(shown.triangles, [counts[0], counts[1], counts[2], counts[2]]);
}
