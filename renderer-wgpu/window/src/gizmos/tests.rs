//! Turns hands on gizmos of the Cornell box into checks of the tables that are sent.

use super::{outline, *};
use crate::{
    commands::Told,
    following::{Connection, News, Published},
    navigation::project,
    pointer::Button,
    session::{Selected, Session},
    standing::Standing,
};
use clap::Parser;
use glam::{DAffine3, DVec3, Vec3};
use photonstream_protocol::{Liveness, Request, VslFrame, VslRecord};
use photonstream_scene::{LightId, Scene, SceneConfig, vpls::ProxyShape};
use serde_json::Value;
use std::{path::Path, sync::Arc, time::Instant};
use winit::keyboard::KeyCode;

/// The first VPL on the floor, the second on the ceiling, the third on the sphere, which may move, the fourth behind the box.
const TABLES: &str = r#"
    [[vpl]]
    position_m = [0.8, 0, 0.8]
    normal = [0, 1, 0]
    albedo = 0.75
    weight = 2.0
    [[vpl]]
    position_m = [0, 2, 0]
    normal = [0, -1, 0]
    albedo = 0.75
    [[vpl]]
    position_m = [0.42, 0.72, 0.3]
    normal = [0, 1, 0]
    albedo = [0.25, 0.4, 0.75]
    object = "sphere"
    [[vpl]]
    position_m = [-0.5, 0.5, -1]
    normal = [0, 0, 1]
    albedo = 0.75
    [[blocker]]
    position_m = [0.42, 0.36, 0.3]
    radius_m = 0.36
    object = "sphere"
    [[proxy]]
    position_m = [-0.38, 0.55, -0.35]
    rotation_deg = [0, 18, 0]
    box = { size_m = [0.55, 1.1, 0.55] }
"#;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    args: crate::Args,
}

fn scene(more: &str) -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/cornell-box.toml");
    let text = std::fs::read_to_string(path).unwrap() + more;
    SceneConfig::from_text(&text, Path::new(path)).unwrap().build().unwrap()
}

fn published(at_rest: &Scene, scene: Scene) -> Published {
    let frame = VslFrame {
        epoch: 1,
        frame: 7,
        scene_text: Arc::clone(&scene.resolved_text),
        scene_hash: scene.hash,
        ..VslFrame::default()
    };
    let standing = Arc::new(Standing::of(at_rest));
    Published { frame: Arc::new(frame), scene: Arc::new(scene), standing }
}

fn accept(session: &mut Session, published: Published) {
    let connection = Connection::Attached(Liveness::Live);
    session.accept(News { published: Some(published), connection, ..News::default() });
}

fn session_of(scene: Scene) -> Session {
    let mut session = Session::new(Command::parse_from(["w"]).args);
    session.size = (600, 600);
    session.shows_gizmos = true;
    accept(&mut session, published(&scene.clone(), scene));
    session
}

fn session() -> Session {
    session_of(scene(TABLES))
}

fn on_screen(session: &Session, config_m: [f64; 3]) -> [f32; 2] {
    let point = DVec3::from(config_m) - session.scene().unwrap().origin_m;
    project(session.navigation.as_ref().unwrap().camera(), point.as_vec3(), 600, 600).unwrap()
}

/// The lists that would be sent now.
fn sent(session: &mut Session) -> serde_json::Map<String, Value> {
    session.send_gizmos();
    match session.outbox.pop() {
        Some(Request::SetVpls { values }) => values,
        other => panic!("{other:?}"),
    }
}

fn numbers(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap()
}

fn assert_near(found: [f64; 3], expected: [f64; 3]) {
    let distance = DVec3::from(found).distance(expected.into());
    // Pixels become metres in f32, and tables are written to 1e-5 of two metres.
    assert!(distance < 1e-4, "{found:?}, expected {expected:?}");
}

