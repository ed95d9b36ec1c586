#![allow(clippy::unwrap_used)]

use super::{
    cluster::{COS_TOGETHER, clusters},
    trace::{Kind, Kinds, Reflection},
    *,
};
use crate::{AssetRoots, SceneConfig, scene::ObjectId};
use glam::{DVec3, Vec3};
use std::path::Path;

fn config(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name)).unwrap()
}

fn of_text(text: &str) -> Scene {
    SceneConfig::from_text(text, Path::new("x.toml")).unwrap().build_with(&AssetRoots::default()).unwrap()
}

fn settings() -> VplPlacementSettings {
    VplPlacementSettings { population: 2048, ..VplPlacementSettings::default() }
}

fn place(scene: &Scene, settings: &VplPlacementSettings) -> VplPlacement {
    place_vpls(scene, settings, &[]).unwrap()
}

/// A closed room of 2 m edges that looks inwards, the eye in its middle.
const ROOM: &str = "
[camera]
position_m = [0, 0, 0]
target_m = [0, 0, -1]
vertical_fov_deg = 60
[material.white]
albedo = 0.5
[object.room]
material = \"white\"
sides = \"back\"
box = { size_m = [2, 2, 2] }
[light.lamp]
power_w = 1
point = { position_m = [0, 0.5, 0] }
";

#[test]
fn one_thread_and_two_give_the_same() {
    let scene = config("cornell-ball.toml");
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| place(&scene, &settings()))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_ne!(one, place(&scene, &VplPlacementSettings { seed: 2, ..settings() }));
}

#[test]
fn alike_vpls_keep_their_distance() {
    let scene = config("cornell-box.toml");
    let settings = VplPlacementSettings { spacing_m: Some(0.3), most: 1000, ..settings() };
    let VplPlacement { vpls, spacing_m, left_out, .. } = place(&scene, &settings);
    assert_eq!((spacing_m, left_out), (0.3, 0));
    // Five walls of 4 m², at one VPL for at most (2 · 0.3)² m² or so.
    assert!(vpls.len() > 5 * 11, "{}", vpls.len());
    let kinds = Kinds::of(&scene);
    for (i, a) in vpls.iter().enumerate() {
        for b in &vpls[..i] {
            let is_alike = kinds.get(a.object).is_alike(&kinds.get(b.object));
            let are_near = a.position.distance(b.position) < 0.3 * (1.0 - 1e-4);
            assert!(!is_alike || !are_near || a.normal.dot(b.normal) < COS_TOGETHER, "{a:?}\n{b:?}");
        }
    }
}

/// Without a spacing, the finest that needs no more VPLs than asked for: the next finer one would.
#[test]
fn the_spacing_fits_the_number() {
    let scene = config("cornell-box.toml");
    for most in [20, 100] {
        let chosen = place(&scene, &VplPlacementSettings { most, ..settings() });
        assert_eq!(chosen.left_out, 0);
        assert!(chosen.vpls.len() <= most as usize && chosen.vpls.len() > most as usize / 2);
        let finer = f64::from(chosen.spacing_m) / 1.5;
        let finer = place(&scene, &VplPlacementSettings { most, spacing_m: Some(finer), ..settings() });
        assert!(finer.vpls.len() + finer.left_out as usize > most as usize);
        assert!(finer.vpls.len() <= most as usize);
    }
}

