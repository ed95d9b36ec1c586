//! Textures: where they lie, how they go on, and what their alpha does.

use super::files::{Files, bytes, data_uri, with};
use base64::{Engine, prelude::BASE64_STANDARD};
use glam::Vec3;
use image::{DynamicImage, ImageFormat, Rgba, RgbaImage};
use photonstream_scene::{Detail, Scene, bvh::Ray};
use serde_json::{Value, json};
use std::{fs, io::Cursor};

/// 4 × 2 pixels, red by column and green by row; the first column is a hole.
fn picture() -> RgbaImage {
    RgbaImage::from_fn(4, 2, |x, y| Rgba([x as u8 * 85, y as u8 * 255, 0, if x == 0 { 0 } else { 255 }]))
}

fn encoded(picture: &RgbaImage, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let picture = DynamicImage::from(picture.clone());
    let picture = if format == ImageFormat::Jpeg { picture.into_rgb8().into() } else { picture };
    picture.write_to(&mut out, format).unwrap();
    out.into_inner()
}

/// The square with texture coordinates (0, 1) at its lower left and (1, 0) at its upper right corner, and a white material.
fn textured(image: Value, changes: &[(&str, Value)]) -> Value {
    let uvs = [[0.0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0], [0.5, 0.5]];
    let mut data = bytes();
    data.extend(uvs.iter().flatten().flat_map(|x| x.to_le_bytes()));
    let mut file = with(&[
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([1, 1, 0.5, 1])),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture", json!({ "index": 0 })),
        ("/textures", json!([{ "source": 0 }])),
        ("/images", json!([image])),
        ("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(2)),
        ("/buffers/0", json!({ "byteLength": data.len(), "uri": data_uri(&data) })),
    ]);
    let view = json!({ "buffer": 0, "byteOffset": 72, "byteLength": 40 });
    file["bufferViews"].as_array_mut().unwrap().push(view);
    let accessor = json!({ "bufferView": 2, "componentType": 5126, "count": 5, "type": "VEC2" });
    file["accessors"].as_array_mut().unwrap().push(accessor);
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        file.pointer_mut(parent).unwrap()[key] = value.clone();
    }
    file
}

fn inline() -> Value {
    let png = BASE64_STANDARD.encode(encoded(&picture(), ImageFormat::Png));
    json!({ "uri": format!("data:image/png;base64,{png}") })
}

fn scene(changes: &[(&str, Value)]) -> Scene {
    Files::new(&textured(inline(), changes)).scene()
}

/// What the square, which spans [-1, 1]², shows at (x, y).
fn at(scene: &Scene, x: f32, y: f32) -> Vec3 {
    let ray = Ray { origin: Vec3::new(x, y, 1.0), direction: Vec3::NEG_Z, t_max: f32::INFINITY };
    let hit = scene.bvh.closest(&ray).unwrap();
    scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Finest)
}

/// A step of 85 in sRGB, linear.
fn column(x: u32) -> f32 {
    let v = x as f32 / 3.0;
    ((v + 0.055) / 1.055).powf(2.4) * f32::from(u8::from(x > 0))
}

/// f32 and 65535ths.
fn close(a: Vec3, b: Vec3) {
    assert!((a - b).abs().max_element() < 1e-4, "{a}, expected {b}");
}

/// The picture stands upright: its first row is at the top of the square.
#[test]
fn pictures_lie_where_their_coordinates_say() {
    let scene = scene(&[]);
    let white =
        "object \"it\": 5 of 8 pixels of its pictures are white: paths end there by a cap, 1 in 1 000";
    assert_eq!(scene.notices, [white]);
    for x in 0..4 {
        let place = (x as f32 + 0.5) / 2.0 - 1.0;
        close(at(&scene, place, 0.5), Vec3::new(column(x), 0.0, 0.0));
        close(at(&scene, place, -0.5), Vec3::new(column(x), 1.0, 0.0));
    }
    // Between two centres the mean.
    close(at(&scene, 0.0, 0.0), Vec3::new((column(1) + column(2)) / 2.0, 0.5, 0.0));
    // The whole through a window as wide as it.
    let seen = scene.albedo_at(0, [0.2, 0.2], Detail::Width(4.0));
    close(seen, Vec3::new((0..4).map(column).sum::<f32>() / 4.0, 0.5, 0.0));
    assert_eq!(scene.albedo_max(), 1.0);
}