#[test]
fn the_nearest_gizmo_is_taken_and_a_hidden_one_only_from_half_as_far() {
    let session = session();
    let at = |config_m, right: f32| {
        let [x, y] = on_screen(&session, config_m);
        session.gizmo_at([x + right, y]).map(|(_, gizmo, _)| gizmo)
    };
    assert_eq!(at([0.8, 0.0, 0.8], 6.0), Some(Gizmo::Vpl(0)));
    assert_eq!(at([0.8, 0.0, 0.8], 14.0), None);
    assert_eq!(at([0.0, 2.0, 0.0], 9.0), Some(Gizmo::Vpl(1)));
    // The middle of the blocker is inside the sphere, and its rim is around it.
    assert_eq!(at([0.42, 0.36, 0.3], 4.0), Some(Gizmo::Blocker(0)));
    let ([x, y], rim) = (on_screen(&session, [0.42, 0.36, 0.3]), on_screen(&session, [0.78, 0.36, 0.3]));
    let seen: Vec<_> = (0..12).map(|i| session.gizmo_at([rim[0] + i as f32 - 6.0, y]).map(|g| g.1)).collect();
    assert!(seen.contains(&Some(Gizmo::Blocker(0))), "{seen:?} {x}");
    // Behind the box: from 4 of 10 points it is taken, from 7 it is not.
    assert_eq!(at([-0.5, 0.5, -1.0], 4.0), Some(Gizmo::Vpl(3)));
    assert_ne!(at([-0.5, 0.5, -1.0], 7.0), Some(Gizmo::Vpl(3)));
    let mut session = session;
    session.shows_gizmos = false;
    assert_eq!(session.gizmo_at(on_screen(&session, [0.8, 0.0, 0.8])), None);
}

#[test]
fn a_dragged_vpl_takes_its_place_and_leaves_all_else_as_it_was() {
    let mut session = session();
    let before = session.gizmos.tables().clone();
    let [x, y] = on_screen(&session, [0.8, 0.0, 0.8]);
    session.point([x, y]);
    session.press(Button::Left);
    assert_eq!(session.selected, Some(Selected::Gizmo(Gizmo::Vpl(0))));
    session.point([x - 20.0, y - 30.0]);
    session.point([x - 40.0, y - 60.0]);
    let values = sent(&mut session);
    assert_eq!(values.keys().collect::<Vec<_>>(), ["vpl"], "one request, and only the list that changed");
    let list = values["vpl"].as_array().unwrap();
    let place = numbers(&list[0]["position_m"]);
    // The view is along -z: parallel to the screen z stays, to f32 rounding of pixels.
    assert!(place[0] < 0.75 && place[1] > 0.05 && (place[2] - 0.8).abs() < 1e-4, "{place:?}");
    assert_eq!(list[0]["weight"], 2.0);
    let mut expected = before.clone();
    expected.vpl[0].position_m.0 = place;
    assert_eq!(*session.gizmos.tables(), expected);
    // Escape puts it back.
    assert!(session.put_back());
    assert_eq!(*session.gizmos.tables(), before);
    sent(&mut session);
    session.send_gizmos();
    assert!(session.outbox.is_empty(), "nothing is sent twice");
}

#[test]
fn with_control_a_vpl_goes_along_surfaces_and_takes_their_normals() {
    let mut session = session();
    let from = on_screen(&session, [0.0, 2.0, 0.0]);
    session.point(from);
    session.press(Button::Left);
    session.pointer.control = true;
    session.point(on_screen(&session, [0.3, 2.0, -0.4]));
    let list = sent(&mut session)["vpl"].clone();
    assert_near(numbers(&list[1]["position_m"]), [0.3, 2.0, -0.4]);
    assert_near(numbers(&list[1]["normal"]), [0.0, -1.0, 0.0]);
    session.point(on_screen(&session, [1.0, 1.5, 0.2]));
    let list = sent(&mut session)["vpl"].clone();
    assert_near(numbers(&list[1]["position_m"]), [1.0, 1.5, 0.2]);
    assert_near(numbers(&list[1]["normal"]), [-1.0, 0.0, 0.0]);
}

