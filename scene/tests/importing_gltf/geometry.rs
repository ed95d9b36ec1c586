//! Checks nodes, accessors and primitives.

use super::files::*;
use glam::Vec3;
use photonstream_scene::Scene;
use serde_json::json;
use std::fs;

#[test]
fn a_node_and_a_material_make_an_object() {
    let scene = scene(&[]);
    assert_eq!(names(&scene), ["it/square/paint"]);
    let object = scene.object("it/square/paint").unwrap();
    assert_eq!(scene.albedo(object), Vec3::new(0.5, 0.25, 0.125));
    let expected: Vec<_> = INDICES.iter().map(|&i| Vec3::from_array(CORNERS[i as usize])).collect();
    assert_eq!(corners(&scene, "it/square/paint"), expected);
    // The fifth corner is no part of it.
    assert_eq!(scene.geometry.vertices.len(), 4);
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let again = Scene::from_resolved(&scene.resolved_text).map_err(|e| e.to_string());
    // Its folder is gone with the test's files.
    assert!(again.unwrap_err().contains("found no file"));
}

#[test]
fn binary_files_and_files_beside_are_the_same() {
    let inline = scene(&[]);
    let beside = Files::new(&with(&[("/buffers/0/uri", json!("sub/the%20square.bin"))]));
    fs::create_dir(beside.0.path().join("sub")).unwrap();
    fs::write(beside.0.path().join("sub/the square.bin"), bytes()).unwrap();
    let of_two = beside.scene();
    assert_eq!(of_two.geometry, inline.geometry);
    assert!(of_two.files.iter().any(|f| f.ends_with("sub/the square.bin")));
    // What lies beside is part of the hash.
    let mut other = bytes();
    other[0] ^= 1;
    fs::write(beside.0.path().join("sub/the square.bin"), other).unwrap();
    assert_ne!(beside.scene().hash, of_two.hash);
    let glb = Files::of_bytes(&glb(&with(&[("/buffers/0", json!({ "byteLength": 72 }))]), &bytes()));
    let of_glb = glb.scene();
    assert_eq!(of_glb.geometry, inline.geometry);
    let again = Scene::from_resolved(&of_glb.resolved_text).unwrap();
    assert_eq!(
        (again.hash, &again.geometry, &again.objects),
        (of_glb.hash, &of_glb.geometry, &of_glb.objects)
    );
}

/// A parent that turns and moves, two children that show the same mesh, one mirrored, one given by a matrix.
#[test]
fn nodes_place_meshes_and_several_show_one() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let scene = scene(&[
        ("/scenes/0/nodes", json!([2])),
        (
            "/nodes",
            json!([
                { "name": "left", "mesh": 0, "scale": [-1, 1, 1], "translation": [3, 0, 0] },
                { "name": "right", "mesh": 0, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 5, 1] },
                // A quarter turn about y: z becomes x, x becomes −z.
                { "name": "parent", "children": [0, 1], "rotation": [0, half, 0, half], "translation": [0, 10, 0] },
                { "name": "elsewhere", "mesh": 0 },
            ]),
        ),
    ]);
    assert_eq!(names(&scene), ["it/left/paint", "it/right/paint"]);
    let close = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-5, "{a} {b}");
    // (−1, −1, 0) → (1 + 3, −1, 0) → (0, −1 + 10, −4).
    close(corners(&scene, "it/left/paint")[0], Vec3::new(0.0, 9.0, -4.0));
    close(corners(&scene, "it/right/paint")[0], Vec3::new(5.0, 8.0, 2.0));
    // The mirrored one looks the same way: its winding is turned.
    for normal in &scene.geometry.normals {
        close(*normal, Vec3::X);
    }
}

#[test]
fn nodes_and_materials_are_left_out_by_name() {
    let file = with(&[
        ("/scenes/0/nodes", json!([0, 1, 3])),
        (
            "/nodes",
            json!([
                { "name": "square", "mesh": 0 },
                { "name": "house", "children": [2] },
                { "name": "roof", "mesh": 0 },
                { "name": "square", "mesh": 0 },
            ]),
        ),
    ]);
    let files = Files::new(&file);
    assert_eq!(names(&files.scene()), ["it/roof/paint", "it/square.3/paint", "it/square/paint"]);
    let without = |names_: &str| files.build("", &format!(", exclude = [{names_}]"));
    assert_eq!(names(&without("\"house\"").unwrap()), ["it/square.3/paint", "it/square/paint"]);
    assert_eq!(names(&without("\"square\", \"square.3/paint\"").unwrap()), ["it/roof/paint"]);
    let error = without("\"hause\"").unwrap_err().to_string();
    let expected = "exclude: no node or material of the file is called \"hause\", did you mean \"house\"?";
    assert!(error.ends_with(expected), "{error}");
    let error = without("\"paint\"").unwrap_err().to_string();
    assert!(error.contains("no faces are left of it"), "{error}");
}

