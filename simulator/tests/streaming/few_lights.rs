//! Methods of few lights in a running service, as its readers see them.
#![allow(clippy::unwrap_used)]

use crate::{
    edits::values,
    service::{PATIENCE, start, start_with},
    service_edits::{flux, frame_where, is_converged},
    support::scene,
};
use photonstream_protocol::{Reply, Request, VslFrame};
use photonstream_scene::{Method, Scene, SceneConfig, VplVisibility};
use photonstream_simulator::{
    cli::Overrides,
    few_lights::FewLights,
    service::{ConfigSource, Options},
    simulation::Simulation,
};
use serde_json::{Value, json};
use std::sync::Arc;

/// A room of 4 m with a spot that shines down, and a VPL on each of floor and left wall.
fn room(streaming: &str) -> Scene {
    scene(&text(streaming))
}

fn text(streaming: &str) -> String {
    format!(
        "[material.a]\nalbedo = 0.6\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [4, 4, 4] }}\n\
         [light.torch]\npower_w = 30\nspot = {{ position_m = [0, 1, 0], direction = [0, -1, 0], outer_half_angle_deg = 25 }}\n\
         [[vpl]]\nposition_m = [0, -2, 0]\nnormal = [0, 1, 0]\nalbedo = 0.6\nweight = 1\n\
         [[vpl]]\nposition_m = [-2, 0, 0]\nnormal = [1, 0, 0]\nalbedo = 0.6\nweight = 1\n\
         [streaming]\nvsls = 60\npool_paths = 2000\npublish_period_ms = 1\n{streaming}\n"
    )
}

fn set_streaming(keys: Value) -> Request {
    Request::SetStreaming { values: values(keys) }
}

fn torch(keys: Value) -> Request {
    Request::SetLight { name: "torch".into(), values: values(keys) }
}

fn number(reply: &Reply) -> u64 {
    match reply {
        Reply::Ok { frame } => *frame,
        other => panic!("{other:?}"),
    }
}

fn expected(scene: &Scene, method: Method) -> Vec<[f32; 3]> {
    let mut few = FewLights::new(scene, method);
    few.update(scene, 0.0);
    few.lights().iter().map(|shown| shown.light.flux.to_array()).collect()
}

/// The first frame has the whole light, no path is traced, and a light that is dimmed is so in the promised frame.
#[test]
fn the_first_frame_is_whole_and_edits_are_instant() {
    let first = Simulation::new(Arc::new(room("method = \"static-vpl\"")));
    let service = start("few-first", &first, 1, None);
    let (mut subscriber, mut client) = (service.attach(), service.connect());
    let frame = frame_where(&mut subscriber, 1, |_| (), |_| true);
    assert_eq!(flux(&frame), expected(&first.scene, Method::StaticVpl));
    assert!(is_converged(&frame) && frame.vsls[0].flux[0] > 0.0 && frame.vsls[1].flux[0] == 0.0);
    assert_eq!((frame.vsls.len(), frame.patches.len(), frame.statistics.paths_total), (2, 2, 0));
    // An octagon for what shines.
    assert_eq!([frame.patches[0].count, frame.patches[1].count], [8, 0]);
    let reply = client.request(&torch(json!({ "power_w": 15 })), PATIENCE).unwrap();
    let dimmed = frame_where(&mut subscriber, number(&reply), |_| (), |_| true);
    let halved = frame.vsls[0].flux[0] * 0.5;
    assert!((dimmed.vsls[0].flux[0] / halved - 1.0).abs() < 1e-6, "{:?}", flux(&dimmed));
    let Reply::State { state } = client.request(&Request::Query, PATIENCE).unwrap() else { panic!() };
    assert_eq!(
        (&state["method"], &state["vsls"], &state["shining"]),
        (&json!("static-vpl"), &json!(2), &json!(1))
    );
    assert!(state["update_us"].as_f64().unwrap() > 0.0);
    service.end();
}

/// A running simulation changes its method, there and back: readers see the lights of each, of photons those of a simulation
/// of their own.
#[test]
fn methods_are_switched_while_it_runs() {
    let first = Simulation::new(Arc::new(room("")));
    let streamed = first.fill();
    let streamed: Vec<[f32; 3]> = streamed.readings(&first.scene).map(|r| r.flux.to_array()).collect();
    let service = start("few-switch", &first, 2, None);
    let (mut subscriber, mut client) = (service.attach(), service.connect());
    let before = frame_where(&mut subscriber, 1, |_| (), is_converged);
    assert_eq!(flux(&before), streamed);
    let mut last = before.frame;
    for method in [Method::StaticVpl, Method::PhantomVpl, Method::InstantRadiosity, Method::PhotonStreaming] {
        let reply = client.request(&set_streaming(json!({ "method": method.name() })), PATIENCE).unwrap();
        assert!(number(&reply) > last);
        let wanted = match method {
            Method::PhotonStreaming => streamed.clone(),
            few => expected(&room(&format!("method = \"{}\"", few.name())), few),
        };
        assert!(wanted.iter().flatten().any(|&x| x > 0.0));
        let is_there = |frame: &VslFrame| is_converged(frame) && flux(frame) == wanted;
        last = frame_where(&mut subscriber, number(&reply), |_| (), is_there).frame;
    }
    let reply = client.request(&set_streaming(json!({ "method": "static-vlp" })), PATIENCE).unwrap();
    assert!(matches!(reply, Reply::Error { .. }), "{reply:?}");
    service.end();
}