/// The sphere goes 0.5 m to the left, 0.2 m up, and turns by a right angle about y. A VPL that moves with it is seen there, and
/// is written where it would be had the sphere stayed.
#[test]
fn what_moves_with_an_object_is_written_as_the_scene_is_loaded() {
    let at_rest = scene(TABLES);
    let id = at_rest.object("sphere").unwrap();
    let shift = DVec3::new(-0.5, 0.2, 0.0);
    let turn = DAffine3::from_rotation_y(core::f64::consts::FRAC_PI_2);
    let loaded = at_rest.world_from_loaded(id);
    let mut moved = loaded * turn;
    moved.translation = loaded.translation + shift;
    let scene = at_rest.with_object_placed(id, moved).unwrap();
    let mut session = session_of(at_rest.clone());
    accept(&mut session, published(&at_rest, scene));
    let seen = on_screen(&session, [0.42 - 0.5, 0.72 + 0.2, 0.3]);
    assert_eq!(session.gizmo_at(seen).map(|g| g.1), Some(Gizmo::Vpl(2)));
    // 0.1 m along x in the world is 0.1 m along z before the turn: Ry(90°) leads z to x.
    let to = DVec3::new(0.02, 0.92, 0.3);
    session.move_gizmo(Gizmo::Vpl(2), to - at_rest.origin_m, Some(DVec3::X), Instant::now());
    let list = sent(&mut session)["vpl"].clone();
    assert_near(numbers(&list[2]["position_m"]), [0.42, 0.72, 0.4]);
    assert_near(numbers(&list[2]["normal"]), [0.0, 0.0, 1.0]);
    let (_, place) = session.gizmo_place(Gizmo::Vpl(2)).unwrap();
    assert!((place + at_rest.origin_m).distance(to) < 1e-4, "{place}");
    // What is added to a thing that has been moved moves with it.
    session.point(on_screen(&session, [-0.08, 0.56, 0.66]));
    session.key(KeyCode::KeyV, true, false);
    let list = sent(&mut session)["vpl"].clone();
    assert_eq!(list[4]["object"], "sphere");
    let (_, place) = session.gizmo_place(Gizmo::Vpl(4)).unwrap();
    let from_middle = (place + at_rest.origin_m).distance(DVec3::new(-0.08, 0.56, 0.3));
    // The sphere is one of triangles.
    assert!((from_middle - 0.36).abs() < 0.01, "{from_middle}");
}

#[test]
fn things_are_added_where_the_cursor_meets_a_surface_and_removed_by_number() {
    let mut session = session();
    session.point(on_screen(&session, [1.0, 1.2, 0.1]));
    session.key(KeyCode::KeyV, true, false);
    assert_eq!(session.selected, Some(Selected::Gizmo(Gizmo::Vpl(4))));
    let list = sent(&mut session)["vpl"].clone();
    assert_near(numbers(&list[4]["position_m"]), [1.0, 1.2, 0.1]);
    assert_near(numbers(&list[4]["normal"]), [-1.0, 0.0, 0.0]);
    assert_near(numbers(&list[4]["albedo"]), [0.14, 0.45, 0.09]);
    assert!(list[4].get("weight").is_none() && list[4].get("object").is_none());
    session.key(KeyCode::KeyB, true, false);
    session.placing = Some(Kind::Proxy);
    session.press(Button::Left);
    session.release(Button::Left);
    let values = sent(&mut session);
    assert!(
        values["blocker"].as_array().unwrap().len() == 2 && values["proxy"].as_array().unwrap().len() == 2
    );
    let radius = values["blocker"][1]["radius_m"].as_f64().unwrap();
    assert!((0.05..0.5).contains(&radius), "{radius}");
    assert_eq!(session.placing, None);

    // Removed from the middle, those behind move up.
    session.selected = Some(Selected::Gizmo(Gizmo::Vpl(1)));
    session.key(KeyCode::Delete, true, false);
    assert_eq!(session.selected, None);
    let values = sent(&mut session);
    let list = values["vpl"].as_array().unwrap();
    assert_eq!(list.len(), 4);
    assert_eq!((&list[1]["object"], list[0]["weight"].as_f64()), (&Value::from("sphere"), Some(2.0)));
    assert_eq!(session.gizmos.set().vpls.len(), 4);
    session.key(KeyCode::Delete, true, false);
    assert_eq!(session.gizmos.set().vpls.len(), 4, "nothing is selected");
    // Beside the room there is nothing to put it on.
    session.point([-2000.0, 300.0]);
    session.key(KeyCode::KeyV, true, false);
    assert_eq!(session.gizmos.set().vpls.len(), 4);
    assert!(session.notices.now(Instant::now()).0.iter().any(|notice| notice.is_error));
}

