//! Checks that an edited scene is the one that an equally edited config gives, bit for bit, and that bad edits are told.
#![allow(clippy::unwrap_used)]

use glam::{DAffine3, DVec3, Vec3};
use photonstream_scene::{
    AssetRoots, LightId, ObjectId, Scene, SceneConfig,
    bvh::Ray,
    config::{OneOrThree, Vector},
};
use photonstream_shading::{Light, LightShape};
use serde_json::{Map, Value, json};
use std::{path::Path, sync::Arc};

/// A room with a ball, a crate, a sheet, and one light of each kind, moved by `shift`.
fn config(shift: DVec3) -> SceneConfig {
    let p = |x: f64, y: f64, z: f64| format!("{:?}", (DVec3::new(x, y, z) + shift).to_array());
    let text = [
        format!("origin_m = {}\n", p(0.125, 0.25, 0.0)),
        format!("camera = {{ position_m = {}, target_m = {}, vertical_fov_deg = 40 }}\n", p(0.0, 0.0, 4.0), p(0.0, 0.0, 0.0)),
        "material.white.albedo = 0.7\n".into(),
        format!("[object.room]\nmaterial = \"white\"\nsides = \"back\"\nposition_m = {}\nbox = {{ size_m = [4, 3, 5] }}\n", p(0.1, 0.2, 0.3)),
        format!("[object.ball]\nmaterial = \"white\"\nposition_m = {}\nscale = [1, 1.3, -0.7]\nsphere = {{ radius_m = 0.45, segments = 24 }}\n", p(0.3, 0.1, 0.2)),
        format!("[object.crate]\nmaterial = \"white\"\nposition_m = {}\nrotation_deg = [0, 30, 0]\nbox = {{ size_m = [0.3, 0.7, 0.4] }}\n", p(-0.3, -0.1, 0.2)),
        format!("[object.sheet]\nmaterial = \"white\"\nsides = \"both\"\nposition_m = {}\nquad = {{ corner_m = [0.1, -0.2, 0.3], edge_u_m = [0.6, 0, 0.1], edge_v_m = [0, 0.4, 0] }}\n", p(-0.7, 0.3, -0.9)),
        format!("[light.bulb]\npower_w = [3, 2, 1]\npoint = {{ position_m = {} }}\n", p(0.7, 0.9, 0.1)),
        format!("[light.cone]\npower_w = 5\nspot = {{ position_m = {}, target_m = {}, outer_half_angle_deg = 40 }}\n", p(0.1, 1.3, 0.2), p(0.0, -0.3, 0.1)),
        format!("[light.lamp]\npower_w = 5\nrectangle = {{ position_m = {}, corner_m = [0, 0, 0], edge_u_m = [0.25, 0, 0], edge_v_m = [0, 0, 0.25] }}\n", p(-0.125, 1.25, -0.125)),
        "[light.sun]\nirradiance_w_m2 = 2\ndirectional = { direction = [1, -3, 2] }\n".into(),
    ]
    .concat();
    SceneConfig::from_text(&text, Path::new("test.toml")).unwrap()
}

