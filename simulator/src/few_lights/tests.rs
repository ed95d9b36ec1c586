//! Checks the few lights of a scene against hand-computed ones, and how they follow what moves.
#![allow(clippy::unwrap_used)]

mod weights;

use super::*;
use core::f32::consts::PI;
use photonstream_scene::SceneConfig;
use std::path::Path;

/// A floor of 8 m × 8 m and a lamp 2 m above its middle, which can be moved on a rail.
const SCENE: &str = r#"
    origin_m = [0, 0, 0]
    camera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }
    material.m.albedo = 0.5
    object.floor = { material = "m", quad = { corner_m = [-4, 0, 4], edge_u_m = [8, 0, 0], edge_v_m = [0, 0, -8] } }
    object.crate = { material = "m", position_m = [3, 0.5, 0], box = { size_m = [1, 1, 1] } }
"#;

const POINT: &str = "light.l = { power_w = 100, point = { position_m = [0, 2, 0] } }\n";
const SPOT: &str = "light.l = { power_w = 100, spot = { position_m = [0, 2, 0], direction = [0, -1, 0], outer_half_angle_deg = 20 } }\n";

fn scene(text: &str) -> Scene {
    let config = SceneConfig::from_text(&format!("{SCENE}\n{text}"), Path::new("scene.toml")).unwrap();
    config.build().unwrap()
}

fn static_scene(lights: &str, tables: &str) -> Scene {
    scene(&format!("{lights}\nstreaming.method = \"static-vpl\"\n{tables}"))
}

fn updated(scene: &Scene) -> Vec<Shown> {
    let mut few = FewLights::new(scene, scene.streaming.method);
    few.update(scene, 0.0);
    assert_eq!(few.lights().len(), count(scene, scene.streaming.method));
    few.lights().to_vec()
}

fn flux_of(scene: &Scene) -> Vec<f32> {
    updated(scene).iter().map(|shown| shown.light.flux.x).collect()
}

const VPL: &str = "[[vpl]]\nposition_m = [0, 0, 0]\nnormal = [0, 3, 0]\nalbedo = 0.5\nweight = 2\n";

/// By hand, Φ = ρ A P / (4π d²): 0.5 · 2 · 100 / (4π · 4) W below a lamp of 100 W at 2 m. Tolerance: eight roundings.
#[test]
fn a_vpl_reflects_what_arrives() {
    let flux = flux_of(&static_scene(POINT, VPL));
    assert_eq!(flux.len(), 1);
    assert!((flux[0] - 100.0 / (16.0 * PI)).abs() < 1e-5, "{flux:?}");
    // 0 W leave nothing, and no NaN.
    let dark = POINT.replace("100", "0");
    assert_eq!(flux_of(&static_scene(&dark, VPL)), [0.0]);
}

/// A rectangle is 16 pieces: below the middle of one of 0.2 m it is nearly a point with a cosine, E = P / (π d²).
/// Tolerance: 1 %, (0.1 m / 2 m)² twice.
#[test]
fn area_lights_are_sampled() {
    let lamp = "light.l = { power_w = 100, rectangle = { corner_m = [-0.1, 2, -0.1], edge_u_m = [0.2, 0, 0], edge_v_m = [0, 0, 0.2] } }\n";
    let flux = flux_of(&static_scene(lamp, VPL));
    let expected = 0.5 * 2.0 * 100.0 / (PI * 4.0);
    assert!((flux[0] / expected - 1.0).abs() < 0.01, "{flux:?}, {expected}");
}

/// The crate stands between a low lamp and one of two VPLs: rays see it, blockers and nothing do not.
#[test]
fn rays_are_blocked_by_the_scene() {
    let lamp = "light.l = { power_w = 100, point = { position_m = [1, 0.5, 0] } }\n";
    let vpls = "[[vpl]]\nposition_m = [3.9, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n\
                [[vpl]]\nposition_m = [0, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n";
    let with = |visibility: &str| {
        flux_of(&static_scene(lamp, &format!("vpls.visibility = \"{visibility}\"\n{vpls}")))
    };
    assert!(with("none").iter().all(|&flux| flux > 0.0) && with("blockers") == with("none"));
    let rays = with("rays");
    assert_eq!(rays[0], 0.0);
    assert!((rays[1] / with("none")[1] - 1.0).abs() < 1e-3, "{rays:?}");
}