/// VPLs are moved, added and taken away while it runs, and settings changed; what makes no sense changes nothing.
#[test]
fn vpls_are_edited_while_it_runs() {
    let first = Simulation::new(Arc::new(room("method = \"static-vpl\"\ndistance_map_px = 8")));
    let service = start("few-edited", &first, 1, None);
    let (mut subscriber, mut client) = (service.attach(), service.connect());
    let before = frame_where(&mut subscriber, 1, |_| (), |_| true);
    let vpl = |x: f64| json!({ "position_m": [x, -2, 0], "normal": [0, 1, 0], "albedo": 0.6, "weight": 1 });
    let set = |keys: Value| Request::SetVpls { values: values(keys) };
    let three = json!({ "vpl": [vpl(0.0), vpl(0.5), vpl(1.9)], "vpls": { "second_bounce_distance_m": 2 } });
    let reply = client.request(&set(three), PATIENCE).unwrap();
    let more = frame_where(&mut subscriber, number(&reply), |_| (), |_| true);
    assert_eq!((more.vsls.len(), more.distances.len()), (3 + 1, 4 * 2));
    assert_eq!(more.vsls[0].flux, before.vsls[0].flux);
    assert_eq!(
        (more.vsls[1].position, more.vsls[2].flux),
        ([0.5, -2.0, 0.0], [0.0; 3]),
        "1.9 is beyond the cone"
    );
    assert!(more.vsls[1].flux[0] > 0.0 && more.vsls[3].flux[0] > 0.0);
    for (wrong, says) in [
        (json!({ "vpl": [] }), "photonstream place"),
        (json!({ "vpls": { "photons": 0 } }), "photons"),
        (json!({ "vpls": { "fotons": 1 } }), "fotons"),
        (json!({ "vlp": [] }), "vlp"),
    ] {
        match client.request(&set(wrong), PATIENCE).unwrap() {
            Reply::Error { message, .. } => assert!(message.contains(says), "{says}: {message}"),
            other => panic!("{other:?}"),
        }
    }
    // Other settings keep what was edited.
    let reply = client.request(&set_streaming(json!({ "publish_period_ms": 2 })), PATIENCE).unwrap();
    let kept = frame_where(&mut subscriber, number(&reply), |_| (), |_| true);
    assert_eq!(flux(&kept), flux(&more));
    service.end();
}

/// The config's method is changed where it lies: readers see the other light, edits of VPLs are saved into it and stay.
#[test]
fn configs_change_methods_and_take_edits() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.toml");
    let camera = "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n";
    let write =
        |streaming: &str| std::fs::write(&file, format!("# Mine.\n{}{camera}", text(streaming))).unwrap();
    write("");
    let mut source = ConfigSource::new(&file, Overrides::default());
    let first = Simulation::new(Arc::new(source.load().unwrap()));
    let options = Options { config: Some(source), threads: Some(1), ..Options::default() };
    let service = start_with("few-config", &first, options);
    let (mut subscriber, mut client) = (service.attach(), service.connect());
    let streamed = frame_where(&mut subscriber, 1, |_| (), is_converged);
    assert!(streamed.vsls.len() >= 60);
    write("method = \"static-vpl\"");
    let wanted = expected(&first.scene, Method::StaticVpl);
    let few = frame_where(&mut subscriber, 1, |_| (), |frame| flux(frame) == wanted);
    let vpl = json!({ "position_m": [0.25, -2, 0], "normal": [0, 1, 0], "albedo": 0.6, "weight": 1 });
    let set = Request::SetVpls { values: values(json!({ "vpl": [vpl] })) };
    let reply = client.request(&set, PATIENCE).unwrap();
    frame_where(&mut subscriber, number(&reply), |_| (), |frame| frame.vsls.len() == 1);
    // What is not saved: it stays as it was set all the same.
    let reply = client.request(&torch(json!({ "power_w": 15 })), PATIENCE).unwrap();
    let dimmed = frame_where(&mut subscriber, number(&reply), |_| (), |_| true);
    number(&client.request(&Request::SaveVpls {}, PATIENCE).unwrap());
    let saved = std::fs::read_to_string(&file).unwrap();
    assert!(saved.starts_with("# Mine.") && saved.contains("position_m = [0.25, -2.0, 0.0]"), "{saved}");
    assert_eq!(saved.matches("[[vpl]]").count(), 1);
    // What was saved is the config now, and the light stays.
    let reloaded = |frame: &VslFrame| frame.config_generation > few.config_generation;
    let after = frame_where(&mut subscriber, 1, |_| (), reloaded);
    assert_eq!((after.vsls.len(), after.vsls[0].position), (1, [0.25, -2.0, 0.0]));
    assert_eq!(flux(&after), flux(&dimmed));
    assert!(
        after.scene_text.contains("0.25") && !dimmed.scene_text.contains("0.25"),
        "who attaches now knows of it"
    );
    // Whoever changes the file afterwards has what it says, and that alone.
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("0.25", "0.125")).unwrap();
    let anew = |frame: &VslFrame| frame.config_generation > after.config_generation;
    let anew = frame_where(&mut subscriber, 1, |_| (), anew);
    assert_eq!(anew.vsls[0].position, [0.125, -2.0, 0.0]);
    assert!(anew.vsls[0].flux[0] > 1.5 * after.vsls[0].flux[0], "the torch has its power again");
    service.end();
}

