//! Turns an edit of a mesh into the scenes that the window is given.
#![allow(clippy::unwrap_used)]

use super::*;
use photonstream_protocol::{
    FrameSource, NOTICE_CAPACITY, Publisher, Runtime, SegmentSpec, StatisticsRecord,
};
use photonstream_simulator::records::{light_records, object_records};

const ROOM: &str = "origin_m = [0, 0, 0]\n[camera]\nposition_m = [0, 0, 3]\ntarget_m = [0, 0, 0]\n\
    vertical_fov_deg = 40\n[material.a]\nalbedo = 0.5\n[light.lamp]\npower_w = 3\npoint = { position_m = [0, 1, 0] }\n";

fn spec(scene: &Scene) -> SegmentSpec {
    SegmentSpec {
        vsl_capacity: 1,
        distance_capacity: 0,
        object_capacity: 4,
        light_capacity: 4,
        scene_text_capacity: 4096,
        notice_capacity: NOTICE_CAPACITY,
        scene_hash: scene.hash,
        slots: 3,
    }
}

fn publish(publisher: &mut Publisher, scene: &Scene) {
    publisher.replace_segment(&spec(scene)).unwrap();
    let source = FrameSource {
        vsls: &[],
        changed: None,
        patches: &[],
        patches_changed: None,
        distances: &[],
        distances_changed: None,
        objects: &object_records(scene),
        lights: &light_records(scene),
        statistics: &StatisticsRecord::default(),
        scene_text: &scene.resolved_text,
        notice: "",
        config_generation: 1,
        simulation_time_s: 0.0,
    };
    publisher.publish(&source).unwrap();
}

/// The next frame with its scene, or what is wrong with it.
fn next(follower: &mut Follower<impl Fn()>, subscriber: &mut Subscriber) -> Result<Published, String> {
    loop {
        match follower.read(subscriber) {
            Ok(Some(published)) => return Ok(published),
            Ok(None) => _ = subscriber.wait(Duration::from_millis(5)),
            Err(error) => return Err(error.to_string()),
        }
    }
}

/// The text, the objects and their places stay; the mesh alone changes, and the frame comes while it is half written: that
/// is told, and the frame is shown once the file is whole, though no other frame comes.
#[test]
fn an_edited_mesh_is_loaded_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roof.obj");
    let text = format!("{ROOM}[object.roof]\nmaterial = \"a\"\nobj = {{ path = {path:?} }}\n");
    let write = |face: &str| {
        let corners = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n";
        std::fs::write(&path, format!("{corners}f 1 2 3\n{face}")).unwrap();
    };
    let scene = |face: &str| {
        write(face);
        Scene::from_resolved(&text).unwrap()
    };
    // The second triangle looks up or down: the bounds, and with them all records, are the same.
    let (up, down) = (scene("f 1 3 4\n"), scene("f 1 4 3\n"));
    assert_eq!((&up.resolved_text, object_records(&up)), (&down.resolved_text, object_records(&down)));
    assert_ne!((&up.geometry, up.hash), (&down.geometry, down.hash));

    let (runtime, channel) = (Runtime::at(folder.path().join("run")), ChannelName::default());
    let mut publisher = Publisher::create_in(&runtime, &channel, &spec(&up)).unwrap();
    let mut subscriber = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let mut follower = Follower {
        shared: Arc::default(),
        cancelled: Arc::default(),
        wake: || {},
        scene: PublishedScene::default(),
        known: None,
        refused: None,
    };
    write("f 1 3 4\n");
    publish(&mut publisher, &up);
    assert_eq!(next(&mut follower, &mut subscriber).unwrap().scene.geometry, up.geometry);
    write("f 1 4 9\n");
    publish(&mut publisher, &down);
    let problem = next(&mut follower, &mut subscriber).unwrap_err();
    assert!(problem.contains("roof.obj"), "{problem}");
    write("f 1 4 3\n");
    let published = next(&mut follower, &mut subscriber).unwrap();
    assert_eq!(published.frame.frame, publisher.frame());
    assert_eq!(published.scene.geometry, down.geometry);
}
