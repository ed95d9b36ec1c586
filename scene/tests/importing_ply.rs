//! Checks meshes of PLY files, and the units and axes of imports.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError};
use proptest::prelude::*;
use std::{fs, path::Path};

const HEADER: &str = "element vertex 5\nproperty float x\nproperty double y\nproperty short z\nproperty uchar red\n\
    element face 2\nproperty uchar flags\nproperty list uchar uint vertex_indices\nelement edge 1\n\
    property list int float weights\nproperty int a\nend_header\n";
const POSITIONS: [(f32, f64, i16); 5] =
    [(0.0, 0.0, 0), (2.0, 0.0, 0), (2.0, 0.0, 1), (0.0, 0.0, 1), (0.25, 0.5, 7)];
const FACES: [&[u32]; 2] = [&[0, 1, 2, 3], &[0, 1, 4]];

fn text() -> Vec<u8> {
    let mut out = format!("ply\nformat ascii 1.0\ncomment a quad and a triangle\n{HEADER}");
    POSITIONS.iter().for_each(|(x, y, z)| out += &format!("{x} {y} {z} 200\n"));
    for face in FACES {
        let corners: Vec<_> = face.iter().map(u32::to_string).collect();
        out += &format!("1 {} {}\n", face.len(), corners.join(" "));
    }
    out += "2 0.5 1e-3 -7\n";
    out.into_bytes()
}

/// The same in binary; `bytes` orders those of a number.
fn binary(format: &str, bytes: fn(&mut [u8])) -> Vec<u8> {
    let mut out = format!("ply\nformat {format} 1.0\n{HEADER}").into_bytes();
    let mut push = |mut number: Vec<u8>| {
        bytes(&mut number);
        out.extend(number);
    };
    for (x, y, z) in POSITIONS {
        push(x.to_le_bytes().into());
        push(y.to_le_bytes().into());
        push(z.to_le_bytes().into());
        push(vec![200]);
    }
    for face in FACES {
        push(vec![1]);
        push(vec![face.len() as u8]);
        face.iter().for_each(|i| push(i.to_le_bytes().into()));
    }
    push(2i32.to_le_bytes().into());
    [0.5f32, 1e-3].iter().for_each(|w| push(w.to_le_bytes().into()));
    push((-7i32).to_le_bytes().into());
    out
}