#[test]
fn strips_fans_and_unindexed_triangles() {
    let primitive = "/meshes/0/primitives/0";
    let square = |mode: u32, order: [u16; 4]| {
        let mut data = bytes();
        data.truncate(60);
        order.iter().for_each(|i| data.extend(i.to_le_bytes()));
        let scene = scene(&[
            (&format!("{primitive}/mode"), json!(mode)),
            ("/accessors/1/count", json!(4)),
            ("/bufferViews/1/byteLength", json!(8)),
            ("/buffers/0", json!({ "byteLength": 68, "uri": data_uri(&data) })),
        ]);
        let area: f64 =
            (0..2).map(|id| photonstream_shading::surface::area(scene.geometry.triangle(id))).sum();
        assert_eq!((scene.geometry.triangles.len(), area), (2, 4.0), "mode {mode}");
        assert!(scene.geometry.normals.iter().all(|n| *n == Vec3::Z), "mode {mode}");
    };
    square(5, [0, 1, 3, 2]);
    square(6, [0, 1, 2, 3]);
    let mut file = with(&[("/accessors/0/count", json!(3))]);
    file.pointer_mut(primitive).unwrap().as_object_mut().unwrap().remove("indices");
    assert_eq!(Files::new(&file).scene().geometry.triangles.len(), 1);
    let lines = Files::new(&with(&[(
        "/meshes/0/primitives",
        json!([{ "attributes": { "POSITION": 0 }, "mode": 1 }, { "attributes": { "POSITION": 0 }, "indices": 1 }]),
    )]));
    let scene = lines.scene();
    assert_eq!(names(&scene), ["it/square/none"]);
    assert!(scene.notices.iter().any(|n| n.ends_with("1 primitives of points or lines are passed over")));
}

/// Positions in normalised i16 with a stride of 8 bytes, one of them given apart.
#[test]
fn accessors_are_strided_quantised_and_sparse() {
    let mut data = Vec::new();
    for corner in &CORNERS[..4] {
        corner.iter().for_each(|x| data.extend(((x * 32767.0) as i16).to_le_bytes()));
        data.extend([0xff; 2]);
    }
    INDICES.iter().for_each(|i| data.extend(i.to_le_bytes()));
    // Corner 1 is at (1, −1, 1) instead.
    data.extend([1, 0]);
    [32767i16, -32768, 32767].iter().for_each(|x| data.extend(x.to_le_bytes()));
    let scene = scene(&[
        ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
        (
            "/accessors/0",
            json!({
                "bufferView": 0, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3",
                "sparse": {
                    "count": 1,
                    "indices": { "bufferView": 2, "componentType": 5121 },
                    "values": { "bufferView": 2, "byteOffset": 2 },
                },
            }),
        ),
        (
            "/bufferViews",
            json!([
                { "buffer": 0, "byteLength": 32, "byteStride": 8 },
                { "buffer": 0, "byteOffset": 32, "byteLength": 12 },
                { "buffer": 0, "byteOffset": 44, "byteLength": 8 },
            ]),
        ),
        ("/buffers/0", json!({ "byteLength": data.len(), "uri": data_uri(&data) })),
    ]);
    let corners = corners(&scene, "it/square/paint");
    assert_eq!(corners[0], Vec3::new(-1.0, -1.0, 0.0));
    assert_eq!(corners[1], Vec3::new(1.0, -1.0, 1.0));
    assert_eq!(corners[5], Vec3::new(-1.0, 1.0, 0.0));
}

/// Normals in normalised i8, three bytes in four, on a node that mirrors and stretches: they lead out as the winding does, and
/// stretch inversely. To 0.5/127 of rounding in the file, and a few roundings of f32.
#[test]
fn normals_are_quantised_and_follow_their_node() {
    let mut data = bytes();
    data.truncate(72);
    let normals = [[64i8, 0, 110], [0, 0, 127], [0, 64, 110], [0, 0, -127], [0, 0, 127]];
    normals.iter().for_each(|n| data.extend(n.map(|x| x as u8).into_iter().chain([0])));
    let scene = scene(&[
        ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
        ("/nodes/0/scale", json!([-2, 1, 1])),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(2)),
        (
            "/accessors",
            json!([
                { "bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3" },
                { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
                { "bufferView": 2, "componentType": 5120, "normalized": true, "count": 5, "type": "VEC3" },
            ]),
        ),
        (
            "/bufferViews",
            json!([
                { "buffer": 0, "byteLength": 60 },
                { "buffer": 0, "byteOffset": 60, "byteLength": 12 },
                { "buffer": 0, "byteOffset": 72, "byteLength": 20, "byteStride": 4 },
            ]),
        ),
        ("/buffers/0", json!({ "byteLength": 92, "uri": data_uri(&data) })),
    ]);
    let expected = |place: Vec3| match (place.x > 0.0, place.y > 0.0) {
        (true, false) => Vec3::new(-64.0 / 2.0, 0.0, 110.0),
        (false, false) => Vec3::Z,
        (false, true) => Vec3::new(0.0, 64.0, 110.0),
        // Against its face: counted for the corner, and the triangle is flat where it outweighs the others.
        (true, true) => Vec3::NEG_Z,
    };
    for t in 0..2 {
        assert_eq!(scene.geometry.normals[t as usize], Vec3::Z);
        for (place, found) in scene.geometry.triangle(t).into_iter().zip(scene.corner_normals(t).unwrap()) {
            assert!((found - expected(place).normalize()).length() < 1e-6, "{place}: {found}");
            assert!(found.is_normalized());
        }
    }
    let error = Files::new(&with(&[("/meshes/0/primitives/0/attributes/NORMAL", json!(1))])).error();
    assert!(error.contains("found Scalar, expected Vec3"), "{error}");
}
