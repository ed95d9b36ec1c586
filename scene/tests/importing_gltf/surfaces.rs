//! Checks materials, textures, emitters and lights.

use super::files::*;
use glam::Vec3;
use photonstream_scene::{Scene, Side, Sides};
use photonstream_shading::LightShape;
use serde_json::{Value, json};
use std::f32::consts::PI;

/// 683 · 10 cd m⁻² in red are 10 W m⁻² sr⁻¹; two triangles of a square are one light.
#[test]
fn emissive_materials_are_area_lights() {
    let scene = scene(&[
        ("/materials/0/emissiveFactor", json!([1.0, 0.5, 0.0])),
        (
            "/materials/0/extensions",
            json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 6830.0 } }),
        ),
        ("/extensionsUsed", json!(["KHR_materials_emissive_strength"])),
    ]);
    let id = scene.object("it/square/paint").unwrap();
    assert!((scene.emitted_radiance(id, Side::Front) - Vec3::new(10.0, 5.0, 0.0)).length() < 1e-5);
    let light = light(&scene, "it/square/paint");
    assert!(matches!(light.shape, LightShape::Parallelogram { .. }), "{:?}", light.shape);
    assert!((light.shape.area() - 4.0).abs() < 1e-6);
    assert_eq!(light.shape.emitter_normal(), Vec3::Z);
    assert!((light.power - Vec3::new(40.0, 20.0, 0.0) * PI).length() < 1e-3);
}

/// Two meshes of a thousand emitting triangles: the brighter one keeps its lights.
/// Two fans of 1 000 triangles around one corner, no two of which make a parallelogram: a light each, of the whole area.
#[test]
fn an_object_of_many_faces_is_one_light() {
    let mut data = Vec::new();
    [0f32; 3].iter().for_each(|x| data.extend(x.to_le_bytes()));
    for i in 0..=1000 {
        let (s, c) = (i as f32 / 1000.0).sin_cos();
        [c, s, 0.0f32].iter().for_each(|x| data.extend(x.to_le_bytes()));
    }
    let primitive =
        |material: u32| json!({ "attributes": { "POSITION": 0 }, "mode": 6, "material": material });
    let scene = scene(&[
        ("/meshes/0/primitives", json!([primitive(0), primitive(1)])),
        (
            "/materials",
            json!([{ "name": "dim", "emissiveFactor": [0.1, 0.1, 0.1] }, { "name": "lit", "emissiveFactor": [1, 1, 1] }]),
        ),
        ("/accessors", json!([{ "bufferView": 0, "componentType": 5126, "count": 1002, "type": "VEC3" }])),
        ("/bufferViews", json!([{ "buffer": 0, "byteLength": data.len() }])),
        ("/buffers/0", json!({ "byteLength": data.len(), "uri": data_uri(&data) })),
    ]);
    assert_eq!(scene.lights.len(), 2);
    for (name, radiance) in [("it/square/dim", 0.1 / 683.0), ("it/square/lit", 1.0 / 683.0)] {
        let light = light(&scene, name);
        let LightShape::Mesh { mesh } = &light.shape else { panic!("{:?}", light.shape) };
        assert_eq!(mesh.triangles().len(), 1000);
        // A sector of 1 rad of the unit disc; its chords lose 1e-7 of it.
        assert!((mesh.area() - 0.5).abs() < 1e-6, "{}", mesh.area());
        assert!((light.emitted_radiance().x - radiance).abs() < 1e-6 * radiance);
        assert!((light.power.x - radiance * PI * 0.5).abs() < 1e-6 * radiance);
    }
    let mut edit = scene.edit();
    let values = toml::from_str("position_m = [0, 0, 5]\nscale = 2").unwrap();
    edit.move_object("it/square/lit", &values).unwrap();
    let moved = edit.finish();
    let LightShape::Mesh { mesh } = &light(&moved, "it/square/lit").shape else { panic!() };
    assert!(mesh.triangles().iter().flatten().all(|v| v.z == 5.0) && (mesh.area() - 2.0).abs() < 1e-5);
}

