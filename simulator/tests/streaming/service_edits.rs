//! Edits through the control socket of a running service, as its readers see them.
#![allow(clippy::unwrap_used)]

use crate::{
    edits::{room, values},
    service::{PATIENCE, Service, start},
};
use photonstream_protocol::{Reading, Reply, Request, Subscriber, VslFrame};
use photonstream_scene::Scene;
use photonstream_simulator::simulation::Simulation;
use serde_json::{Value, json};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

fn set_light(name: &str, keys: Value) -> Request {
    Request::SetLight { name: name.into(), values: values(keys) }
}

fn move_object(name: &str, keys: Value) -> Request {
    Request::MoveObject { name: name.into(), values: values(keys) }
}

/// The first frame from `number` on that satisfies `wanted`; `seen` is shown every frame on the way.
pub(crate) fn frame_where(
    subscriber: &mut Subscriber,
    number: u64,
    mut seen: impl FnMut(&VslFrame),
    wanted: impl Fn(&VslFrame) -> bool,
) -> VslFrame {
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        let new = subscriber.read().unwrap() == Reading::New;
        if let Some(frame) = subscriber.frame().filter(|f| f.frame >= number) {
            if new {
                seen(frame);
            }
            if wanted(frame) {
                return frame.clone();
            }
        }
        subscriber.wait(Duration::from_millis(50));
    }
    panic!("no such frame within {PATIENCE:?}");
}

pub(crate) fn is_converged(frame: &VslFrame) -> bool {
    frame.statistics.converged == 1
}

pub(crate) fn flux(frame: &VslFrame) -> Vec<[f32; 3]> {
    frame.vsls.iter().map(|v| v.flux).collect()
}

/// What a simulation with the placement and split of `first` makes of `scene`.
fn expected(first: &Simulation, scene: Scene) -> (Simulation, Vec<[f32; 3]>) {
    let simulation = first.with_scene(Arc::new(scene));
    let flux = simulation.fill().readings(&simulation.scene).map(|r| r.flux.to_array()).collect();
    (simulation, flux)
}

fn end(service: Service) {
    service.end();
}

/// Frames show the object in its new place from the promised one on, full of light on the way to that of the new place.
#[test]
fn a_moved_object_is_shown_and_its_light_follows() {
    for threads in [1, 4] {
        let first = Simulation::new(Arc::new(room("")));
        let service = start(&format!("moved{threads}"), &first, threads, None);
        let mut subscriber = service.attach();
        let mut client = service.connect();
        let before = frame_where(&mut subscriber, 1, |_| (), is_converged);
        assert_eq!((before.statistics.stale_share, before.statistics.edit_received_ns), (0.0, 0));

        let keys = json!({ "position_m": [0.3, 0.1, -0.2], "rotation_deg": [0, 45, 0] });
        let Reply::Ok { frame: number } =
            client.request(&move_object("ball", keys.clone()), PATIENCE).unwrap()
        else {
            panic!()
        };
        assert!(number > before.frame);
        let mut edit = first.scene.edit();
        edit.move_object("ball", &values(keys)).unwrap();
        let (moved, light) = expected(&first, edit.finish());
        let ball = moved.scene.object("ball").unwrap().0 as usize;
        let total = |frame: &VslFrame| frame.vsls.iter().map(|v| f64::from(v.flux[0])).sum::<f64>();
        let after = frame_where(
            &mut subscriber,
            number,
            |frame| {
                let motion = moved.scene.objects[ball].world_from_rest.to_cols_array();
                assert_eq!(frame.objects[ball].world_from_object, motion);
                assert_eq!(
                    (frame.objects[ball].generation, frame.objects[0].generation),
                    (1, u32::from(ball == 0))
                );
                for (record, vsl) in frame.vsls.iter().zip(&moved.placement.vsls) {
                    assert_eq!(record.position, vsl.position_ws(&moved.scene.geometry).to_array());
                    assert_eq!(record.normal, vsl.normal_ws(&moved.scene.geometry).to_array());
                    assert_eq!(record.area, vsl.area);
                }
                // Moving the ball changes some per cent of all light; darkness or doubling would be far outside.
                assert!((total(frame) / total(&before) - 1.0).abs() < 0.1);
                assert_eq!(is_converged(frame), frame.statistics.stale_share == 0.0);
                assert_eq!(frame.statistics.pool_valid, frame.statistics.pool_paths);
                assert_eq!(frame.scene_text, before.scene_text);
            },
            is_converged,
        );
        assert!(flux(&after) == light, "{threads} threads");
        let statistics = after.statistics;
        assert!(statistics.edit_received_ns > before.statistics.published_ns);
        assert!(statistics.traced_ns > statistics.edit_received_ns);
        assert!(statistics.published_ns > statistics.traced_ns);
        end(service);
    }
}