#[test]
fn clusters_are_means_of_their_reflections() {
    let kind = Kind { moving: None, reflectance: Vec3::splat(0.5) };
    let at = |x: f32, normal: Vec3, albedo: f32| Reflection {
        position: Vec3::new(x, 0.0, 0.0),
        normal,
        albedo: Vec3::splat(albedo),
        object: ObjectId(0),
        kind,
    };
    // Three at 0 to 0.2 m, two at 2 m, one of them at 40° to the other.
    let tilted = Vec3::new(0.0, 40f32.to_radians().cos(), 40f32.to_radians().sin());
    let all = [
        at(0.0, Vec3::Y, 0.2),
        at(2.0, Vec3::Y, 0.9),
        at(0.1, Vec3::Y, 0.4),
        at(2.0, tilted, 0.7),
        at(0.2, Vec3::Y, 0.6),
    ];
    let (found, of) = clusters(&all, 1.0);
    assert_eq!(of, [0, 1, 0, 1, 0]);
    assert_eq!([found[0].population, found[1].population], [3, 2]);
    // One rounding to f32 in each sum and quotient.
    let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-6;
    assert!(near(found[0].position(), Vec3::new(0.1, 0.0, 0.0)));
    assert!(near(found[0].albedo(), Vec3::splat(0.4)));
    assert!(near(found[1].position(), Vec3::new(2.0, 0.0, 0.0)));
    assert!(near(found[1].albedo(), Vec3::splat(0.8)));
    let half = Vec3::new(0.0, 20f32.to_radians().cos(), 20f32.to_radians().sin());
    assert!(near(found[1].normal(), half));
    // Another direction, another paint and a moving object are kept apart.
    let up = at(0.0, Vec3::Y, 0.5);
    let side = Reflection { normal: Vec3::X, ..up };
    let paint = Reflection { kind: Kind { reflectance: Vec3::new(0.5, 0.3, 0.5), ..kind }, ..up };
    let moving = Reflection { kind: Kind { moving: Some(ObjectId(3)), ..kind }, ..up };
    assert_eq!(clusters(&[up, side, paint, moving, up], 1.0).1, [0, 1, 2, 3, 0]);
}

/// Two clusters whose means come together are put together, and every reflection knows.
#[test]
fn clusters_that_meet_are_merged() {
    let kind = Kind { moving: None, reflectance: Vec3::splat(0.5) };
    let at = |x: f32| Reflection {
        position: Vec3::new(x, 0.0, 0.0),
        normal: Vec3::Y,
        albedo: Vec3::splat(0.5),
        object: ObjectId(0),
        kind,
    };
    // 0 and 1.1 stand apart, 0.9 draws the second to 1.0, and so on down to 0.95: then they meet.
    let all = [at(0.0), at(1.1), at(0.9), at(0.95), at(0.6), at(0.45)];
    let (found, of) = clusters(&all, 1.0);
    assert_eq!(found.len(), 1);
    assert_eq!(of, [0; 6]);
    assert!((found[0].position().x - 4.0 / 6.0).abs() < 1e-6);
}

#[test]
fn nothing_is_placed_in_a_sealed_room() {
    let scene = config("two-rooms.toml");
    for weights in [PlacedWeights::Surface, PlacedWeights::Automatic] {
        let found = place(&scene, &VplPlacementSettings { weights, ..settings() });
        assert!(found.vpls.len() > 50);
        for vpl in &found.vpls {
            let name = &scene.objects[vpl.object.0 as usize].name;
            assert!(name.starts_with("left-") || name == "divider", "{name}");
            assert!(name != "divider" || vpl.normal.x < 0.0);
            assert!(vpl.position.x + (scene.origin_m.x as f32) < 1e-3);
        }
        // Half of the floor's area is not reached, nor shared out: 2 m × 2 m × 2 m of each room, without the dark one.
        if weights == PlacedWeights::Surface {
            let area: f32 = found.vpls.iter().map(|vpl| vpl.area_m2.unwrap()).sum();
            assert!((area - 24.0).abs() < 24.0 * 0.03, "{area}");
        }
    }
    let there = VplPlacementSettings { starts: vec![DVec3::new(1.8, 1.2, 0.9)], ..settings() };
    let found = place(&scene, &there);
    let is_right = |vpl: &PlacedVpl| scene.objects[vpl.object.0 as usize].name.starts_with("right-");
    assert!(found.vpls.iter().any(is_right));
}