fn build(config: SceneConfig) -> Scene {
    config.build_with(&AssetRoots::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn values(value: Value) -> Map<String, Value> {
    value.as_object().unwrap().clone()
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    /// In [-size, size]³.
    fn vector(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * (2.0 * size) - size
    }
}

/// All that edits may change is equal bit for bit, and so is what rays see: 500 from within the room, seed 7.
fn assert_same(edited: &Scene, loaded: &Scene) {
    assert!(edited.geometry == loaded.geometry, "vertices, normals or triangles differ");
    assert_eq!((edited.bounds, edited.origin_m), (loaded.bounds, loaded.origin_m));
    assert_eq!((&edited.objects, &edited.lights), (&loaded.objects, &loaded.lights));
    assert_eq!(edited.materials, loaded.materials);
    let mut random = Random(7);
    for _ in 0..500 {
        let origin = random.vector(1.4).as_vec3();
        let ray = Ray { origin, direction: random.vector(1.0).as_vec3(), t_max: f32::INFINITY };
        assert_eq!(edited.bvh.closest(&ray), loaded.bvh.closest(&ray));
    }
}

/// 200 versions of one to three random edits each, seed 1, here and 3 000 km away, each compared with a scene loaded from
/// the config with the same numbers written into it. Exact: no tolerance.
#[test]
fn random_edits_equal_an_equally_edited_config() {
    for shift in [DVec3::ZERO, DVec3::new(3_000_000.5, -1234.25, 8000.0)] {
        let mut config = config(shift);
        let mut scene = build(config.clone());
        let mut random = Random(1);
        for step in 0..200 {
            let mut edit = scene.edit();
            for _ in 0..=step % 3 {
                match (random.next() * 8.0) as usize {
                    0 => edit_material(&mut config, &mut edit, &mut random),
                    which @ 1..=3 => edit_object(&mut config, &mut edit, which - 1, shift, &mut random),
                    which => {
                        let position = shift + random.vector(0.9);
                        edit_light(&mut config, &mut edit, which - 4, position, &mut random);
                    }
                }
            }
            scene = edit.finish();
            scene.bvh.validate().unwrap();
            assert_same(&scene, &build(config.clone()));
        }
    }
}

fn edit_material(config: &mut SceneConfig, edit: &mut photonstream_scene::SceneEdit, random: &mut Random) {
    let albedo = [random.next(), random.next(), random.next()];
    config.material.get_mut("white").unwrap().albedo = OneOrThree(albedo);
    edit.set_material("white", &values(json!({ "albedo": albedo }))).unwrap();
}

/// Moves, turns and stretches an object, one or several of them, half of the stretches mirrored.
fn edit_object(
    config: &mut SceneConfig,
    edit: &mut photonstream_scene::SceneEdit,
    which: usize,
    shift: DVec3,
    random: &mut Random,
) {
    let name = ["ball", "crate", "sheet"][which];
    let object = config.object.get_mut(name).unwrap();
    let mut keys = Map::new();
    if random.next() < 0.5 {
        let position = shift + random.vector(0.9);
        object.position_m = Some(position.into());
        keys.insert("position_m".into(), json!(position.to_array()));
    }
    if random.next() < 0.5 {
        let scale = (random.vector(1.0) + random.vector(1.0).signum() * 0.2).to_array();
        object.scale = Some(OneOrThree(scale));
        keys.insert("scale".into(), json!(scale));
    }
    if random.next() < 0.5 || keys.is_empty() {
        let angles = random.vector(200.0);
        object.rotation_deg = Some(angles.into());
        keys.insert("rotation_deg".into(), json!(angles.to_array()));
    }
    edit.move_object(name, &keys).unwrap();
}

fn edit_light(
    config: &mut SceneConfig,
    edit: &mut photonstream_scene::SceneEdit,
    which: usize,
    position: DVec3,
    random: &mut Random,
) {
    let power = random.next();
    let name = ["bulb", "cone", "lamp", "sun"][which];
    let light = config.light.get_mut(name).unwrap();
    let scalar = Some(OneOrThree([power; 3]));
    let keys = match which {
        0 => {
            (light.power_w, light.point.as_mut().unwrap().position_m) = (scalar, position.into());
            json!({ "power_w": power, "position_m": position.to_array() })
        }
        1 => {
            // The target stays, so that the axis turns.
            let spot = light.spot.as_mut().unwrap();
            (spot.position_m, spot.outer_half_angle_deg) = (position.into(), 20.0 + 50.0 * power);
            json!({ "spot": { "position_m": position.to_array() }, "spot.outer_half_angle_deg": 20.0 + 50.0 * power })
        }
        2 => {
            light.power_w = scalar;
            let turn = Vector(random.vector(90.0).to_array());
            let size = 0.5 + random.next();
            let lamp = light.rectangle.as_mut().unwrap();
            (lamp.rotation_deg, lamp.scale) = (Some(turn), Some(OneOrThree([size, -size, size])));
            let keys = json!({ "rotation_deg": turn.0, "scale": [size, -size, size] });
            edit.move_object("lamp", &values(keys)).unwrap();
            json!({ "power_w": [power, power, power], "enabled": true })
        }
        _ => {
            let direction = Vector(random.vector(1.0).to_array());
            (light.irradiance_w_m2, light.directional.as_mut().unwrap().direction) = (scalar, direction);
            json!({ "irradiance_w_m2": power, "direction": direction.0 })
        }
    };
    edit.set_light(name, &values(keys)).unwrap();
}

#[test]
fn an_object_placed_back_gives_the_scene_as_it_was() {
    for shift in [DVec3::ZERO, DVec3::splat(3e6)] {
        let scene = build(config(shift));
        for (index, object) in scene.objects.iter().enumerate() {
            let id = ObjectId(index as u32);
            let home = object.world_from_rest;
            let away = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
            let moved = scene.with_object_placed(id, away * home).unwrap();
            assert_ne!(moved.geometry, scene.geometry);
            assert_same(&moved.with_object_placed(id, home).unwrap(), &scene);
        }
    }
}

/// Motions come from keys in one process and from published records in another: the same vertices, to one unit in the
/// last place of f32 where f64 rounds its way; here, none differs.
#[test]
fn a_motion_gives_what_its_keys_give() {
    let scene = build(config(DVec3::ZERO));
    let mut random = Random(3);
    for _ in 0..20 {
        let mut edit = scene.edit();
        let keys = json!({ "position_m": random.vector(1.0).to_array(), "rotation_deg": random.vector(180.0).to_array() });
        let [id] = edit.move_object("ball", &values(keys)).unwrap()[..] else { panic!() };
        let edited = edit.finish();
        let motion = edited.objects[id.0 as usize].world_from_rest;
        assert_same(&scene.with_object_placed(id, motion).unwrap(), &edited);
    }
}

/// Sizes come from keys in one process and from published maps in another: 100 random moves, turns and stretches, half of
/// them mirrored, seed 5. Map, winding and vertices are the same: vertices to one unit in the last place of f32, where f64
/// rounds its way. Maps are followed by a scene that knows nothing but the one before.
#[test]
fn a_map_gives_what_its_keys_give() {
    let scene = build(config(DVec3::ZERO));
    let (mut edited, mut placed) = (scene.clone(), scene.clone());
    let id = scene.object("ball").unwrap();
    let mut random = Random(5);
    for step in 0..100 {
        let mut keys = Map::new();
        keys.insert("position_m".into(), json!(random.vector(0.9).to_array()));
        keys.insert("rotation_deg".into(), json!(random.vector(180.0).to_array()));
        if step % 3 != 0 {
            let scale = random.vector(1.0) + random.vector(1.0).signum() * 0.2;
            keys.insert("scale".into(), json!(scale.to_array()));
        }
        let mut edit = edited.edit();
        edit.move_object("ball", &keys).unwrap();
        edited = edit.finish();
        let map = edited.world_from_loaded(id);
        let before = placed;
        placed = before.with_object_placed(id, map).unwrap();
        let away = (placed.world_from_loaded(id).to_cols_array().into_iter().zip(map.to_cols_array()))
            .fold(0.0, |away: f64, (a, b)| away.max((a - b).abs()));
        // Some roundings of numbers below 4.
        assert!(away < 1e-14, "step {step}: {away:e}");
        let (found, expected) = (&placed.geometry, &edited.geometry);
        assert_eq!(found.triangles, expected.triangles, "step {step}");
        for (a, b) in found.vertices.iter().zip(&expected.vertices) {
            // One unit in the last place of numbers below 4.
            assert!((*a - *b).abs().max_element() <= 2.4e-7, "step {step}: {a} is not {b}");
        }
        let same_size = Arc::ptr_eq(&found.rest_vertices, &before.geometry.rest_vertices);
        assert_eq!(same_size, step % 3 == 0, "step {step}: vertices at rest");
        // The same map again changes nothing.
        let again = placed.with_object_placed(id, map).unwrap();
        assert!(Arc::ptr_eq(&again.geometry, &placed.geometry), "step {step}");
    }
    assert_same(&placed.with_object_placed(id, scene.world_from_loaded(id)).unwrap(), &scene);
}

/// All numbers are multiples of 1/64, exact in f32: moving the lamp is writing another corner.
#[test]
fn an_emitter_takes_its_light_along() {
    let scene = build(config(DVec3::ZERO));
    let mut edit = scene.edit();
    edit.move_object("lamp", &values(json!({ "position_m": [0.375, 1.0, 0.625] }))).unwrap();
    edit.set_light("lamp", &values(json!({ "power_w": 7 }))).unwrap();
    let edited = edit.finish();
    let mut config = config(DVec3::ZERO);
    let lamp = config.light.get_mut("lamp").unwrap();
    lamp.power_w = Some(OneOrThree([7.0; 3]));
    let shape = lamp.rectangle.as_mut().unwrap();
    (shape.corner_m, shape.position_m) = (Vector([0.375, 1.0, 0.625]), None);
    let loaded = build(config);
    let id = loaded.light("lamp").unwrap().0 as usize;
    assert_eq!(edited.lights[id].light, loaded.lights[id].light);
    assert_eq!(edited.geometry.vertices, loaded.geometry.vertices);
    assert_ne!(edited.lights[id].light, scene.lights[id].light);
}

#[test]
fn a_light_switched_off_comes_back_as_it_was() {
    let scene = build(config(DVec3::ZERO));
    for name in ["bulb", "cone", "lamp", "sun"] {
        let id = scene.light(name).unwrap().0 as usize;
        let with = |scene: &Scene, keys: Value| {
            let mut edit = scene.edit();
            edit.set_light(name, &values(keys)).unwrap();
            edit.finish()
        };
        let off = with(&scene, json!({ "enabled": false }));
        assert_eq!((off.lights[id].enabled, off.lights[id].light.power), (false, Vec3::ZERO));
        assert_eq!(off.lights[id].light.shape, scene.lights[id].light.shape);
        let mut moved = off.edit();
        moved.move_object("lamp", &values(json!({ "position_m": [0.5, 0, 0] }))).unwrap();
        assert_eq!(moved.finish().lights[id].light.power, Vec3::ZERO);
        assert_same(&with(&off, json!({ "enabled": true })), &scene);
    }
}

#[test]
fn versions_share_what_they_do_not_change() {
    let scene = build(config(DVec3::ZERO));
    let mut edit = scene.edit();
    edit.set_light("bulb", &values(json!({ "power_w": 1 }))).unwrap();
    assert!(Arc::ptr_eq(&edit.finish().geometry, &scene.geometry));
    let mut edit = scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0, 0, 0] }))).unwrap();
    let moved = edit.finish();
    assert!(Arc::ptr_eq(&moved.geometry.triangles, &scene.geometry.triangles));
    assert!(Arc::ptr_eq(&moved.geometry.rest_vertices, &scene.geometry.rest_vertices));
    let parts = |scene: &Scene| scene.bvh.parts().map(std::ptr::from_ref).collect::<Vec<_>>();
    let ball = scene.object("ball").unwrap().0 as usize;
    for (index, (a, b)) in parts(&moved).into_iter().zip(parts(&scene)).enumerate() {
        assert_eq!(a == b, index != ball, "part {index}");
    }
    let mut edit = scene.edit();
    edit.move_object("ball", &values(json!({ "scale": 2 }))).unwrap();
    // The ball is mirrored at load, and no longer.
    let stretched = edit.finish();
    assert!(!Arc::ptr_eq(&stretched.geometry.rest_vertices, &scene.geometry.rest_vertices));
    assert!(!Arc::ptr_eq(&stretched.geometry.triangles, &scene.geometry.triangles));
    assert!(Arc::ptr_eq(&stretched.geometry.object_of, &scene.geometry.object_of));
    let mut edit = stretched.edit();
    edit.set_material("white", &values(json!({ "albedo": 0.25 }))).unwrap();
    let painted = edit.finish();
    assert!(Arc::ptr_eq(&painted.geometry, &stretched.geometry));
    assert_eq!(painted.albedo(painted.object("ball").unwrap()), Vec3::splat(0.25));
}