/// A blocker of 0.5 m half a radius beside the way lets a quarter pass; attached to the crate, it goes with it.
#[test]
fn blockers_and_vpls_move_with_their_objects() {
    let tables = format!(
        "{VPL}[[vpl]]\nposition_m = [3, 1, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\nweight = 1\nobject = \"crate\"\n\
         [[blocker]]\nposition_m = [0.25, 1, 0]\nradius_m = 0.5\nobject = \"crate\"\n"
    );
    let scene = static_scene(POINT, &tables);
    let mut few = FewLights::new(&scene, Method::StaticVpl);
    few.update(&scene, 0.0);
    let free = 100.0 / (16.0 * PI);
    assert!((few.lights()[0].light.flux.x / (0.25 * free) - 1.0).abs() < 1e-4, "{:?}", few.lights());
    assert_eq!((few.lights()[0].object, few.lights()[1].object), (None, scene.object("crate")));
    let mut edit = scene.edit();
    let to = serde_json::json!({ "position_m": [3.25, 0.5, 1.0], "rotation_deg": [0, 0, 90] });
    edit.move_object("crate", to.as_object().unwrap()).unwrap();
    let moved = edit.finish();
    few.update(&moved, 0.01);
    let [still, on_crate] = [few.lights()[0].light, few.lights()[1].light];
    assert!((still.flux.x / free - 1.0).abs() < 1e-4, "the blocker has gone with the crate: {still:?}");
    // Turned by 90° about z, its upper face looks to -x, half a metre from its middle.
    assert!(on_crate.position.abs_diff_eq(Vec3::new(2.75, 0.5, 1.0), 1e-5), "{on_crate:?}");
    assert!(on_crate.normal.abs_diff_eq(Vec3::NEG_X, 1e-6), "{on_crate:?}");
}

/// What is attached is held at a moment where its object is.
#[test]
fn attached_things_are_where_an_animation_is_held() {
    let text = format!(
        "{SCENE}\n{POINT}\nstreaming.method = \"static-vpl\"\n[[vpl]]\nposition_m = [3, 1, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\nobject = \"crate\"\n\
         [[animation]]\nobject = \"crate\"\nproperty = \"position_m\"\ntimes_s = [0, 2]\nvalues = [[3, 0.5, 0], [1, 0.5, 0]]\n"
    );
    let config = SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap();
    for (time_s, x) in [(0.0, 3.0), (1.0, 2.0)] {
        let held = config.at(time_s).unwrap().build().unwrap();
        let position = updated(&held)[0].light.position;
        assert!(position.abs_diff_eq(Vec3::new(x, 1.0, 0.0), 1e-5), "{time_s}: {position}");
    }
}

/// A phantom lies where the axis meets the floor, or a proxy, at once; it follows to another place, comes to rest there
/// exactly, and is off where the axis meets nothing.
#[test]
fn a_phantom_follows_the_axis() {
    let phantom = |tables: &str| scene(&format!("{SPOT}\nstreaming.method = \"phantom-vpl\"\n{VPL}{tables}"));
    let on_floor = phantom("");
    let mut few = FewLights::new(&on_floor, Method::PhantomVpl);
    few.update(&on_floor, 0.0);
    assert_eq!(few.lights().len(), 1, "static VPLs are not shown");
    assert!(few.lights()[0].light.position.abs_diff_eq(Vec3::ZERO, 1e-6) && !few.is_following());
    let aimed = |direction: [f32; 3]| {
        let mut edit = on_floor.edit();
        edit.set_light("l", serde_json::json!({ "direction": direction }).as_object().unwrap()).unwrap();
        edit.finish()
    };
    let slanted = aimed([1.0, -1.0, 0.0]);
    few.update(&slanted, 0.024);
    // After one time constant 1 - 1/e of the way from 0 to 2.
    let x = few.lights()[0].light.position.x;
    assert!((x - 2.0 * (1.0 - (-1.0f32).exp())).abs() < 1e-4 && few.is_following(), "{x}");
    let mut updates = 0;
    while few.is_following() {
        few.update(&slanted, 0.024);
        updates += 1;
        assert!(updates < 20);
    }
    assert!(few.lights()[0].light.position.abs_diff_eq(Vec3::X * 2.0, 1e-5), "{:?}", few.lights());
    few.update(&aimed([0.0, 1.0, 0.0]), 0.01);
    assert_eq!(few.shining(), 0);
    let on_proxy = phantom("[[proxy]]\nposition_m = [0, 0.5, 0]\nsphere = { radius_m = 0.25 }\n");
    assert!(updated(&on_proxy)[0].light.position.abs_diff_eq(Vec3::Y * 0.75, 1e-6));
}

/// The frame rate does not matter: 1, 3 and 30 updates of the same 40 ms end in the same place. Tolerance: roundings.
#[test]
fn phantoms_do_not_know_the_frame_rate() {
    let text = format!("{SPOT}\nstreaming.method = \"phantom-vpl\"\n{VPL}");
    let before = scene(&text);
    let after = scene(&text.replace("direction = [0, -1, 0]", "direction = [1, -1, 0]"));
    let places: Vec<f32> = [1, 3, 30]
        .map(|updates| {
            let mut few = FewLights::new(&before, Method::PhantomVpl);
            few.update(&before, 0.0);
            (0..updates).for_each(|_| few.update(&after, 0.04 / f64::from(updates)));
            few.lights()[0].light.position.x
        })
        .to_vec();
    assert!(places.iter().all(|x| (x - places[0]).abs() < 1e-5), "{places:?}");
}