/// Of 1 100 nodes with an emitting square each, 1 024 shine.
#[test]
fn emitters_have_a_limit() {
    let nodes: Vec<Value> =
        (0..1100).map(|i| json!({ "name": format!("n{i}"), "mesh": 0, "scale": [1 + i, 1, 1] })).collect();
    let scene = scene(&[
        ("/scenes/0/nodes", json!((0..1100).collect::<Vec<_>>())),
        ("/nodes", json!(nodes)),
        ("/materials/0/emissiveFactor", json!([1, 1, 1])),
    ]);
    assert_eq!(scene.lights.len(), 1024);
    let dark = "object \"it/n0/paint\": what emits of it stays dark: an import has at most 1024 lights";
    assert!(scene.notices.iter().any(|n| n.starts_with(dark)), "{:?}", scene.notices);
}

#[test]
fn lights_come_in_watts_and_follow_their_node() {
    let light_of = |light: Value| {
        with(&[
            ("/extensionsUsed", json!(["KHR_lights_punctual"])),
            ("/extensions", json!({ "KHR_lights_punctual": { "lights": [light] } })),
            ("/scenes/0/nodes", json!([0, 1])),
            (
                "/nodes",
                json!([
                    { "name": "square", "mesh": 0 },
                    // Shines along −y: a quarter turn about x turns −z there.
                    {
                        "name": "lamp", "translation": [1, 2, 3], "rotation": [-0.70710677, 0, 0, 0.70710677],
                        "extensions": { "KHR_lights_punctual": { "light": 0 } },
                    },
                ]),
            ),
        ])
    };
    let close = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-5 * b.length().max(1.0), "{a} {b}");
    // 683 cd in all directions: 1 W sr⁻¹.
    let files =
        Files::new(&light_of(json!({ "type": "point", "color": [1, 0.5, 0], "intensity": 683, "range": 5 })));
    let scene = files.scene();
    close(light(&scene, "it/lamp").power, Vec3::new(1.0, 0.5, 0.0) * 4.0 * PI);
    assert!(
        matches!(light(&scene, "it/lamp").shape, LightShape::Point { position } if position == Vec3::new(1.0, 2.0, 3.0))
    );
    assert!(
        scene.notices.iter().any(|n| n.contains("ranges of lights are passed over")),
        "{:?}",
        scene.notices
    );
    // Where the object and the file's axes put it.
    let scene = files.build("scale = 2\nposition_m = [10, 0, 0]", ", up_axis = \"z\", unit_m = 0.5").unwrap();
    assert!(
        matches!(light(&scene, "it/lamp").shape, LightShape::Point { position } if position == Vec3::new(11.0, 3.0, -2.0))
    );
    // It is changed like any other.
    let mut edit = scene.edit();
    edit.set_light("it/lamp", &[("power_w".to_owned(), json!(3))].into_iter().collect()).unwrap();
    close(light(&edit.finish(), "it/lamp").power, Vec3::splat(3.0));

    let scene = Files::new(&light_of(json!({ "type": "directional", "intensity": 1366 }))).scene();
    close(light(&scene, "it/lamp").power, Vec3::splat(2.0));
    assert!(
        matches!(light(&scene, "it/lamp").shape, LightShape::Directional { direction } if (direction + Vec3::Y).length() < 1e-6)
    );

    // 683 cd on the axis: the irradiance 1 m below is 1 W m⁻².
    let spot =
        json!({ "type": "spot", "intensity": 683, "spot": { "innerConeAngle": 0.3, "outerConeAngle": 0.6 } });
    let scene = Files::new(&light_of(spot)).scene();
    let lamp = light(&scene, "it/lamp");
    let below = lamp.shape.illuminate(Vec3::new(1.0, 1.0, 3.0), [0.5; 2]).unwrap();
    close(lamp.power * below.irradiance, Vec3::ONE);
    let error = Files::new(&light_of(
        json!({ "type": "spot", "spot": { "innerConeAngle": 1.0, "outerConeAngle": 0.5 } }),
    ))
    .error();
    assert!(
        error.contains("node \"lamp\": its light has angles other than 0 ≤ inner < outer ≤ π/2"),
        "{error}"
    );
}

