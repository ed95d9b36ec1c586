//! Checks that bad and hostile files are refused with a reason, and never panic.

use super::files::*;
use proptest::prelude::*;
use serde_json::{Value, json};

#[test]
fn bad_files_are_explained() {
    let error = |changes: &[(&str, Value)], expected: &str| {
        let error = Files::new(&with(changes)).error();
        let place = "x.toml:6:17: object.it.gltf.path: asset ";
        assert!(error.starts_with(place) && error.contains(expected), "{error}\n{expected}");
    };
    error(&[("/asset/version", json!("1.0"))], "found a file of glTF \"1.0\", expected 2.0");
    error(
        &[("/extensionsRequired", json!(["KHR_draco_mesh_compression"]))],
        "needs the extension \"KHR_draco_mesh_compression\"",
    );
    let position = "/meshes/0/primitives/0/attributes/POSITION";
    error(&[(position, json!(7))], "meshes[0].primitives[0] has an attribute of accessor 7, of 2");
    error(&[("/nodes/0/mesh", json!(7))], "nodes[0].mesh names something that is not there");
    error(&[("/nodes/0/children", json!([0]))], "node \"square\" is reached twice");
    error(&[("/scenes/0/nodes", json!([0, 0]))], "node \"square\" is reached twice");
    error(&[("/nodes/0/translation", json!([1e39, 0, 0]))], "node \"square\": its matrix is not finite");
    error(
        &[("/accessors/1/count", json!(4_000_000_000u64))],
        "node \"square\", primitive 0: accessor 1: 4000000000 elements end beyond",
    );
    error(&[("/accessors/0/count", json!(u64::MAX))], "elements end beyond buffer view 0");
    error(
        &[("/accessors/0/count", json!(3))],
        "primitive 0: it names vertex 3, but there are 3, counted from 0",
    );
    error(&[("/accessors/0/type", json!("VEC2"))], "accessor 0: found Vec2, expected Vec3");
    error(
        &[("/accessors/1/componentType", json!(5126)), ("/accessors/1/count", json!(3))],
        "its indices are not whole numbers",
    );
    error(
        &[(
            "/accessors/1",
            json!({ "componentType": 5123, "count": 1_000_000_000, "type": "SCALAR", "sparse": {
            "count": 1, "indices": { "bufferView": 1, "componentType": 5121 }, "values": { "bufferView": 1 } } }),
        )],
        "1000000000 elements without data, expected at most 1048576",
    );
    error(&[("/bufferViews/0/byteLength", json!(73))], "buffer view 0 ends beyond its buffer");
    error(&[("/bufferViews/0/byteOffset", json!(u64::MAX))], "buffer view 0 ends beyond its buffer");
    error(
        &[("/buffers/0/byteLength", json!(1_000_000_000))],
        "buffer 0: found 72 bytes, expected 1000000000",
    );
    error(
        &[("/buffers/0/uri", json!("../secret.bin"))],
        "buffer 0: \"../secret.bin\" leads out of the folder",
    );
    error(&[("/buffers/0/uri", json!("%2e%2e/secret.bin"))], "leads out of the folder");
    error(&[("/buffers/0/uri", json!("/etc/hostname"))], "leads out of the folder");
    error(&[("/buffers/0/uri", json!("https://example.org/a.bin"))], "found a URI of scheme \"https\"");
    error(&[("/buffers/0/uri", json!("none.bin"))], "none.bin cannot be read (");
    error(&[("/buffers/0/uri", json!("data:;base64,%%%"))], "its data URI is not base64");
    error(
        &[("/buffers/0", json!({ "byteLength": 72 }))],
        "buffer 0: it has no uri, and the file no binary chunk",
    );
    error(
        &[("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([-1, 0, 0, 1]))],
        "material \"paint\": found baseColorFactor [-1, 0, 0]",
    );
    error(&[("/nodes", json!([{ "name": "square" }]))], "no faces are left of it");

    let mut data = bytes();
    data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let uri = ("/buffers/0/uri", json!(data_uri(&data)));
    error(&[uri], "node \"square\", primitive 0: a position is not finite: [NaN, NaN, NaN]");

    let whole = glb(&with(&[("/buffers/0", json!({ "byteLength": 72 }))]), &bytes());
    for length in 0..whole.len() {
        assert!(Files::of_bytes(&whole[..length]).build("", "").is_err(), "{length} bytes");
    }
    let mut short = whole.clone();
    short[8..12].copy_from_slice(&3u32.to_le_bytes());
    assert!(Files::of_bytes(&short).error().contains("its header is cut off"));
    // 100 000 nodes, each the child of the one before.
    let nodes: Vec<_> = (0..100_000)
        .map(|i| if i < 99_999 { json!({ "children": [i + 1] }) } else { json!({ "mesh": 0 }) })
        .collect();
    let deep = scene(&[("/nodes", json!(nodes))]);
    assert_eq!(names(&deep), ["it/node99999/paint"]);
}

/// A mesh of 2²⁰ triangles that a hundred nodes show is refused before it is there a hundred times.
#[test]
fn instances_count_as_triangles() {
    let n = 1u32 << 20;
    let mut data = bytes();
    data.truncate(60);
    // All corners are one, so that the test needs no memory: they count nevertheless.
    data.resize(60 + 3 * n as usize, 0);
    let nodes: Vec<_> = (0..100).map(|_| json!({ "mesh": 0 })).collect();
    let files = Files::new(&with(&[
        ("/scenes/0/nodes", json!((0..100).collect::<Vec<_>>())),
        ("/nodes", json!(nodes)),
        ("/accessors/1", json!({ "bufferView": 1, "componentType": 5121, "count": 3 * n, "type": "SCALAR" })),
        ("/bufferViews/1/byteLength", json!(3 * n)),
        ("/buffers/0", json!({ "byteLength": data.len(), "uri": data_uri(&data) })),
    ]));
    assert!(
        files.error().contains("node \"node32\", primitive 0: the file has more than 33554432 triangles")
    );
}

proptest! {
    // 256 cases, seed 1, so that a run repeats; PROPTEST_CASES asks for more.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    /// Bytes anywhere, and numbers of the JSON, which bytes alone seldom change into other valid ones.
    #[test]
    fn damaged_files_never_panic(
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..5),
        numbers in proptest::collection::vec((any::<prop::sample::Index>(), prop_oneof![
            Just(-1i64), 0i64..8, Just(255), Just(5120), Just(5121), Just(5125), Just(1 << 31), Just(i64::MAX)
        ]), 0..4),
        cut in proptest::option::of(any::<prop::sample::Index>()),
    ) {
        let mut file = with(&[
            ("/buffers/0", json!({ "byteLength": 72 })),
            ("/accessors/0/byteOffset", json!(0)),
            ("/accessors/0/sparse", json!({
                "count": 1,
                "indices": { "bufferView": 1, "byteOffset": 2, "componentType": 5123 },
                "values": { "bufferView": 0, "byteOffset": 12 },
            })),
            ("/nodes/0/children", json!([])),
            ("/nodes/0/extensions", json!({ "KHR_lights_punctual": { "light": 0 } })),
            ("/extensions", json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": { "outerConeAngle": 1 } }] } })),
            ("/bufferViews/0/byteStride", json!(12)),
            ("/bufferViews/0/byteOffset", json!(0)),
            ("/meshes/0/primitives/0/mode", json!(4)),
            ("/materials/0/emissiveFactor", json!([1, 1, 1])),
            ("/animations", json!([{
                "channels": [
                    { "sampler": 0, "target": { "node": 0, "path": "translation" } },
                    { "sampler": 0, "target": { "node": 0, "path": "scale" } },
                ],
                "samplers": [{ "input": 2, "output": 3 }],
            }])),
        ]);
        // Times 0 and 1 are numbers of the positions, too.
        file["accessors"].as_array_mut().unwrap().extend([
            json!({ "bufferView": 0, "byteOffset": 8, "componentType": 5126, "count": 2, "type": "SCALAR" }),
            json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" }),
        ]);
        for (at, with) in numbers {
            let mut places = Vec::new();
            numbers_of(&file, String::new(), &mut places);
            let place: &String = at.get(&places);
            *file.pointer_mut(place).unwrap() = json!(with);
        }
        let mut bytes = glb(&file, &bytes());
        for (at, with) in edits {
            let at = at.index(bytes.len());
            bytes[at] = with;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(scene) = Files::of_bytes(&bytes).build("", "") {
            // Out of range later on is an error, too.
            _ = scene.animation.apply(0.5, &mut scene.edit());
        }
    }
}

fn numbers_of(value: &Value, at: String, places: &mut Vec<String>) {
    match value {
        Value::Number(_) => places.push(at),
        Value::Array(all) => {
            all.iter().enumerate().for_each(|(i, v)| numbers_of(v, format!("{at}/{i}"), places))
        }
        Value::Object(all) => all.iter().for_each(|(key, v)| numbers_of(v, format!("{at}/{key}"), places)),
        _ => {}
    }
}