/// Held at a moment, what moves with an object is where it is then: that is not written into a file that says where it is at
/// the beginning.
#[test]
fn held_scenes_are_not_saved_into_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.toml");
    let camera = "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n";
    let moving = "
        [object.lift]
        material = \"a\"
        box = { size_m = [0.2, 0.2, 0.2] }
        [[vpl]]
        position_m = [0, 0.1, 0]
        normal = [0, 1, 0]
        albedo = 0.5
        object = \"lift\"
        [[animation]]
        object = \"lift\"
        property = \"position_m\"
        times_s = [0, 2]
        values = [[0, 0, 0], [0, 1, 0]]
    ";
    let written = format!("{}{camera}{moving}", text("method = \"static-vpl\""));
    std::fs::write(&file, &written).unwrap();
    let mut source = ConfigSource::new(&file, Overrides { time: Some(1.0), ..Overrides::default() });
    let first = Simulation::new(Arc::new(source.load().unwrap()));
    let options = Options { config: Some(source), threads: Some(1), ..Options::default() };
    let service = start_with("few-held", &first, options);
    let mut client = service.connect();
    match client.request(&Request::SaveVpls {}, PATIENCE).unwrap() {
        Reply::Error { message, .. } => assert!(message.contains("--time"), "{message}"),
        other => panic!("{other:?}"),
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), written);
    service.end();
}

/// With `auto`, edits that leave a method without what it needs, or give it that, change the choice.
#[test]
fn edits_of_vpls_change_what_auto_chooses() {
    let first = Simulation::new(Arc::new(room("method = \"auto\"\nupdate_budget_us = 100")));
    assert_eq!(first.method, Method::PhantomVpl);
    let service = start("few-auto", &first, 1, None);
    let mut client = service.connect();
    let vpl = json!({ "position_m": [0, -2, 0], "normal": [0, 1, 0], "albedo": 0.6 });
    for (vpls, method) in [(json!([]), "instant-radiosity"), (json!([vpl]), "phantom-vpl")] {
        let set = Request::SetVpls { values: values(json!({ "vpl": vpls })) };
        number(&client.request(&set, PATIENCE).unwrap());
        let Reply::State { state } = client.request(&Request::Query, PATIENCE).unwrap() else { panic!() };
        assert_eq!(state["method"], method);
    }
    service.end();
}

/// A phantom goes from floor to wall in frames in between, and comes to rest exactly where the axis ends.
#[test]
fn phantoms_go_on_in_frames_of_their_own() {
    let first = Simulation::new(Arc::new(room("method = \"phantom-vpl\"")));
    let service = start("few-phantom", &first, 1, None);
    let (mut subscriber, mut client) = (service.attach(), service.connect());
    let frame = frame_where(&mut subscriber, 1, |_| (), is_converged);
    assert_eq!(frame.vsls[0].position, [0.0, -2.0, 0.0]);
    let reply = client.request(&torch(json!({ "direction": [-1, -1, 0] })), PATIENCE).unwrap();
    let mut on_the_way = 0;
    let rest = frame_where(
        &mut subscriber,
        number(&reply),
        |frame| on_the_way += u32::from(frame.vsls[0].position[0] > -1.9 && frame.vsls[0].position[0] < -0.1),
        is_converged,
    );
    // The axis from (0, 1, 0) meets the left wall at y = -1: but for the roundings of its direction.
    let [x, y, z] = rest.vsls[0].position;
    assert!((x + 2.0).abs() < 1e-6 && (y + 1.0).abs() < 1e-6 && z == 0.0, "{:?}", rest.vsls[0].position);
    assert!(on_the_way > 0, "24 ms are several frames");
    service.end();
}

