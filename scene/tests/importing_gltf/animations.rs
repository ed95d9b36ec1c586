//! Checks that animated nodes are, at any time, where glTF says, and where the config frozen there has them.

use super::files::*;
use glam::{DMat3, DQuat, DVec3, Vec3};
use photonstream_scene::{AssetRoots, Scene, SceneConfig};
use photonstream_shading::LightShape;
use serde_json::{Value, json};
use std::{f64::consts::FRAC_PI_2, path::Path};

/// The bytes after the square's, and accessors of f32 numbers in them.
#[derive(Default)]
struct Numbers {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Numbers {
    fn add<const N: usize>(&mut self, values: &[[f64; N]]) -> usize {
        let kind = match N {
            1 => "SCALAR",
            3 => "VEC3",
            _ => "VEC4",
        };
        let (offset, number) = (72 + self.bytes.len(), 2 + self.accessors.len());
        self.bytes.extend(values.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": 4 * N * values.len() }));
        let count = values.len();
        self.accessors
            .push(json!({ "bufferView": number, "componentType": 5126, "count": count, "type": kind }));
        number
    }
}

/// The square's file with nodes and animations, whose accessors `numbers` holds.
fn animated(nodes: Value, animations: Value, numbers: &Numbers) -> Value {
    let mut file = with(&[("/nodes", nodes), ("/animations", animations)]);
    file["accessors"].as_array_mut().unwrap().extend(numbers.accessors.clone());
    file["bufferViews"].as_array_mut().unwrap().extend(numbers.views.clone());
    let all: Vec<u8> = bytes().into_iter().chain(numbers.bytes.clone()).collect();
    file["buffers"][0] = json!({ "byteLength": all.len(), "uri": data_uri(&all) });
    file
}

fn channel(sampler: usize, node: usize, path: &str) -> Value {
    json!({ "sampler": sampler, "target": { "node": node, "path": path } })
}

fn sampler(input: usize, output: usize, interpolation: &str) -> Value {
    json!({ "input": input, "output": output, "interpolation": interpolation })
}

fn about(axis: DVec3, degrees: f64) -> [f64; 4] {
    DQuat::from_axis_angle(axis, degrees.to_radians()).to_array()
}

pub(super) fn at(scene: &Scene, time_s: f64) -> Scene {
    let mut edit = scene.edit();
    scene.animation.apply(time_s, &mut edit).unwrap();
    edit.finish()
}

/// The corners of the square in the order of the file.
pub(super) fn square_of(map: impl Fn(DVec3) -> DVec3) -> Vec<Vec3> {
    INDICES.iter().map(|&i| map(Vec3::from_array(CORNERS[i as usize]).as_dvec3()).as_vec3()).collect()
}

/// Positions of a few metres, files and scene in f32: 1e-6 each.
pub(super) fn assert_corners(scene: &Scene, object: &str, expected: &[Vec3]) {
    let found = corners(scene, object);
    let far = found.iter().zip(expected).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(found.len() == expected.len() && far < 3e-6, "{object}: {far}\n{found:?}\n{expected:?}");
}

/// An arm that turns about y in 2 s, a square at its end that rolls out in steps, a square that stands still, and a lamp on
/// the arm; a second animation moves the still one.
pub(super) fn arm() -> Value {
    let mut n = Numbers::default();
    let times = n.add(&[[0.0], [1.0], [2.0]]);
    let turn = n.add(&[about(DVec3::Y, 0.0), about(DVec3::Y, 90.0), about(DVec3::Y, 0.0)]);
    let steps = n.add(&[[0.0], [0.5], [1.5]]);
    let out = n.add(&[[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
    let nodes = json!([
        { "name": "arm", "translation": [0, 1, 0], "children": [1, 2] },
        { "name": "hand", "mesh": 0, "translation": [2, 0, 0], "scale": [0.5, 0.5, 0.5] },
        { "name": "lamp", "translation": [1, 0, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "name": "still", "mesh": 0, "translation": [0, 0, -5] },
    ]);
    let animations = json!([
        {
            "name": "wave",
            "channels": [channel(0, 0, "rotation"), channel(1, 1, "translation")],
            "samplers": [sampler(times, turn, "LINEAR"), sampler(steps, out, "STEP")],
        },
        {
            "channels": [channel(0, 3, "translation")],
            "samplers": [sampler(times, out, "LINEAR")],
        },
    ]);
    let mut file = animated(nodes, animations, &n);
    file["scenes"][0]["nodes"] = json!([0, 3]);
    file["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 683, "spot": { "outerConeAngle": 0.5 } }
    ] } });
    file
}

/// Where the hand's square is at a time, in the file's coordinates.
pub(super) fn hand(time_s: f64) -> impl Fn(DVec3) -> DVec3 {
    let time = time_s.rem_euclid(2.0);
    let turn = DQuat::from_rotation_y(FRAC_PI_2 * (1.0 - (1.0 - time).abs()));
    let out = if time < 0.5 {
        2.0
    } else if time < 1.5 {
        3.0
    } else {
        4.0
    };
    move |p| DVec3::Y + turn * (DVec3::X * out + p * 0.5)
}

#[test]
fn the_first_animation_plays_again_and_again() {
    let scene = Files::new(&arm()).scene();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    assert_eq!((scene.animation.period_s(), scene.animation.end_s()), (Some(2.0), None));
    assert_eq!((scene.features.moving_objects, scene.features.moving_lights), (1, 1));
    assert_corners(&scene, "it/hand/paint", &square_of(hand(0.0)));
    for time in [0.25, 0.5, 0.9, 1.0, 1.5, 1.99, 2.0, 7.3, -0.3] {
        let moved = at(&scene, time);
        assert_corners(&moved, "it/hand/paint", &square_of(hand(time)));
        assert_corners(&moved, "it/still/paint", &square_of(|p| p - DVec3::Z * 5.0));
        // At one size an object keeps its shape at rest.
        assert_eq!(moved.geometry.rest_vertices, scene.geometry.rest_vertices);
        let turn = FRAC_PI_2 * (1.0 - (1.0 - time.rem_euclid(2.0)).abs());
        let (sin, cos) = (turn.sin() as f32, turn.cos() as f32);
        let LightShape::Spot { position, direction, .. } = light(&moved, "it/lamp").shape else {
            panic!("no spot");
        };
        assert!(position.distance(Vec3::new(cos, 1.0, -sin)) < 3e-6, "{position}");
        assert!(direction.distance(Vec3::new(-sin, 0.0, -cos)) < 3e-6, "{direction}");
    }
}

#[test]
fn an_animation_is_chosen_by_name_or_left_out() {
    let files = Files::new(&arm());
    let still = files.build("", ", animation = false").unwrap();
    assert!(still.animation.is_empty());
    assert_corners(&still, "it/hand/paint", &square_of(hand(0.0)));
    let other = files.build("", ", animation = \"animation1\"").unwrap();
    assert_eq!((other.animation.period_s(), other.features.moving_objects), (Some(2.0), 1));
    assert_corners(&at(&other, 0.5), "it/still/paint", &square_of(|p| p + DVec3::X * 2.5));
    // The text says which one plays.
    let first = files.scene();
    assert!(first.resolved_text.contains("animation = \"wave\""), "{}", first.resolved_text);
    let again = Scene::from_resolved(&first.resolved_text).unwrap();
    assert_eq!((again.hash, &again.animation), (first.hash, &first.animation));
    assert_eq!(files.build("", ", animation = \"wave\"").unwrap().hash, first.hash);
    let error = files.build("", ", animation = \"waves\"").unwrap_err().to_string();
    assert!(error.contains("object.it.gltf.animation") && error.contains("\"wave\""), "{error}");
    let error = files.build("", ", animation = true").unwrap_err().to_string();
    assert!(error.contains("the name of an animation, or false"), "{error}");
    let error = files.build("", ", animation_time_s = nan").unwrap_err().to_string();
    assert!(error.contains("object.it.gltf.animation_time_s"), "{error}");
    // Without a scene file the first plays, too.
    let model = Scene::load(&files.0.path().join("a.gltf")).unwrap();
    assert_eq!(model.animation.period_s(), Some(2.0));
    let told = "animation: the first of the file plays, again and again";
    assert!(model.choices.iter().any(|choice| choice == told), "{:?}", model.choices);
    let without = Files::new(&square()).scene();
    assert!(without.animation.is_empty() && without.resolved_text.contains("animation = false"));
}

fn config(files: &Files, text: &str) -> SceneConfig {
    let text =
        format!("camera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n{text}");
    SceneConfig::from_text(&text, Path::new("x.toml")).unwrap_or_else(|e| panic!("{e}")).with_root(files)
}

trait WithRoot {
    fn with_root(self, files: &Files) -> Self;
}

impl WithRoot for SceneConfig {
    /// Paths made absolute.
    fn with_root(mut self, files: &Files) -> Self {
        for gltf in self.object.values_mut().filter_map(|object| object.gltf.as_mut()) {
            gltf.path = files.0.path().join(&gltf.path).to_str().unwrap().to_owned();
        }
        self
    }
}

/// Bit for bit, whatever stands around: own axes and units, a placed import, one that is animated itself.
#[test]
fn a_frozen_config_is_the_animated_scene_at_that_time() {
    let files = Files::new(&arm());
    for text in [
        "[object.it]\ngltf = { path = \"a.gltf\" }",
        "[object.it]\nposition_m = [1, 2, 3]\nrotation_deg = [10, 20, 30]\nscale = 2\n\
         gltf = { path = \"a.gltf\", up_axis = \"z\", unit_m = 0.3 }",
        "[object.it]\nrotation_deg = [0, 45, 0]\nscale = [1, 2, -1]\ngltf = { path = \"a.gltf\" }",
        "[object.it]\nscale = 2\ngltf = { path = \"a.gltf\" }\n\
         [[animation]]\nobject = \"it\"\nproperty = \"position_m\"\ntimes_s = [0, 3]\nvalues = [[0, 0, 0], [3, 0, 0]]",
    ] {
        let config = config(&files, text);
        let build = |config: SceneConfig| {
            config.build_with(&AssetRoots { folders: Vec::new() }).unwrap_or_else(|e| panic!("{e}"))
        };
        let scene = build(config.clone());
        for time in [0.0, 0.3, 1.25, 5.6] {
            let frozen = build(config.at(time).unwrap());
            assert!(frozen.animation.is_empty());
            assert_eq!((frozen.features.moving_objects, frozen.features.moving_lights), (0, 0));
            let moved = at(&scene, time);
            assert_eq!(moved.geometry, frozen.geometry, "{text}, {time}");
            assert_eq!(moved.objects, frozen.objects, "{text}, {time}");
            let shapes = |scene: &Scene| scene.lights.iter().map(|l| l.light.clone()).collect::<Vec<_>>();
            assert_eq!(shapes(&moved), shapes(&frozen), "{text}, {time}");
            // Held, it stays as it is.
            assert_eq!(at(&frozen, time + 0.4).geometry, frozen.geometry);
        }
    }
}

#[test]
fn the_import_places_what_moves_within() {
    let files = Files::new(&arm());
    let keys = "position_m = [1, 0, 0]\nrotation_deg = [0, 90, 0]\nscale = 2";
    let scene = files.build(keys, ", up_axis = \"z\", unit_m = 0.5").unwrap();
    let place = |p: DVec3| {
        let p = DVec3::new(p.x, p.z, -p.y) * 0.5 * 2.0;
        DVec3::X + DMat3::from_rotation_y(FRAC_PI_2) * p
    };
    for time in [0.0, 0.7] {
        assert_corners(&at(&scene, time), "it/hand/paint", &square_of(|p| place(hand(time)(p))));
    }
    // Moved by the scene file meanwhile.
    let text = "origin_m = [0, 0, 0]\n[object.it]\ngltf = { path = \"a.gltf\" }\n\
        [[animation]]\nobject = \"it\"\nproperty = \"position_m\"\ntimes_s = [0, 4]\nvalues = [[0, 0, 0], [4, 0, 0]]";
    let scene = config(&files, text).build_with(&AssetRoots { folders: Vec::new() }).unwrap();
    assert_eq!(scene.features.moving_objects, 2);
    let moved = at(&scene, 3.25);
    assert_corners(&moved, "it/hand/paint", &square_of(|p| hand(3.25)(p) + DVec3::X * 3.25));
    assert_corners(&moved, "it/still/paint", &square_of(|p| p + DVec3::new(3.25, 0.0, -5.0)));
}

/// A turned square grows along one of its own axes; one that starts without a size is there later.
#[test]
fn scales_are_those_of_the_node() {
    let mut n = Numbers::default();
    let times = n.add(&[[0.0], [1.0]]);
    let grow = n.add(&[[1.0, 1.0, 1.0], [3.0, 1.0, 1.0]]);
    let appear = n.add(&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]);
    let turned = about(DVec3::Z, 30.0);
    let nodes = json!([
        { "name": "bar", "mesh": 0, "rotation": turned },
        { "name": "seed", "mesh": 0, "translation": [0, 4, 0] },
    ]);
    let animations = json!([{
        "channels": [channel(0, 0, "scale"), channel(1, 1, "scale")],
        "samplers": [sampler(times, grow, "LINEAR"), sampler(times, appear, "LINEAR")],
    }]);
    let mut file = animated(nodes, animations, &n);
    file["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = Files::new(&file).scene();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let half = at(&scene, 0.5);
    let turn = DQuat::from_array(turned);
    assert_corners(&half, "it/bar/paint", &square_of(|p| turn * (DVec3::new(2.0, 1.0, 1.0) * p)));
    assert_corners(&half, "it/seed/paint", &square_of(|p| p * 0.5 + DVec3::Y * 4.0));
    // A millionth of its size.
    assert_corners(&scene, "it/seed/paint", &square_of(|p| p * 1e-6 + DVec3::Y * 4.0));
}

/// What stands still above shears what turns below: right angles of 2 : 1 are up to 36.87° off, at 45°.
#[test]
fn shearing_is_told() {
    let mut n = Numbers::default();
    let times = n.add(&[[0.0], [1.0]]);
    let turn = n.add(&[about(DVec3::Z, 0.0), about(DVec3::Z, 90.0)]);
    let nodes = json!([
        { "name": "wide", "scale": [2, 1, 1], "children": [1] },
        { "name": "wheel", "mesh": 0 },
    ]);
    let animations =
        json!([{ "channels": [channel(0, 1, "rotation")], "samplers": [sampler(times, turn, "LINEAR")] }]);
    let scene = Files::new(&animated(nodes, animations, &n)).scene();
    let told = "object \"it\": node \"wheel\": its animation shears it, which moving, turning and scaling cannot: right angles are up to 36.87° off";
    assert_eq!(scene.notices, [told]);
    // A turn above what is sheared is exact.
    let nodes = json!([
        { "name": "top", "children": [1] },
        { "name": "wide", "scale": [2, 1, 1], "children": [2] },
        { "name": "slanted", "mesh": 0, "rotation": about(DVec3::Z, 45.0) },
    ]);
    let animations =
        json!([{ "channels": [channel(0, 0, "rotation")], "samplers": [sampler(times, turn, "LINEAR")] }]);
    let scene = Files::new(&animated(nodes, animations, &n)).scene();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let slanted = |p: DVec3| DVec3::new(2.0, 1.0, 1.0) * (DQuat::from_rotation_z(0.5 * FRAC_PI_2) * p);
    let turned = |p: DVec3| DQuat::from_rotation_z(0.25 * FRAC_PI_2) * slanted(p);
    assert_corners(&at(&scene, 0.25), "it/slanted/paint", &square_of(turned));
}

/// Normals turn with their node, and stretch as normals do: of (1, 1, 1) on a node of scale (2, 1, 1) that turns about y.
#[test]
fn normals_ride_along() {
    let mut n = Numbers::default();
    let times = n.add(&[[0.0], [1.0]]);
    let turn = n.add(&[about(DVec3::Y, 0.0), about(DVec3::Y, 90.0)]);
    let leaning = n.add(&[[1.0, 1.0, 1.0]; 5]);
    let nodes = json!([{ "name": "sign", "mesh": 0, "scale": [2, 1, 1] }]);
    let animations =
        json!([{ "channels": [channel(0, 0, "rotation")], "samplers": [sampler(times, turn, "LINEAR")] }]);
    let mut file = animated(nodes, animations, &n);
    file["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(leaning);
    let scene = Files::new(&file).scene();
    for time in [0.0, 0.5] {
        let moved = at(&scene, time);
        let object = &moved.objects[0];
        let found = (object.world_from_own_normal * moved.geometry.own_normals[0]).normalize();
        let expected = DQuat::from_rotation_y(FRAC_PI_2 * time) * DVec3::new(0.5, 1.0, 1.0).normalize();
        // f32, a few roundings.
        assert!(found.distance(expected.as_vec3()) < 1e-6, "{found} {expected}");
    }
}

/// An emitting square on an arm shines from where it is.
#[test]
fn emitters_ride_along() {
    let mut file = arm();
    file["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let scene = Files::new(&file).scene();
    let power = light(&scene, "it/hand/paint").power;
    let moved = at(&scene, 1.0);
    let lamp = light(&moved, "it/hand/paint");
    // A quarter turn about y: what looked along +z looks along +x.
    assert!(lamp.shape.emitter_normal().distance(Vec3::X) < 1e-6);
    assert!((lamp.power - power).abs().max_element() < 1e-6 * power.x, "{} {power}", lamp.power);
    assert_eq!(scene.features.moving_lights, 2);
}

#[test]
fn bad_animations_are_explained() {
    let error = |pointer: &str, value: Value, expected: &str| {
        let mut file = arm();
        *file.pointer_mut(pointer).unwrap() = value;
        let error = Files::new(&file).error();
        assert!(error.contains(expected), "{error}\n{expected}");
    };
    let of = "animation \"wave\", channel 0: ";
    error(
        "/animations/0/samplers/0/output",
        json!(4),
        &format!("{of}accessor 4: found Scalar, expected Vec4"),
    );
    error("/accessors/2/count", json!(2), &format!("{of}3 values for 2 times, expected 1 for each"));
    error(
        "/animations/0/samplers/0/interpolation",
        json!("CUBICSPLINE"),
        &format!("{of}3 values for 3 times, expected 3 for each"),
    );
    error("/animations/0/channels/0/sampler", json!(9), "animations[0].channels[0].sampler names something");
    error("/animations/0/channels/0/target/node", json!(9), &format!("{of}it moves node 9, of 4"));
    let path = "/animations/0/channels/0/target/path";
    error(path, json!("colour"), &format!("{of}its path is none of translation"));
    error(
        "/animations/0/channels/1",
        channel(0, 0, "rotation"),
        "animation \"wave\", channel 1: its property has a channel already",
    );
    // Times that fall, and numbers that are none.
    let with_bytes = |change: &dyn Fn(&mut Numbers)| {
        let mut n = Numbers::default();
        let times = n.add(&[[0.0], [1.0]]);
        let out = n.add(&[[0.0; 3], [1.0; 3]]);
        change(&mut n);
        let animations = json!([{ "channels": [channel(0, 0, "translation")], "samplers": [sampler(times, out, "LINEAR")] }]);
        Files::new(&animated(json!([{ "mesh": 0 }]), animations, &n)).build("", "")
    };
    assert!(with_bytes(&|_| {}).is_ok());
    let fall = with_bytes(&|n| n.bytes[..4].copy_from_slice(&2f32.to_le_bytes())).unwrap_err().to_string();
    assert!(fall.contains("its times are not within 0 to 1e9 s in order"), "{fall}");
    let nan =
        with_bytes(&|n| n.bytes[8..12].copy_from_slice(&f32::NAN.to_le_bytes())).unwrap_err().to_string();
    assert!(nan.contains("found a value [NaN, 0, 0, 0], expected numbers within ±1e9"), "{nan}");
    // What cannot move is told.
    let mut file = arm();
    file["nodes"][1] = json!({ "name": "hand", "mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 2,0,0,1] });
    let scene = Files::new(&file).scene();
    let told = "object \"it\": animation \"wave\": node \"hand\" does not move by itself: it has a matrix";
    assert_eq!(scene.notices, [told]);
}