/// Lights' records change at once, and power needs no ray.
#[test]
fn lights_are_set_and_switched() {
    let first = Simulation::new(Arc::new(room("")));
    let service = start("lights", &first, 2, None);
    let mut subscriber = service.attach();
    let mut client = service.connect();
    let before = frame_where(&mut subscriber, 1, |_| (), is_converged);
    let mut scene = (*first.scene).clone();
    for (step, keys) in
        [json!({ "power_w": [9, 1, 0] }), json!({ "enabled": false }), json!({ "enabled": true })]
            .iter()
            .enumerate()
    {
        let reply = client.request(&set_light("bulb", keys.clone()), PATIENCE).unwrap();
        let Reply::Ok { frame: number } = reply else { panic!("{reply:?}") };
        let frame = frame_where(&mut subscriber, number, |_| (), |_| true);
        let mut edit = scene.edit();
        edit.set_light("bulb", &values(keys.clone())).unwrap();
        scene = edit.finish();
        assert_eq!(flux(&frame), expected(&first, scene.clone()).1);
        assert_eq!((frame.lights[0].enabled == 1, frame.lights[0].generation), (step != 1, step as u32 + 1));
        assert_eq!(frame.lights[1], before.lights[1]);
        assert!(is_converged(&frame));
        assert_eq!(frame.statistics.paths_total, before.statistics.paths_total, "no ray");
    }
    let request = set_light("cone", json!({ "spot.position_m": [0, 0.5, 0] }));
    let Reply::Ok { frame: number } = client.request(&request, PATIENCE).unwrap() else { panic!() };
    let mut edit = scene.edit();
    edit.set_light("cone", &values(json!({ "position_m": [0, 0.5, 0] }))).unwrap();
    let light = expected(&first, edit.finish()).1;
    let shown = |frame: &VslFrame| assert_eq!(frame.lights[1].position, [0.0, 0.5, 0.0]);
    let after = frame_where(&mut subscriber, number, shown, is_converged);
    assert!(flux(&after) == light);
    end(service);
}

/// Four clients drag at once, 40 edits each, every one its own thing: what each set last is simulated to the end.
#[test]
fn a_storm_of_edits_ends_in_the_last_ones() {
    let first = Simulation::new(Arc::new(room("")));
    let service = start("storm", &first, 2, None);
    let mut subscriber = service.attach();
    let last = |name: &str, step: u32| {
        let x = 0.01 * f64::from(step) - 0.2;
        match name {
            "ball" | "crate" => move_object(name, json!({ "position_m": [x, 0.1, -x] })),
            "bulb" => set_light(name, json!({ "position_m": [-x, 0.2, 0.6] })),
            _ => set_light(name, json!({ "power_w": 1.0 + x })),
        }
    };
    let names = ["ball", "crate", "bulb", "cone"];
    std::thread::scope(|scope| {
        for name in names {
            let mut client = service.connect();
            scope.spawn(move || {
                for step in 0..40 {
                    let reply = client.request(&last(name, step), PATIENCE).unwrap();
                    assert!(matches!(reply, Reply::Ok { .. }), "{reply:?}");
                }
            });
        }
    });
    let mut edit = first.scene.edit();
    for name in names {
        match last(name, 39) {
            Request::MoveObject { name, values } => _ = edit.move_object(&name, &values).unwrap(),
            Request::SetLight { name, values } => _ = edit.set_light(&name, &values).unwrap(),
            _ => unreachable!(),
        }
    }
    let (simulation, light) = expected(&first, edit.finish());
    let crate_ = simulation.scene.object("crate").unwrap().0 as usize;
    let motion = simulation.scene.objects[crate_].world_from_rest.to_cols_array();
    let is_last = |f: &VslFrame| is_converged(f) && f.objects[crate_].world_from_object == motion;
    let frame = frame_where(&mut subscriber, 1, |_| (), |f| is_last(f) && flux(f) == light);
    assert_eq!(frame.statistics.stale_share, 0.0);
    end(service);
}