/// Scaled by two it repeats, mirrors or goes on with its edge; turned by a quarter it lies on its side.
#[test]
fn coordinates_are_transformed_and_wrapped() {
    let transform = |value: Value| {
        let path = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions";
        (path, json!({ "KHR_texture_transform": value }))
    };
    let double = || transform(json!({ "scale": [2, 1] }));
    let wrap = |mode: u32| {
        let texture = json!([{ "source": 0, "sampler": 0 }]);
        scene(&[double(), ("/textures", texture), ("/samplers", json!([{ "wrapS": mode }]))])
    };
    // The centre of the second column in the second half: u = 1 + 3/8.
    let place = 0.5 * (1.0 + 3.0 / 8.0) * 2.0 - 1.0;
    close(at(&wrap(10497), place, 0.5), Vec3::new(column(1), 0.0, 0.0));
    close(at(&wrap(33648), place, 0.5), Vec3::new(column(2), 0.0, 0.0));
    close(at(&wrap(33071), place, 0.5), Vec3::new(column(3), 0.0, 0.0));
    let shifted = scene(&[transform(json!({ "offset": [0.25, 0] }))]);
    close(at(&shifted, -0.75, 0.5), Vec3::new(column(1), 0.0, 0.0));
    // The picture turns clockwise by as much: what was to its left is above.
    let turned = scene(&[transform(json!({ "rotation": std::f32::consts::FRAC_PI_2 }))]);
    let other = scene(&[]);
    for (x, y) in [(-0.75, 0.5), (0.25, -0.5), (0.5, 0.25)] {
        let [u, v] = [(x + 1.0) / 2.0, (1.0 - y) / 2.0];
        // Source: KHR_texture_transform: (u, v) becomes (v, -u).
        let [u, v]: [f32; 2] = [v, -u];
        let (u, v) = (u.rem_euclid(1.0), v.rem_euclid(1.0));
        close(at(&turned, x, y), at(&other, 2.0 * u - 1.0, 1.0 - 2.0 * v));
    }
}

/// Pictures may be in the file, beside it or in a buffer, PNG or JPEG; a material of the object's own needs none.
#[test]
fn pictures_come_from_everywhere() {
    let grey = RgbaImage::from_pixel(8, 8, Rgba([188, 188, 188, 255]));
    let expected = Vec3::new(0.502886, 0.502886, 0.251443);
    let beside = Files::new(&textured(json!({ "uri": "a.jpg" }), &[]));
    fs::write(beside.0.path().join("a.jpg"), encoded(&grey, ImageFormat::Jpeg)).unwrap();
    // JPEG is lossy, but an even block comes out within a step of 255.
    assert!((at(&beside.scene(), 0.1, 0.2) - expected).length() < 0.01);

    let png = encoded(&grey, ImageFormat::Png);
    let mut file = textured(json!({ "bufferView": 3, "mimeType": "image/png" }), &[]);
    let mut data = bytes();
    data.extend([0; 40]);
    data.extend(&png);
    file["buffers"][0] = json!({ "byteLength": data.len(), "uri": data_uri(&data) });
    let view = json!({ "buffer": 0, "byteOffset": 112, "byteLength": png.len() });
    file["bufferViews"].as_array_mut().unwrap().push(view);
    close(at(&Files::new(&file).scene(), 0.1, 0.2), expected);

    // One that is not there is told, and the factor used alone.
    let missing = Files::new(&textured(json!({ "uri": "b.png" }), &[]));
    let scene = missing.scene();
    close(at(&scene, 0.1, 0.2), Vec3::new(1.0, 1.0, 0.5));
    assert!(scene.notices[0].contains("b.png cannot be read ("), "{:?}", scene.notices);
    let scene = missing.build("material = \"grey\"", "").unwrap();
    close(at(&scene, 0.1, 0.2), Vec3::splat(0.3));
    assert!(scene.notices.is_empty() && scene.geometry.uvs.is_empty());
}

/// Where the alpha is below the cutoff rays pass; an opaque material has no holes.
#[test]
fn rays_pass_through_holes() {
    let ray = |x: f32| Ray { origin: Vec3::new(x, 0.1, 1.0), direction: Vec3::NEG_Z, t_max: f32::INFINITY };
    let hits = |scene: &Scene, x: f32| {
        let hit = scene.bvh.closest(&ray(x)).is_some();
        assert_eq!(scene.bvh.occluded(&ray(x)), hit);
        hit
    };
    let opaque = scene(&[]);
    // Alpha rises from 0 to 1 between the centres of the first two columns, at -0.75 and -0.25; it wraps at the edge.
    let masked = scene(&[("/materials/0/alphaMode", json!("MASK"))]);
    let strict =
        scene(&[("/materials/0/alphaMode", json!("MASK")), ("/materials/0/alphaCutoff", json!(0.9))]);
    for (x, is_there, is_there_strictly) in [
        (-0.75, false, false),
        (-0.51, false, false),
        (-0.49, true, false),
        (-0.27, true, true),
        (0.5, true, true),
    ] {
        assert!(hits(&opaque, x));
        assert_eq!(hits(&masked, x), is_there, "{x}");
        assert_eq!(hits(&strict, x), is_there_strictly, "{x}");
    }
    // What blends is a mask, and said to be.
    let blended = scene(&[("/materials/0/alphaMode", json!("BLEND"))]);
    assert!(!hits(&blended, -0.75) && hits(&blended, 0.5));
    assert!(
        blended.notices.iter().any(|n| n.contains("is a mask at half of its alpha")),
        "{:?}",
        blended.notices
    );
}

#[test]
fn bad_coordinates_are_refused() {
    let few = Files::new(&textured(inline(), &[("/accessors/2/count", json!(4))])).error();
    assert!(few.contains("node \"square\", primitive 0: 4 texture coordinates for 5 vertices"), "{few}");
    let huge = json!({ "KHR_texture_transform": { "scale": [1e30, 1] } });
    let path = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions";
    let error = Files::new(&textured(inline(), &[(path, huge)])).error();
    assert!(error.contains("texture coordinates") && error.contains("expected at most"), "{error}");
}
