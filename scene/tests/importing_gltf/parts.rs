//! Checks that single objects of a file are renamed, and get surfaces and emission of their own.

use super::{
    animations::{arm, assert_corners, at, hand, square_of},
    files::*,
};
use glam::Vec3;
use photonstream_scene::{Scene, Side, Sides};
use serde_json::{Value, json};
use std::f32::consts::PI;

/// Three squares: two of `paint`, one of which has an emitting part, and a lamp on a node without a mesh.
pub(super) fn squares() -> Value {
    let primitive =
        |material: u32| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": material });
    let mut file = with(&[
        ("/extensionsUsed", json!(["KHR_lights_punctual"])),
        ("/extensions", json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } })),
        ("/scenes/0/nodes", json!([0, 1, 2])),
        (
            "/nodes",
            json!([
                { "name": "wheel", "mesh": 0 },
                { "name": "body", "mesh": 1, "translation": [0, 3, 0] },
                { "name": "pole", "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            ]),
        ),
        (
            "/meshes",
            json!([{ "primitives": [primitive(0)] }, { "primitives": [primitive(0), primitive(1)] }]),
        ),
    ]);
    let matt = json!({ "metallicFactor": 0.0 });
    let lit = json!({ "name": "lit", "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": matt });
    file["materials"].as_array_mut().unwrap().push(lit);
    file
}

fn parts(text: &str) -> Result<Scene, photonstream_scene::SceneError> {
    Files::new(&squares()).build("", &format!(", parts = {{ {text} }}"))
}

fn sides(scene: &Scene, name: &str) -> Sides {
    scene.objects[scene.object(name).unwrap().0 as usize].sides
}

#[test]
fn objects_are_called_as_the_scene_file_says() {
    let files = Files::new(&squares());
    let plain = files.scene();
    assert_eq!(names(&plain), ["it/body/lit", "it/body/paint", "it/wheel/paint"]);
    // What is renamed stands where its new name is in the order; names of the file mean what they meant.
    let keys = ", materials = { wheel = \"grey\" }, parts = { wheel = { rename = \"a wheel\" }, \"body/lit\" = { rename = \"lamp\" } }";
    let scene = files.build("", keys).unwrap();
    assert_eq!(names(&scene), ["it/a wheel", "it/body/paint", "it/lamp"]);
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    for (new, old) in [("it/a wheel", "it/wheel/paint"), ("it/lamp", "it/body/lit")] {
        assert_eq!(corners(&scene, new), corners(&plain, old));
    }
    assert_eq!(scene.albedo(scene.object("it/a wheel").unwrap()), Vec3::splat(0.3));
    assert_eq!(scene.lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["it/lamp", "it/pole"]);
    assert_eq!(light(&scene, "it/lamp"), light(&plain, "it/body/lit"));
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.objects, &again.lights), (scene.hash, &scene.objects, &scene.lights));
    assert_ne!(scene.hash, plain.hash);
    // By its new name it is moved and dimmed alone, by that of the import with all.
    let mut edit = scene.edit();
    let position = |x: f64| [("position_m".to_owned(), json!([x, 0, 0]))].into_iter().collect();
    assert_eq!(edit.move_object("it", &position(9.0)).unwrap().len(), 3);
    edit.move_object("it/lamp", &position(5.0)).unwrap();
    edit.set_light("it/lamp", &[("power_w".to_owned(), json!(7))].into_iter().collect()).unwrap();
    assert!(edit.move_object("it/body/lit", &position(5.0)).is_err());
    let moved = edit.finish();
    let first = |name: &str| corners(&moved, name)[0] - corners(&scene, name)[0];
    assert_eq!([first("it/a wheel").x, first("it/lamp").x], [9.0, 5.0]);
    assert_eq!(light(&moved, "it/lamp").power, Vec3::splat(7.0));
    // A node without faces of its own, and what only begins alike, are no others.
    assert!(parts("wheel = { rename = \"lamps\" }, \"body/lit\" = { rename = \"lamp\" }").is_ok());
    // Two may change their names with each other.
    let swapped = parts("wheel = { rename = \"x\" }, lit = { rename = \"wheel\" }").unwrap();
    assert_eq!(names(&swapped), ["it/body/paint", "it/wheel", "it/x"]);
}

#[test]
fn renamed_objects_move_with_their_file() {
    let files = Files::new(&arm());
    let scene = files.build("", ", parts = { hand = { rename = \"zebra\", radiance_w_m2_sr = 1 } }").unwrap();
    assert_eq!(names(&scene), ["it/still/paint", "it/zebra"]);
    assert_eq!((scene.features.moving_objects, scene.features.moving_lights), (1, 2));
    for time in [0.0, 0.25, 0.9, 1.5, 7.3] {
        assert_corners(&at(&scene, time), "it/zebra", &square_of(hand(time)));
    }
    // A quarter turn about y: what looked along +z looks along +x. f32: 1e-6.
    let lamp = light(&at(&scene, 1.0), "it/zebra").shape.emitter_normal();
    assert!(lamp.distance(Vec3::X) < 1e-6, "{lamp}");
}