/// In a closed convex room everything is reached: the areas sum up to that of its walls, 24 m². Points on the surface are
/// stratified by area; those between corners that no light within 45° is near to are lost: 1 %.
#[test]
fn areas_sum_up_to_the_surface() {
    let found = place(&of_text(ROOM), &settings());
    let area: f32 = found.vpls.iter().map(|vpl| vpl.area_m2.unwrap()).sum();
    assert!((area - 24.0).abs() < 0.24, "{area}");
    // 200 at most, of about equal area each.
    let mean = area / found.vpls.len() as f32;
    assert!(found.vpls.iter().all(|vpl| vpl.area_m2.unwrap() < 4.0 * mean));
    let automatic = VplPlacementSettings { weights: PlacedWeights::Automatic, ..settings() };
    assert!(place(&of_text(ROOM), &automatic).vpls.iter().all(|vpl| vpl.area_m2.is_none()));
}

/// However dense VPLs are wanted, they stand for the whole surface: without a spacing they are no denser than the
/// reflections bear, with one their gaps are bridged. Besides the 1 % above, what lies in corners has fewer reflections than
/// the mean, and with 6144 of them on 24 m² is up to three spacings away: 2 %.
#[test]
fn dense_vpls_have_all_the_surface() {
    let scene = of_text(ROOM);
    let sum = |found: &VplPlacement| found.vpls.iter().map(|vpl| vpl.area_m2.unwrap()).sum::<f32>();
    for (most, spacing_m) in [(600, None), (65_536, None), (65_536, Some(0.05)), (65_536, Some(1e-6))] {
        let found = place(&scene, &VplPlacementSettings { most, spacing_m, ..settings() });
        let area = sum(&found);
        assert!((area - 24.0).abs() < 0.48, "{most} {spacing_m:?}: {area}, {}", found.vpls.len());
        assert_eq!(found.wants_population, most == 65_536 && spacing_m.is_none());
        if spacing_m.is_none() {
            assert!(found.vpls.len() <= 6144 / 8 && found.without_surface == 0);
        }
    }
    // Every place that was found stands for its part: 16 points each leave one in some hundred without.
    let settings = VplPlacementSettings { most: 65_536, spacing_m: Some(1e-6), ..settings() };
    let all = place(&scene, &settings);
    assert!(
        all.vpls.len() + all.without_surface as usize == 6144 && all.vpls.len() > 5500,
        "{}",
        all.vpls.len()
    );
}

/// A wall with a gap, behind which nothing is seen from the eye but what lies straight through it: paths come round the corner
/// because they go on from where they were reflected. They would not if each started again from its origin, as in the authors'
/// script, nor with one reflection.
#[test]
fn paths_go_on_from_what_they_meet() {
    let text = "
[camera]
position_m = [-1.5, 0, -0.5]
target_m = [0, 0, -0.5]
vertical_fov_deg = 60
[material.white]
albedo = 0.5
[object.room]
material = \"white\"
sides = \"back\"
box = { size_m = [4, 2, 2] }
[object.wall]
material = \"white\"
sides = \"both\"
quad = { corner_m = [0, -1, -1], edge_u_m = [0, 0, 1.5], edge_v_m = [0, 2, 0] }
[light.lamp]
power_w = 1
point = { position_m = [-1.5, 0, -0.5] }
";
    let scene = of_text(text);
    // Through the gap, from z = 0.5 on, the eye sees what lies beyond z = 0.5 + 2/3 x.
    let behind = |depth: u32| {
        let settings =
            VplPlacementSettings { explore: 0, depth, weights: PlacedWeights::Automatic, ..settings() };
        let vpls = place(&scene, &settings).vpls.into_iter();
        let positions = vpls.map(|vpl| vpl.position.as_dvec3() + scene.origin_m);
        positions.filter(|p| p.x > 0.1 && p.z < 0.4).count()
    };
    assert_eq!(behind(1), 0);
    // 4 m² of floor, wall and ceiling of 20 m² or so, at most 200 VPLs.
    assert!(behind(2) > 10 && behind(3) > 10, "{} {}", behind(2), behind(3));
}