/// A pause holds light back, not what is shown; a limit of paths holds back new samples, not the light of an edit.
#[test]
fn edits_meet_pauses_and_limits() {
    let first = Simulation::new(Arc::new(room("sampling = \"fresh\"")));
    let service = start("pause", &first, 2, Some(6000));
    let mut subscriber = service.attach();
    let mut client = service.connect();
    frame_where(&mut subscriber, 1, |_| (), is_converged);
    assert!(matches!(client.request(&Request::Pause, PATIENCE).unwrap(), Reply::Ok { .. }));
    let request = move_object("ball", json!({ "position_m": [0.2, 0, 0] }));
    let Reply::Ok { frame: number } = client.request(&request, PATIENCE).unwrap() else { panic!() };
    let frame = frame_where(&mut subscriber, number, |_| (), |_| true);
    let stale = frame.statistics.stale_share;
    assert!(stale > 0.0 && stale < 1.0 && frame.statistics.converged == 0, "{stale}");
    assert!(matches!(client.request(&Request::Resume, PATIENCE).unwrap(), Reply::Ok { .. }));
    let after = frame_where(&mut subscriber, number, |_| (), is_converged);
    // Each stale slot again, once; a path of fresh samples that was valid is not replaced beyond the limit.
    let paths = after.statistics.paths_total - frame.statistics.paths_total;
    let slots = after.statistics.pool_paths as f64;
    assert_eq!((after.statistics.stale_share, paths as f64), (0.0, (stale * slots).round()));
    end(service);
}

#[test]
fn bad_edits_are_refused_and_change_nothing() {
    let first = Simulation::new(Arc::new(room("")));
    let service = start("refused", &first, 1, None);
    let mut subscriber = service.attach();
    let mut client = service.connect();
    let before = frame_where(&mut subscriber, 1, |_| (), is_converged);
    for (request, expected_code, part) in [
        (set_light("blub", json!({ "power_w": 1 })), "unknown-name", "did you mean \"bulb\"?"),
        (set_light("bulb", json!({ "power": 1 })), "unknown-key", "did you mean \"power_w\"?"),
        (
            set_light("bulb", json!({ "power_w": -1 })),
            "invalid-value",
            "light.bulb.power_w: found [-1, -1, -1]",
        ),
        (move_object("bell", json!({ "position_m": [0, 0, 0] })), "unknown-name", "did you mean \"ball\"?"),
        (move_object("ball", json!({ "position_m": "up" })), "invalid-value", "expected three numbers"),
        (Request::Reload, "unsupported", "not started from a config file"),
    ] {
        match client.request(&request, PATIENCE).unwrap() {
            Reply::Error { code, message } => {
                assert_eq!(code, expected_code, "{message}");
                assert!(message.contains(part), "{message}");
            }
            other => panic!("{other:?}"),
        }
    }
    // An edit that changes nothing is an edit, too; the next frame is as the last.
    let request = move_object("ball", json!({ "position_m": [0, 0, 0] }));
    let Reply::Ok { frame: number } = client.request(&request, PATIENCE).unwrap() else { panic!() };
    let after = frame_where(&mut subscriber, number, |_| (), |_| true);
    assert_eq!(
        (flux(&after), &after.objects, &after.lights),
        (flux(&before), &before.objects, &before.lights)
    );
    assert!(is_converged(&after));
    end(service);
}