#[test]
fn sides_materials_and_emission_are_those_of_the_nearest_name() {
    let text = "paint = { sides = \"both\", material = \"grey\" }, body = { sides = \"back\" }, \
                \"wheel/paint\" = { radiance_w_m2_sr = [1, 2, 3] }";
    let scene = parts(text).unwrap();
    // The material's before the node's; keys that the pair's table lacks are those of the material's.
    assert_eq!(sides(&scene, "it/body/paint"), Sides::Both);
    assert_eq!(sides(&scene, "it/wheel/paint"), Sides::Both);
    for name in ["it/body/paint", "it/wheel/paint"] {
        assert_eq!(scene.albedo(scene.object(name).unwrap()), Vec3::splat(0.3), "{name}");
    }
    // P = π A L of 2 × 2 m; f32: 1e-6.
    let wheel = light(&scene, "it/wheel/paint");
    let expected = Vec3::new(1.0, 2.0, 3.0) * PI * 4.0;
    assert!((wheel.power / expected - 1.0).abs().max_element() < 1e-6, "{}", wheel.power);
    let id = scene.object("it/wheel/paint").unwrap();
    assert!((scene.emitted_radiance(id, Side::Front) - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-5);
    let told = "object \"it/wheel/paint\": emits from its front only";
    assert_eq!(scene.notices, [told]);
    // What emits from its back is turned, and one side reflects.
    assert_eq!(sides(&scene, "it/body/lit"), Sides::Front);
    assert_eq!(light(&scene, "it/body/lit").shape.emitter_normal(), Vec3::NEG_Z);
    assert_eq!(light(&Files::new(&squares()).scene(), "it/body/lit").shape.emitter_normal(), Vec3::Z);
    // Radiance 0 leaves a surface.
    let dark = parts("lit = { radiance_w_m2_sr = 0 }").unwrap();
    assert!(dark.light("it/body/lit").is_none() && dark.object("it/body/lit").is_some());
    // What the object says counts where its parts say nothing.
    let scene = Files::new(&squares())
        .build("sides = \"both\"", ", parts = { wheel = { sides = \"front\" } }")
        .unwrap();
    assert_eq!(
        [sides(&scene, "it/wheel/paint"), sides(&scene, "it/body/paint")],
        [Sides::Front, Sides::Both]
    );
}

#[test]
fn names_that_mean_nothing_or_two_things_are_explained() {
    for (text, expected) in [
        (
            "weel = { rename = \"x\" }",
            "parts: no node with a mesh, or material, of the file is called \"weel\", did you mean \"wheel\"?",
        ),
        ("pole = { sides = \"both\" }", "is called \"pole\"; expected one of: body, lit, paint, wheel"),
        (
            "paint = { rename = \"x\" }",
            "parts.paint.rename: found 2 objects called \"paint\": \"it/body/paint\", \"it/wheel/paint\", expected a part \
             that is one object",
        ),
        (
            "wheel = { rename = \"x\" }, lit = { rename = \"x\" }",
            "rename: found \"x\" for \"it/body/lit\" beside the object \"it/x\", which was \"it/wheel/paint\", expected",
        ),
        (
            "wheel = { rename = \"body\" }",
            "found \"body\" for \"it/wheel/paint\" beside the object \"it/body/lit\", expected",
        ),
        (
            "wheel = { rename = \"pole\" }",
            "found \"pole\" for \"it/wheel/paint\" beside the light \"it/pole\", expected",
        ),
        (
            "wheel = { rename = \"a/b\" }",
            "parts.wheel.rename: found \"a/b\", expected a name of at least one",
        ),
        (
            "wheel = { material = \"gray\" }",
            "parts.wheel.material: no material is called \"gray\", did you mean \"grey\"",
        ),
        ("wheel = { radiance_w_m2_sr = -1 }", "parts.wheel.radiance_w_m2_sr: found [-1, -1, -1]"),
        ("wheel = { colour = 1 }", "unknown key \"colour\""),
    ] {
        let error = parts(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\n{expected}");
    }
    let keys = |keys: &str| Files::new(&squares()).build("", keys).unwrap_err().to_string();
    let error = keys(", materials = { wheel = \"grey\" }, parts = { wheel = { material = \"grey\" } }");
    assert!(error.contains("found \"grey\", and \"grey\" in `materials`, expected one material"), "{error}");
    let error = keys(", exclude = [\"lit\"], parts = { lit = { rename = \"x\" } }");
    assert!(error.contains("found \"lit\", of which nothing is left"), "{error}");
}