/// One reflection bears no spacing of a micrometre: no point of the surface is so near to it.
#[test]
fn vpls_without_surface_are_an_error() {
    let settings = VplPlacementSettings {
        population: 1,
        depth: 1,
        spacing_m: Some(1e-6),
        ..VplPlacementSettings::default()
    };
    let error = place_vpls(&of_text(ROOM), &settings, &[]).unwrap_err();
    assert_eq!(error, VplPlacementError::NoSurface { clusters: 1, spacing_m: 1e-6 });
    assert!(error.to_string().contains("more paths with --population"));
}

#[test]
fn vpls_lie_on_curved_surfaces() {
    let ball = ROOM.replace("box = { size_m = [2, 2, 2] }", "sphere = { radius_m = 1, segments = 64 }");
    let outside = vec![DVec3::new(0.0, 0.0, 3.0), DVec3::new(2.0, -1.0, -1.0)];
    for (text, starts) in [(ball.clone(), Vec::new()), (ball.replace("\"back\"", "\"front\""), outside)] {
        let scene = of_text(&text);
        let settings =
            VplPlacementSettings { spacing_m: Some(0.5), population: 1 << 15, starts, ..settings() };
        let found = place(&scene, &settings);
        assert!(found.vpls.len() > 8, "{}", found.vpls.len());
        for vpl in &found.vpls {
            let height = (vpl.position.as_dvec3() + scene.origin_m).length() - 1.0;
            // The nearest reflection may be 0.1 m off: 5 mm of sagitta, and as much for the sphere's triangles.
            assert!(height.abs() < 0.01, "{height}");
        }
    }
}

#[test]
fn what_moves_takes_its_vpls_along() {
    let scene = config("cornell-ball.toml");
    let found = place(&scene, &settings());
    let on_ball = |vpl: &&PlacedVpl| scene.objects[vpl.object.0 as usize].name == "sphere";
    assert!(found.vpls.iter().filter(on_ball).count() > 3);
    for vpl in &found.vpls {
        assert_eq!(vpl.is_attached, on_ball(&vpl));
    }
}

#[test]
fn only_reflecting_sides_have_vpls() {
    let outwards = of_text(&ROOM.replace("\"back\"", "\"front\""));
    let failed = place_vpls(&outwards, &settings(), &[]);
    assert_eq!(failed, Err(VplPlacementError::NothingFound { paths: 2048 }));
    let black = of_text(&ROOM.replace("albedo = 0.5", "albedo = 0"));
    assert_eq!(place_vpls(&black, &settings(), &[]), Err(VplPlacementError::NothingFound { paths: 2048 }));
}

#[test]
fn sites_that_are_taken_stay_free() {
    let scene = of_text(ROOM);
    let settings = VplPlacementSettings { spacing_m: Some(0.4), ..settings() };
    let alone = place(&scene, &settings);
    let floor = |position: Vec3, takes_surface| VplSite { position, normal: Vec3::Y, takes_surface };
    let corner = Vec3::new(-0.5, -1.0, -0.5) - scene.origin_m.as_vec3();
    for takes_surface in [true, false] {
        let site = floor(corner, takes_surface);
        let found = place_vpls(&scene, &settings, &[site]).unwrap();
        assert!(found.taken > 0 && found.vpls.len() + found.taken as usize == alone.vpls.len());
        let is_near =
            |vpl: &PlacedVpl| vpl.position.distance(corner) < 0.4 && vpl.normal.dot(Vec3::Y) > COS_TOGETHER;
        assert!(alone.vpls.iter().any(is_near) && !found.vpls.iter().any(is_near));
        let sum = |vpls: &[PlacedVpl]| vpls.iter().map(|vpl| vpl.area_m2.unwrap()).sum::<f32>();
        // What is there takes its part of the floor; where one was taken away, its neighbours have it.
        assert_eq!(sum(&found.vpls) < sum(&alone.vpls) - 0.1, takes_surface);
    }
}