#[test]
fn another_text_or_another_run_drops_the_edits_and_more_room_for_lights_does_not() {
    let mut session = session();
    let original = session.gizmos.tables().clone();
    let edit = |session: &mut Session| {
        session.selected = Some(Selected::Gizmo(Gizmo::Vpl(3)));
        session.key(KeyCode::Delete, true, false);
        session.selected = Some(Selected::Gizmo(Gizmo::Vpl(2)));
        assert_eq!(session.gizmos.tables().vpl.len(), 3);
    };
    let follow = |session: &mut Session, epoch: u64, frame: u64| {
        let mut published = session.published.clone().unwrap();
        let newer = VslFrame { epoch, frame, ..(*published.frame).clone() };
        published.frame = Arc::new(newer);
        accept(session, published);
    };
    edit(&mut session);
    follow(&mut session, 1, 8);
    follow(&mut session, 2, 9);
    assert_eq!(session.gizmos.tables().vpl.len(), 3, "another segment of the same run");
    follow(&mut session, 3, 1);
    assert_eq!(*session.gizmos.tables(), original, "another run");
    edit(&mut session);
    let other = scene("");
    accept(&mut session, published(&other.clone(), other));
    assert!(session.gizmos.tables().vpl.is_empty());
    assert_eq!(session.selected, None);
    session.send_gizmos();
    assert!(session.outbox.is_empty(), "edits of another scene are not sent");
}

#[test]
fn what_is_refused_is_told_and_taken_back() {
    let mut session = session();
    let now = Instant::now();
    session.selected = Some(Selected::Gizmo(Gizmo::Vpl(0)));
    session.key(KeyCode::Delete, true, false);
    let good = Request::SetVpls { values: sent(&mut session) };
    let accepted = session.gizmos.tables().clone();
    session.hear(&Told::Done { request: good, frame: 3 }, now);
    session.selected = Some(Selected::Gizmo(Gizmo::Blocker(0)));
    session.key(KeyCode::Delete, true, false);
    let bad = Request::SetVpls { values: sent(&mut session) };
    session.hear(&Told::Failed { request: bad, reason: "no room".into() }, now);
    assert_eq!(*session.gizmos.tables(), accepted);
    assert_eq!(session.gizmos.set().blockers.len(), 1);
    assert!(session.notices.now(now).0.iter().any(|n| n.is_error && n.text.contains("no room")));
    // What the scene itself cannot have is not sent at all.
    session.change_gizmos(now, |tables| tables.vpl[0].albedo.0 = [1.5; 3]);
    assert_eq!(*session.gizmos.tables(), accepted);
    session.send_gizmos();
    assert!(session.outbox.is_empty());
    // Saving sends first what is not sent yet.
    session.change_gizmos(now, |tables| tables.vpl[0].albedo.0 = [0.5; 3]);
    session.pointer.control = true;
    session.key(KeyCode::KeyS, true, false);
    assert!(matches!(session.outbox[..], [Request::SetVpls { .. }, Request::SaveVpls {}]));
    session.hear(&Told::Done { request: Request::SaveVpls {}, frame: 4 }, now);
    assert!(session.notices.now(now).0.iter().any(|n| !n.is_error && n.text.contains("saved")));
}

/// Records at the VPLs, and so many others.
fn records(session: &Session, statics: usize, others: usize) -> Vec<VslRecord> {
    let places = Places::of(session.published.as_ref().unwrap());
    let vpls = session.gizmos.set().vpls.iter().take(statics);
    let of_vpl = |vpl| places.vpl(vpl).0.as_vec3().to_array();
    let at = vpls.map(of_vpl).chain(std::iter::repeat_n([0.1; 3], others));
    at.map(|position| VslRecord { position, ..VslRecord::default() }).collect()
}