/// In fixed steps a phantom follows in each of them, also while the animation holds still: the torch goes 1 m in five steps of
/// 10 ms and stays there; in a time constant of 200 ms each step goes 1 - exp(-0.05) of the way that is left. Tolerance: a
/// thousandth of the way for roundings of 60 steps and of the instants.
#[test]
fn phantoms_follow_in_fixed_steps_while_the_animation_holds() {
    let moving = "fixed_step_ms = 10\n[vpls]\nsmoothing_s = 0.2\n\
         [[animation]]\nlight = \"torch\"\nproperty = \"position_m\"\ntimes_s = [0, 0.05, 30]\n\
         values = [[0, 1, 0], [1, 1, 0], [1, 1, 0]]";
    let first = Simulation::new(Arc::new(room(&format!("method = \"phantom-vpl\"\n{moving}"))));
    let service = start("few-steps", &first, 1, None);
    let mut subscriber = service.attach();
    let mut seen = Vec::new();
    let see = |frame: &VslFrame| seen.push((frame.statistics.simulation_time_s, frame.vsls[0].position[0]));
    frame_where(&mut subscriber, 1, see, |frame| frame.statistics.simulation_time_s > 0.6);
    let mut along = vec![0.0f64];
    for step in 1..=100 {
        let (target, last) = ((f64::from(step) / 5.0).min(1.0), along[along.len() - 1]);
        along.push(last + (target - last) * (1.0 - (-0.05f64).exp()));
    }
    let held = seen.iter().filter(|(time_s, _)| *time_s > 0.06).count();
    assert!(held > 5, "{seen:?}");
    for (time_s, x) in &seen {
        let expected = along[(time_s * 100.0).round() as usize];
        assert!((f64::from(*x) - expected).abs() < 1e-3, "{time_s} s: {x}, expected {expected}");
    }
    service.end();
}

/// Renderers that shadow by distance maps have them of few lights, too.
#[test]
fn few_lights_have_distance_maps() {
    let first = Simulation::new(Arc::new(room("method = \"static-vpl\"\ndistance_map_px = 16")));
    let service = start("few-maps", &first, 1, None);
    let mut subscriber = service.attach();
    let frame = frame_where(&mut subscriber, 1, |_| (), |_| true);
    assert_eq!(frame.distances.len(), 2 * 16 * 16 / 32);
    // The VPL that shines sees the room in all directions, the other one is not traced.
    let (shining, dark) = frame.distances.split_at(8);
    assert!(shining.iter().all(|record| record.texels.iter().all(|&t| t & 0xffff != 0 && t >> 16 != 0)));
    assert!(dark.iter().all(|record| record.texels.iter().all(|&t| t == 0)));
    service.end();
}

/// Paper B's figure 10: with the door closed no VPL of the room has light, by blockers as by rays; the wider it stands open,
/// the more light there is, and none of it before it opens. Times are those of the config's animation.
#[test]
fn a_closed_door_keeps_the_room_dark() {
    for visibility in [VplVisibility::Blockers, VplVisibility::Rays] {
        let total = |time_s: f64| -> f32 {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/door-room.toml");
            let mut config = SceneConfig::from_file(&path).unwrap().at(time_s).unwrap();
            config.streaming.method = Some(Method::StaticVpl);
            config.vpls.get_or_insert_default().visibility = Some(visibility);
            let scene = config.build().unwrap();
            // What hangs on the leaf is lit from outside once it has turned; the room is what does not move.
            let inside = |index: usize| scene.vpls.vpls[index].object.is_none();
            let lit = expected(&scene, Method::StaticVpl);
            assert!(lit.len() > 10);
            lit.iter().enumerate().filter(|(index, _)| inside(*index)).map(|(_, flux)| flux[0]).sum()
        };
        let totals: Vec<f32> = [0.0, 0.9, 2.0, 2.6, 3.2, 4.0, 5.0, 8.0].map(total).to_vec();
        assert_eq!(totals[..2], [0.0; 2], "{visibility:?}: {totals:?}");
        assert!(totals.windows(2).all(|pair| pair[1] >= pair[0]), "{visibility:?}: {totals:?}");
        assert!(totals[7] > 1.0 && totals[7] == totals[6], "{visibility:?}: {totals:?}");
    }
}