/// Means of what lies on a ball, around corners and behind mouldings are on what reflects, where shadow rays find them; where
/// they are all left below it, a third of those in Sponza and a quarter here are not.
#[test]
fn no_vpl_is_buried() {
    for name in ["cornell-box.toml", "cornell-ball.toml", "cornell-knot.toml", "door-room.toml", "ruins.toml"]
    {
        let scene = config(name);
        let found = place(&scene, &settings());
        let depths = found.vpls.iter().filter_map(|vpl| scene.depth_below_surface(vpl.position, vpl.normal));
        assert_eq!(depths.collect::<Vec<_>>(), [0.0; 0], "{name}: of {}", found.vpls.len());
    }
}

#[test]
fn the_bias_draws_back() {
    let scene = of_text(ROOM);
    let drawn = place(&scene, &VplPlacementSettings { normal_bias_m: 0.1, ..settings() });
    for (drawn, plain) in drawn.vpls.iter().zip(place(&scene, &settings()).vpls) {
        let by = (plain.position - drawn.position).dot(plain.normal);
        // Coordinates about 1: a few ulps.
        assert!((by - 0.1).abs() < 1e-6);
    }
}

#[test]
fn settings_outside_their_domain_are_named() {
    let scene = of_text(ROOM);
    let of = |settings: VplPlacementSettings| match place_vpls(&scene, &settings, &[]) {
        Err(VplPlacementError::Setting { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(of(VplPlacementSettings { population: 0, ..settings() }), "population");
    assert_eq!(of(VplPlacementSettings { depth: 0, ..settings() }), "depth");
    assert_eq!(of(VplPlacementSettings { most: 0, ..settings() }), "max");
    assert_eq!(of(VplPlacementSettings { spacing_m: Some(0.0), ..settings() }), "spacing_m");
    assert_eq!(of(VplPlacementSettings { spacing_m: Some(f64::NAN), ..settings() }), "spacing_m");
    assert_eq!(of(VplPlacementSettings { normal_bias_m: f64::NAN, ..settings() }), "normal_bias_m");
    assert_eq!(of(VplPlacementSettings { starts: vec![DVec3::NAN], ..settings() }), "from");
}

/// Stripes of two colours, 1 cm each, on a square of 1 m: one VPL has their mean.
#[test]
fn textures_count_by_their_mean() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let picture = image::RgbImage::from_fn(100, 4, |x, _| {
        image::Rgb(if x % 2 == 0 { [255, 0, 0] } else { [0, 0, 255] })
    });
    picture.save(path("stripes.png")).unwrap();
    std::fs::write(path("square.mtl"), "newmtl stripes\nKd 0.8 0.8 0.8\nmap_Kd stripes.png\n").unwrap();
    let obj = "mtllib square.mtl\nusemtl stripes\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
               f 1/1 2/2 3/3 4/4\n";
    std::fs::write(path("square.obj"), obj).unwrap();
    let text = "
[camera]
position_m = [0.5, 0.6, -0.5]
target_m = [0.5, 0, -0.51]
vertical_fov_deg = 60
[object.square]
obj = { path = \"square.obj\" }
[light.lamp]
power_w = 1
point = { position_m = [0.5, 1, -0.5] }
[streaming]
vsls = 100000
";
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    let scene = SceneConfig::from_text(text, Path::new("x.toml")).unwrap().build_with(&roots).unwrap();
    let found = place(&scene, &VplPlacementSettings { spacing_m: Some(2.0), ..settings() });
    let [vpl] = found.vpls[..] else { panic!("{found:?}") };
    // About a thousand reflections, stratified: 5 σ of as many at random, 0.4 / √1000 each.
    let away = (vpl.albedo - Vec3::new(0.4, 0.0, 0.4)).abs();
    assert!(vpl.population > 500 && away.max_element() < 5.0 * 0.4 / 1000f32.sqrt(), "{vpl:?}");
    assert!((vpl.area_m2.unwrap() - 1.0).abs() < 1e-3);
}