/// Other lights than spots light the static VPLs; each light has its second bounce, which goes off with it.
#[test]
fn phantoms_statics_and_second_bounces_go_together() {
    let lights = format!("{SPOT}light.m = {{ power_w = 50, point = {{ position_m = [2, 2, 0] }} }}\n");
    let text =
        format!("{lights}\nstreaming.method = \"phantom-vpl\"\nvpls.second_bounce_distance_m = 2\n{VPL}");
    let shown = updated(&scene(&text));
    assert_eq!(shown.len(), 1 + 1 + 2);
    assert!(shown.iter().all(|shown| shown.light.flux.x > 0.0), "{shown:?}");
    // Of the static VPL, then of the phantom: d_sec against the light, with ρ/d² = 0.1 of its flux.
    assert!((shown[2].light.flux.x / shown[0].light.flux.x - 0.1).abs() < 1e-5);
    assert!((shown[3].light.flux.x / shown[1].light.flux.x - 0.1).abs() < 1e-5);
    assert!(shown[3].light.position.abs_diff_eq(Vec3::Y * 2.0, 1e-5), "{:?}", shown[3]);
    let off = updated(&scene(&text.replace("power_w = 100", "power_w = 0")));
    assert_eq!(
        off.iter().map(|shown| shown.light.flux.x > 0.0).collect::<Vec<_>>(),
        [true, false, true, false]
    );
}

/// All of a lamp's light that meets the floor leaves it again: photons carry ρ P, but for those that miss. N = 64 of 4π sr,
/// of which the lower half meets 8 m × 8 m seen from 2 m: all but a small solid angle beyond 4 m.
#[test]
fn photons_carry_the_power() {
    let text = format!("{SPOT}\nstreaming.method = \"instant-radiosity\"\nvpls.photons = 50\n");
    let shown = updated(&scene(&text));
    assert_eq!(shown.len(), 50);
    let sum: f32 = shown.iter().map(|shown| shown.light.flux.x).sum();
    // The profile is sampled by weights: the sum is that of 50 low-discrepancy points, within 3 %.
    assert!((sum / 50.0 - 1.0).abs() < 0.03, "{sum}");
    assert!(shown.iter().all(|shown| shown.light.area > 0.0 && shown.light.position.y.abs() < 1e-5));
    assert_eq!(shown, updated(&scene(&text)), "directions are fixed");
}

/// Maps are traced of what shines, again only after a move, and say what is open and what is near.
#[test]
fn distance_maps_follow_the_lights() {
    let scene = static_scene(POINT, &format!("streaming.distance_map_px = 8\n{VPL}"));
    let mut few = FewLights::new(&scene, Method::StaticVpl);
    few.update(&scene, 0.0);
    let first = few.take_changed_maps().unwrap();
    assert_eq!((first.edge, first.lights, first.changed.len()), (8, 1, 1));
    few.update(&scene, 0.01);
    assert!(few.take_changed_maps().unwrap().changed.is_empty());
    let mut edit = scene.edit();
    let to = serde_json::json!({ "position_m": [0.8, 0.5, 0] });
    edit.move_object("crate", to.as_object().unwrap()).unwrap();
    few.update(&edit.finish(), 0.01);
    assert_eq!(few.take_changed_maps().unwrap().changed.len(), 1);
    assert_eq!(few.distance_maps().len(), 32);
}

/// The octagon of a light: eight corners in its plane, counter-clockwise, with its area by the shoelace formula. Tolerance:
/// roundings. What does not shine, or has no area, has none.
#[test]
fn polygons_have_the_area_of_their_light() {
    let light =
        VirtualLight { position: Vec3::ONE, normal: Vec3::new(0.6, 0.0, -0.8), flux: Vec3::ONE, area: 2.5 };
    let record = octagon(&light);
    let corners: Vec<Vec3> = record.corners.chunks_exact(3).map(Vec3::from_slice).collect();
    let doubled: Vec3 = (0..8).map(|i| corners[i].cross(corners[(i + 1) % 8])).sum();
    assert!(doubled.abs_diff_eq(light.normal * 5.0, 1e-5), "{doubled}");
    assert!(corners.iter().all(|corner| corner.dot(light.normal).abs() < 1e-6));
    assert_eq!((record.count, record.area), (8, 2.5));
    for none in [VirtualLight { flux: Vec3::ZERO, ..light }, VirtualLight { area: 0.0, ..light }] {
        assert_eq!(octagon(&none), PatchRecord::default());
    }
}