#[test]
fn bad_edits_say_where_what_and_what_instead() {
    let scene = build(config(DVec3::ZERO));
    let light =
        |name: &str, keys: Value| scene.edit().set_light(name, &values(keys)).unwrap_err().to_string();
    let object =
        |name: &str, keys: Value| scene.edit().move_object(name, &values(keys)).unwrap_err().to_string();
    let material =
        |name: &str, keys: Value| scene.edit().set_material(name, &values(keys)).unwrap_err().to_string();
    for (error, expected) in [
        (
            material("whit", json!({ "albedo": 1 })),
            r#"material: no material is called "whit", did you mean "white"?"#,
        ),
        (
            material("white", json!({ "albdo": 1 })),
            r#"material.white: unknown key "albdo", did you mean "albedo"?"#,
        ),
        (
            material("white", json!({ "albedo": 1.5 })),
            "material.white.albedo: found [1.5, 1.5, 1.5], expected albedos",
        ),
        (
            material("white", json!({ "albedo": "a" })),
            r#"material.white.albedo: found "a", expected a number or three"#,
        ),
        (material("white", json!({})), "material.white: found no value, expected some of albedo"),
        (light("lmap", json!({ "power_w": 1 })), r#"light: no light is called "lmap", did you mean "lamp"?"#),
        (light("bulb", json!({ "power": 1 })), r#"light.bulb: unknown key "power", did you mean "power_w"?"#),
        (light("bulb", json!({ "direction": 1 })), "expected one of: power_w, enabled, position_m"),
        (
            light("bulb", json!({ "power_w": -1 })),
            "light.bulb.power_w: found [-1, -1, -1], expected values within",
        ),
        (
            light("bulb", json!({ "power_w": "a" })),
            r#"light.bulb.power_w: found "a", expected a number or three"#,
        ),
        (light("bulb", json!({ "enabled": 1 })), "light.bulb.enabled: found 1, expected true or false"),
        (
            light("bulb", json!({ "position_m": [1, 2] })),
            "light.bulb.point.position_m: found [1,2], expected three",
        ),
        (
            light("bulb", json!({ "position_m": [1, 2, 1e30] })),
            "light.bulb.point.position_m: found [1, 2, 1000",
        ),
        (light("bulb", json!({})), "light.bulb: found no value, expected some of power_w"),
        (light("sun", json!({ "power_w": 1 })), r#"light.sun: unknown key "power_w"; expected"#),
        (light("sun", json!({ "direction": [0, 0, 0] })), "light.sun.directional.direction: found [0, 0, 0]"),
        (
            light("cone", json!({ "outer_half_angle_deg": 200 })),
            "light.cone.spot.outer_half_angle_deg: found 200",
        ),
        (
            light("cone", json!({ "inner_half_angle_deg": 50 })),
            "light.cone.spot.inner_half_angle_deg: found 50",
        ),
        (
            light("cone", json!({ "target_m": [0, 0, 0], "direction": [0, 1, 0] })),
            "found target_m and direction",
        ),
        (
            light("cone", json!({ "spot": { "position_m": [0, 0, 0] }, "position_m": [0, 0, 0] })),
            "found two values",
        ),
        (
            object("boll", json!({ "position_m": [0, 0, 0] })),
            r#"object: no object is called "boll", did you mean "ball"?"#,
        ),
        (
            object("ball", json!({ "position": [0, 0, 0] })),
            r#"object.ball: unknown key "position", did you mean "position_m"?"#,
        ),
        (
            object("ball", json!({ "position_m": null })),
            "object.ball.position_m: found null, expected three numbers",
        ),
        (
            object("ball", json!({ "position_m": [2e9, 0, 0] })),
            "object.ball.position_m: found [2000000000, 0, 0]",
        ),
        (object("ball", json!({ "position_m": [1e9, 0, 0] })), "object.ball: found a vertex"),
        (object("ball", json!({ "rotation_deg": [1e9, 0, 0] })), "object.ball.rotation_deg: found"),
        (
            object("ball", json!({ "scale": [1, 0, 1] })),
            "object.ball.scale: found [1, 0, 1], expected factors",
        ),
        (
            object("ball", json!({ "scale": "x" })),
            r#"object.ball.scale: found "x", expected a number or three"#,
        ),
        (object("ball", json!({ "scale": 1e9, "position_m": [1e9, 0, 0] })), "object.ball: found a vertex"),
    ] {
        assert!(error.contains(expected), "{error:?} lacks {expected:?}");
    }
}

#[test]
fn unusable_lights_and_motions_are_refused() {
    let scene = build(config(DVec3::ZERO));
    let id = scene.light("bulb").unwrap();
    let point = |x: f32, power: f32| Light {
        shape: LightShape::Point { position: Vec3::new(x, 0.0, 0.0) },
        power: Vec3::splat(power),
    };
    assert_eq!(scene.with_light(id, point(1.0, 2.0)).unwrap().lights[id.0 as usize].light, point(1.0, 2.0));
    for (id, light, expected) in [
        (id, point(f32::NAN, 1.0), "light.bulb.position: found"),
        (id, point(0.0, -1.0), "light.bulb.power: found"),
        (LightId(99), point(0.0, 1.0), "found light 99"),
        (scene.light("sun").unwrap(), point(0.0, 1.0), "expected a light of the same kind"),
    ] {
        let error = scene.with_light(id, light).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let ball = scene.object("ball").unwrap();
    let mut shear = DAffine3::IDENTITY;
    shear.matrix3.y_axis.x = 1e-6;
    for (id, motion, expected) in [
        (ball, shear, "expected orthogonal axes"),
        (ball, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)), "expected orthogonal axes"),
        (ball, DAffine3::from_scale(DVec3::splat(f64::NAN)), "expected orthogonal axes"),
        (ball, DAffine3::from_scale(DVec3::splat(2e9)), "scales of magnitude 1e-9 to 1e9"),
        (ball, DAffine3::from_translation(DVec3::splat(f64::NAN)), "found a vertex"),
        (ball, DAffine3::from_translation(DVec3::splat(2e9)), "found a vertex"),
        (ObjectId(99), DAffine3::IDENTITY, "found object 99"),
    ] {
        let error = scene.with_object_placed(id, motion).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
