//! Checks the colours of vertices.

use super::files::*;
use glam::Vec3;
use photonstream_scene::{Detail, Scene};
use serde_json::{Value, json};

/// The square with colours: four floats of each of its five vertices.
fn coloured(colours: [[f32; 4]; 5], changes: &[(&str, Value)]) -> Value {
    let mut all = vec![("/meshes/0/primitives/0/attributes/COLOR_0", json!(2))];
    all.extend_from_slice(changes);
    let mut file = with(&all);
    let data: Vec<u8> =
        bytes().into_iter().chain(colours.iter().flatten().flat_map(|x| x.to_le_bytes())).collect();
    file["buffers"][0] = json!({ "byteLength": data.len(), "uri": data_uri(&data) });
    file["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "buffer": 0, "byteOffset": 72, "byteLength": 80 }));
    file["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 2, "componentType": 5126, "count": 5, "type": "VEC4" }));
    file
}

/// What each triangle of the scene reflects, however closely it is looked at.
fn reflectances(scene: &Scene) -> Vec<Vec3> {
    (0..scene.geometry.triangles.len() as u32)
        .map(|triangle| {
            let seen = [Detail::Finest, Detail::Transport, Detail::Width(0.3)];
            let found = seen.map(|detail| scene.albedo_at(triangle, [0.2, 0.7], detail));
            assert!(found.iter().all(|c| c.distance(found[0]) < 1e-6), "{found:?}");
            found[0]
        })
        .collect()
}

/// Triangles 0 1 2 and 0 2 3: the means of their corners times the factor. 16 bits of a texel: 1e-5.
#[test]
fn triangles_have_the_mean_colour_of_their_corners() {
    let colours =
        [[0.0, 0.0, 0.0, 1.0], [0.3, 0.0, 0.6, 1.0], [0.6, 0.9, 0.0, 0.0], [0.0, 0.0, 3.0, 1.0], [1.0; 4]];
    let files = Files::new(&coloured(colours, &[]));
    let scene = files.scene();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    // Beyond 1 is 1.
    let factor = Vec3::new(0.5, 0.25, 0.125);
    let expected = [Vec3::new(0.3, 0.3, 0.2) * factor, Vec3::new(0.2, 0.3, 1.0 / 3.0) * factor];
    for (found, expected) in reflectances(&scene).into_iter().zip(expected) {
        assert!(found.distance(expected) < 2e-5, "{found} {expected}");
    }
    let same = Files::new(&with(&[])).scene();
    assert_eq!(corners(&scene, "it/square/paint"), corners(&same, "it/square/paint"));
    // Replaced, nothing is left of them.
    let replaced = files.build("material = \"grey\"", "").unwrap();
    assert!(reflectances(&replaced).iter().all(|c| *c == Vec3::splat(0.3)));
    // Without a material they are the colour.
    let mut bare = coloured(colours, &[]);
    bare["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let bare = Files::new(&bare).scene();
    assert!(reflectances(&bare)[0].distance(Vec3::new(0.3, 0.3, 0.2)) < 2e-5);
}

/// One colour needs no picture; primitives of the same material without colours are white there.
#[test]
fn one_colour_is_a_factor() {
    let file = coloured([[0.5, 0.5, 1.0, 1.0]; 5], &[]);
    let scene = Files::new(&file).scene();
    assert!(scene.geometry.uvs.is_empty() && scene.materials.iter().all(|m| m.texture.is_none()));
    assert_eq!(reflectances(&scene), [Vec3::new(0.25, 0.125, 0.125); 2]);
    let mut both = file;
    let plain = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 });
    both["meshes"][0]["primitives"].as_array_mut().unwrap().push(plain);
    let found = reflectances(&Files::new(&both).scene());
    assert!(found[0].distance(Vec3::new(0.25, 0.125, 0.125)) < 2e-5, "{found:?}");
    assert!(found[2].distance(Vec3::new(0.5, 0.25, 0.125)) < 2e-5, "{found:?}");
}

#[test]
fn bad_colours_are_explained() {
    let error = |file: &Value, expected: &str| {
        let error = Files::new(file).error();
        assert!(error.contains(expected), "{error}");
    };
    let nan = coloured([[f32::NAN; 4]; 5], &[]);
    error(&nan, "node \"square\", primitive 0: a colour is not finite");
    let mut few = coloured([[1.0; 4]; 5], &[]);
    few["accessors"][2]["count"] = json!(2);
    error(&few, "node \"square\", primitive 0: 2 colours, but there is a vertex 2");
    let wrong = coloured([[1.0; 4]; 5], &[("/meshes/0/primitives/0/attributes/COLOR_0", json!(1))]);
    error(&wrong, "primitive 0: accessor 1: found Scalar, expected Vec3");
}