fn build_with(ply: &[u8], object: &str, keys: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.ply"), ply).unwrap();
    let text = format!(
        "origin_m = [0, 0, 0]\ncamera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
         material.grey.albedo = 0.3\n[object.it]\n{object}\nply = {{ path = \"a.ply\" {keys} }}\n"
    );
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    SceneConfig::from_text(&text, Path::new("x.toml"))?.build_with(&roots)
}

fn build(ply: &[u8]) -> Result<Scene, SceneError> {
    build_with(ply, "material = \"grey\"", "")
}

#[test]
fn text_and_binary_of_both_byte_orders_are_the_same_mesh() {
    let scene = build(&text()).unwrap();
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["it"]);
    assert_eq!(scene.geometry.vertices[4], Vec3::new(0.25, 0.5, 7.0));
    // A quadrilateral is cut in two.
    assert_eq!(*scene.geometry.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
    assert!(scene.notices.is_empty());
    let little = build(&binary("binary_little_endian", |_| {})).unwrap();
    let big = build(&binary("binary_big_endian", |bytes| bytes.reverse())).unwrap();
    assert_eq!((&little.geometry, &big.geometry), (&scene.geometry, &scene.geometry));
    // The hash is of the bytes.
    assert!(scene.hash != little.hash && little.hash != big.hash);
}

/// A strip of three triangles and, after a restart, one of a single one; in text and in binary.
#[test]
fn strips_are_triangles() {
    let header = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let points = [[0, 0], [1, 0], [0, 1], [1, 1], [0, 2]];
    let strip = [0i32, 1, 2, 3, 4, -1, 0, 3, 4];
    let mut text = format!("ply\nformat ascii 1.0\n{header}");
    points.iter().for_each(|[x, y]| text += &format!("{x} {y} 0\n"));
    let words: Vec<_> = strip.iter().map(i32::to_string).collect();
    text += &format!("9 {}\n", words.join(" "));
    let mut binary = format!("ply\nformat binary_big_endian 1.0\n{header}").into_bytes();
    for [x, y] in points {
        [x, y, 0].iter().for_each(|n| binary.extend((*n as f32).to_be_bytes()));
    }
    [9].iter().chain(&strip).for_each(|n| binary.extend(n.to_be_bytes()));
    for bytes in [text.as_bytes(), &binary] {
        let scene = build(bytes).unwrap();
        assert_eq!(*scene.geometry.triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [0, 3, 4]]);
        // All look the same way.
        assert!(scene.geometry.normals.iter().all(|n| *n == Vec3::Z));
    }
    let error = build(text.replace("-1 0 3 4", "-1 0 3 5").as_bytes()).unwrap_err().to_string();
    assert!(error.contains("face 3 names vertex 5, but there are 5"), "{error}");
    let error = build(text.replace("-1 0 3 4", "-1 0 3 -4").as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("element \"tristrips\" 0 of 1: found corner -4, expected a number from 0"),
        "{error}"
    );
}

#[test]
fn axes_and_units_are_those_of_the_scene() {
    for (keys, at) in [
        (", up_axis = \"y\"", Vec3::new(0.25, 0.5, 7.0)),
        (", up_axis = \"z\"", Vec3::new(0.25, 7.0, -0.5)),
        (", up_axis = \"z\", unit_m = 0.01", Vec3::new(0.0025, 0.07, -0.005)),
    ] {
        let scene = build_with(&text(), "material = \"grey\"", keys).unwrap();
        // One rounding to f32.
        assert!((scene.geometry.vertices[4] - at).length() < 1e-6, "{keys}: {}", scene.geometry.vertices[4]);
        // Turned, not mirrored: the quad of +x, +z, whose front looks along −y, or −(−z) = +z there.
        let normal = if keys.contains('z') { Vec3::Z } else { Vec3::NEG_Y };
        assert_eq!(scene.geometry.normals[0], normal, "{keys}");
    }
    // Then the object's own scale and place.
    let object = "material = \"grey\"\nscale = 2\nposition_m = [1, 0, 0]";
    let scene = build_with(&text(), object, ", unit_m = 0.5").unwrap();
    assert_eq!(scene.geometry.vertices[4], Vec3::new(1.25, 0.5, 7.0));
    for (keys, expected) in [
        (", unit_m = 0", "object.it.ply.unit_m: found 0, expected a length in (0, 1e9] m"),
        (", up_axis = \"x\"", "unknown axis \"x\"; expected one of: y, z"),
        (", exclude = []", "unknown key \"exclude\""),
    ] {
        let error = build_with(&text(), "material = \"grey\"", keys).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let error = build_with(&text(), "", "").unwrap_err().to_string();
    assert!(error.contains("object.it: the key \"material\" is missing"), "{error}");
}

#[test]
fn bad_files_are_explained() {
    let text = String::from_utf8(text()).unwrap();
    for (bytes, expected) in [
        (text.replace("ply\n", "plyx\n"), "a.ply: not a valid PLY file: "),
        (text.replace("element vertex", "element point"), "it has no element \"vertex\""),
        (text.replace("property double y\n", ""), "element \"vertex\" has no number \"y\""),
        (
            text.replace("vertex_indices", "corners"),
            "it has no element \"face\" or \"tristrips\" with a list \"vertex_indices\"",
        ),
        (text.replace("1 3 0 1 4", "1 3 0 1 5"), "face 1 names vertex 5, but there are 5, counted from 0"),
        (text.replace("1 3 0 1 4", "1 3 0 1 -4"), "element \"face\" 1 of 2: "),
        (
            text.replace("1 3 0 1 4", "1 2 0 1").replace("1 4 0 1 2 3", "1 0"),
            "it has no face of three corners",
        ),
        (text.replace("2 0 0 200", "2 0 nan 200"), "element \"vertex\" 1 of 5: "),
        (text.replace("2 0.5 1e-3 -7\n", ""), "element \"edge\" 0 of 1: the file ends"),
        (
            text.replace("element vertex 5", "element vertex 1000000000"),
            "it promises 1000000000 of element \"vertex\", which take at least 8000000000 bytes",
        ),
        (
            text.replace("element edge 1", "element edge 18446744073709551615"),
            "it promises 18446744073709551615 of",
        ),
        (
            text.replace("element edge 1", "element none 1000000000\nelement edge 1"),
            "element \"none\" has no properties",
        ),
        (text.replace("2 0.5 1e-3 -7", "1000000000 0.5"), "element \"edge\" 0 of 1: "),
        (String::new(), "a.ply: not a valid PLY file: "),
    ] {
        let error = build(bytes.as_bytes()).unwrap_err().to_string();
        assert!(
            error.starts_with("x.toml:6:16: object.it.ply.path: asset ") && error.contains(expected),
            "{error}"
        );
        assert!(error.len() < 1000 && !error.contains('\n'), "{error}");
    }
    // A list of 10⁹ numbers in a binary file of 200 bytes.
    let mut bytes = binary("binary_little_endian", |_| {});
    let list = bytes.len() - 16;
    bytes[list..list + 4].copy_from_slice(&1_000_000_000i32.to_le_bytes());
    let error = build(&bytes).unwrap_err().to_string();
    assert!(error.contains("element \"edge\" 0 of 1: "), "{error}");
}

proptest! {
    // 256 cases, seed 1, so that a run repeats; PROPTEST_CASES asks for more.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_files_never_panic(
        format in 0..3,
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in proptest::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = match format {
            0 => text(),
            1 => binary("binary_little_endian", |_| {}),
            _ => binary("binary_big_endian", |bytes| bytes.reverse()),
        };
        for (at, with) in edits {
            let at = at.index(bytes.len());
            bytes[at] = with;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        _ = build(&bytes);
    }
}