/// Strengths of the scene file in the place of the file's, and one light less.
#[test]
fn lights_are_changed_and_left_out_by_node() {
    let lamp = |light: u32| json!({ "KHR_lights_punctual": { "light": light } });
    let files = Files::new(&with(&[
        ("/extensionsUsed", json!(["KHR_lights_punctual"])),
        (
            "/extensions",
            json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }, { "type": "directional" }] } }),
        ),
        ("/scenes/0/nodes", json!([0, 1, 2])),
        (
            "/nodes",
            json!([
                { "name": "square", "mesh": 0, "extensions": lamp(0) },
                { "name": "sun", "extensions": lamp(1) },
                { "name": "bulb", "extensions": lamp(0) },
            ]),
        ),
    ]));
    let lights = |keys: &str| files.build("", &format!(", lights = {{ {keys} }}"));
    let scene = lights(
        "square = { exclude = true }, sun = { irradiance_w_m2 = 3 }, bulb = { power_w = [1, 2, 3], exclude = false }",
    )
    .unwrap();
    assert_eq!(names(&scene), ["it/square/paint"]);
    assert_eq!(scene.lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["it/bulb", "it/sun"]);
    assert_eq!(light(&scene, "it/sun").power, Vec3::splat(3.0));
    assert_eq!(light(&scene, "it/bulb").power, Vec3::new(1.0, 2.0, 3.0));
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.lights), (scene.hash, &scene.lights));
    for (keys, expected) in [
        (
            "blub = { power_w = 1 }",
            "lights.blub: no node with a light is called \"blub\", did you mean \"bulb\"?",
        ),
        ("sun = { power_w = 1 }", "lights.sun.power_w: found power_w, expected irradiance_w_m2"),
        ("bulb = { power_w = -1 }", "lights.bulb.power_w: found [-1, -1, -1]"),
        ("bulb = { watts = 1 }", "unknown key \"watts\""),
    ] {
        let error = lights(keys).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\n{expected}");
    }
}

#[test]
fn double_sided_materials_reflect_on_both_sides_unless_told_otherwise() {
    let files = Files::new(&with(&[("/materials/0/doubleSided", json!(true))]));
    let scene = files.scene();
    assert_eq!(scene.objects[0].sides, Sides::Both);
    // The resolved text leaves the choice to the file.
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.objects[0].sides, again.hash), (Sides::Both, scene.hash));
    assert_eq!(files.build("sides = \"back\"", "").unwrap().objects[0].sides, Sides::Back);
    assert_eq!(super::files::scene(&[]).objects[0].sides, Sides::Front);
}

#[test]
fn what_is_passed_over_is_told_once() {
    let scene = scene(&[
        ("/extensionsUsed", json!(["KHR_materials_clearcoat", "KHR_lights_punctual"])),
        ("/materials/0/alphaMode", json!("BLEND")),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", json!(1.0)),
        ("/meshes/0/primitives/0/targets", json!([{ "POSITION": 0 }])),
        // A body without size beside one with.
        (
            "/nodes",
            json!([{ "name": "square", "mesh": 0, "children": [1] }, { "name": "dot", "mesh": 0, "scale": [0, 0, 0] }]),
        ),
    ]);
    for expected in [
        "object \"it\": extensions are passed over: KHR_materials_clearcoat",
        "object \"it\": morph targets are not read",
        "object \"it\": material \"paint\": what is blended is opaque; `transmit` lets light pass where it is clear",
        "object \"it\": all surfaces are matt: metal, roughness and normal maps are passed over",
        "object \"it/dot/paint\": no triangle has an area; it was left out",
    ] {
        assert_eq!(
            scene.notices.iter().filter(|n| *n == expected).count(),
            1,
            "{expected}: {:?}",
            scene.notices
        );
    }
    assert_eq!(scene.notices.len(), 5);
    assert_eq!(names(&scene), ["it/square/paint"]);
}