/// Two lamps in one place have directions of their own, and no photon's light is without an area.
#[test]
fn photons_of_lamps_in_one_place_differ() {
    let lamp =
        |name: &str| format!("light.{name} = {{ power_w = 50, point = {{ position_m = [0, 2, 0] }} }}\n");
    let text =
        format!("{}{}streaming.method = \"instant-radiosity\"\nvpls.photons = 40\n", lamp("a"), lamp("b"));
    let shining: Vec<Shown> =
        updated(&scene(&text)).into_iter().filter(|shown| shown.light.flux != Vec3::ZERO).collect();
    assert!(shining.len() > 8, "{}", shining.len());
    for (index, shown) in shining.iter().enumerate() {
        assert!(shown.light.area > 0.0);
        assert!(shining[..index].iter().all(|other| other.light.position != shown.light.position));
    }
}

/// Photons that coincide all the same have their share of the surfaces: no light is a point.
#[test]
fn coinciding_photons_have_an_area() {
    let floor = scene(POINT);
    let light = VirtualLight { position: Vec3::ZERO, normal: Vec3::Y, flux: Vec3::ONE, area: 0.0 };
    let mut shown = [Shown { light, object: None }; 2];
    photons::give_areas(&floor, &mut shown);
    let share = (floor.reflecting_area_m2() / 2.0) as f32;
    assert!(shown.iter().all(|shown| shown.light.area == share), "{shown:?}, {share}");
}

/// A ball of 80 triangles that emits everywhere has the second bounce of a point in its middle: the mean of 16 of its points
/// is less than half its radius of 0.3 m beside it, 2 m away from the VPL.
#[test]
fn the_second_bounce_of_a_closed_lamp_is_that_of_a_point() {
    let folder = tempfile::tempdir().unwrap();
    let corner = |i: u32, j: u32| {
        let (turn, rise) =
            (f64::from(j) * 0.25 * std::f64::consts::PI, f64::from(i) / 6.0 * std::f64::consts::PI);
        let (x, y, z) = (rise.sin() * turn.cos(), rise.cos(), rise.sin() * turn.sin());
        format!("v {} {} {}\n", 0.3 * x, 0.3 * y, 0.3 * z)
    };
    let mut obj = "mtllib ball.mtl\nusemtl lamp\n".to_owned();
    (0..=6).flat_map(|i| (0..8).map(move |j| (i, j))).for_each(|(i, j)| obj += &corner(i, j));
    for (i, j) in (0..6).flat_map(|i| (0..8).map(move |j| (i, j))) {
        let [a, b, c, d] = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| i * 8 + j % 8 + 1);
        // At the poles one of both triangles is a line.
        obj += &if i < 5 { format!("f {b} {c} {d}\n") } else { String::new() };
        obj += &if i > 0 { format!("f {a} {b} {d}\n") } else { String::new() };
    }
    std::fs::write(folder.path().join("ball.obj"), obj).unwrap();
    std::fs::write(folder.path().join("ball.mtl"), "newmtl lamp\nKd 0 0 0\nKe 9 9 9\n").unwrap();
    let of = |light: &str| {
        let tables = format!("streaming.method = \"static-vpl\"\nvpls.second_bounce_distance_m = 1\n{VPL}");
        let text = format!("{SCENE}\n{light}\n{tables}");
        let config = SceneConfig::from_text(&text, &folder.path().join("scene.toml")).unwrap();
        let scene = config.build().unwrap();
        assert_eq!(scene.lights.len(), 1);
        updated(&scene)[1].light
    };
    let (closed, point) =
        (of("object.ball = { position_m = [0, 2, 0], obj = { path = \"ball.obj\" } }"), of(POINT));
    assert!(closed.flux.x > 0.0 && closed.position.distance(point.position) < 0.15, "{closed:?}, {point:?}");
    assert_eq!(closed.normal, point.normal);
}

/// A sky takes no place among the lights of VPLs.
#[test]
fn a_sky_has_no_dark_lights() {
    let sky = "light.s = { sky = { radiance_w_m2_sr = 1 } }\n";
    let tables = format!("vpls.second_bounce_distance_m = 1\n{VPL}");
    for (lights, method, expected) in [
        (sky.to_owned(), "static-vpl", 0),
        (sky.to_owned(), "phantom-vpl", 0),
        (format!("{sky}{SPOT}"), "phantom-vpl", 2),
        (format!("{sky}{SPOT}"), "static-vpl", 2),
        (format!("{sky}{POINT}"), "phantom-vpl", 2),
    ] {
        let scene = scene(&format!("{lights}\nstreaming.method = \"{method}\"\n{tables}"));
        assert_eq!(updated(&scene).len(), expected, "{lights}, {method}");
    }
}