#[test]
fn records_are_told_apart_by_method_count_and_place() {
    let lamp = LightId(0);
    let more = "\n[vpls]\nsecond_bounce_distance_m = 0.5\n";
    let roles_of = |more: &str, statics: usize, others: usize| {
        let mut session = session_of(scene(more));
        let mut published = session.published.take().unwrap();
        let vsls = {
            session.published = Some(published.clone());
            records(&session, statics, others)
        };
        published.frame = Arc::new(VslFrame { vsls, ..(*published.frame).clone() });
        Roles::of(&published, session.gizmos.set())
    };
    let with = |method: &str, more: &str| format!("\n[streaming]\nmethod = \"{method}\"\n{more}{TABLES}");
    // The only light is a spot.
    let found = roles_of(&with("static-vpl", more), 4, 1);
    assert_eq!(found, Roles { statics: 4, marks: vec![(4, Mark::SecondBounce(lamp))] });
    let found = roles_of(&with("phantom-vpl", more), 0, 2);
    assert_eq!(found.marks, [(0, Mark::Phantom(lamp)), (1, Mark::SecondBounce(lamp))]);
    let found = roles_of(&with("instant-radiosity", more), 0, 3);
    assert_eq!(found.marks, [(0, Mark::Photon), (1, Mark::Photon), (2, Mark::SecondBounce(lamp))]);
    // The method was switched while it ran.
    assert_eq!(roles_of(&with("phantom-vpl", ""), 4, 0), Roles { statics: 4, marks: vec![] });
    assert_eq!(roles_of(&with("static-vpl", ""), 0, 1).marks, [(0, Mark::Phantom(lamp))]);
    // As many lights elsewhere are those of photon streaming.
    assert_eq!(roles_of(&with("photon-streaming", ""), 0, 4), Roles::default());
    // One VPL was just removed: the records of the others keep their meaning until the next frame.
    let found = roles_of(&with("static-vpl", ""), 3, 0);
    assert_eq!(found, Roles { statics: 3, marks: vec![] });
}

#[test]
fn bodies_have_their_edges_and_rims_touch_what_they_surround() {
    let map = DAffine3::from_translation(DVec3::X);
    let half = DVec3::new(1.0, 2.0, 3.0);
    let cuboid = outline::body(&map, &ProxyShape::Cuboid { centre: DVec3::ZERO, half });
    assert_eq!(cuboid.len(), 12);
    let length = |lines: &[[Vec3; 2]]| lines.iter().map(|[a, b]| a.distance(*b)).sum::<f32>();
    assert!((length(&cuboid) - 4.0 * (2.0 + 4.0 + 6.0)).abs() < 1e-4);
    // The hull of its corners has the same edges: no diagonals.
    let corners: Vec<_> = (0..8)
        .map(|i| half * DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - half)
        .collect();
    let planes =
        [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|n| [(n, n.dot(half)), (-n, n.dot(half))]);
    let hull = outline::body(&map, &ProxyShape::Hull { points: corners, planes: planes.collect() });
    assert_eq!((hull.len(), length(&hull)), (12, length(&cuboid)));
    // A sphere of radius 3 seen from 5 m away is touched 4 m away.
    let rim = outline::rim(Vec3::ZERO, Vec3::Z * 5.0, 3.0);
    assert!(rim.iter().flatten().all(|p| (p.length() - 4.0).abs() < 1e-4));
    assert!(rim.iter().flatten().all(|p| (p.distance(Vec3::Z * 5.0) - 3.0).abs() < 1e-4));
    assert!(outline::rim(Vec3::ZERO, Vec3::Z, 3.0).is_empty(), "from within there is none");
}

#[test]
fn lines_end_before_the_camera() {
    let session = session();
    let sight = session.sight().unwrap();
    let camera = sight.eye.camera;
    let ahead = camera.position + camera.forward * 2.0;
    let through = [ahead, camera.position - camera.forward + camera.right];
    let seen = outline::segments(&sight.eye, &[through], sight.near());
    assert_eq!(seen.len(), 1);
    assert!((seen[0][0][0] - 300.0).abs() < 1e-2 && seen[0][1][0] > 600.0, "{seen:?}");
    let behind = [camera.position - camera.forward, camera.position - camera.forward * 2.0];
    assert!(outline::segments(&sight.eye, &[behind], sight.near()).is_empty());
    let beside = [ahead + camera.right * 50.0, ahead + camera.right * 60.0];
    assert!(outline::segments(&sight.eye, &[beside], sight.near()).is_empty());
}
