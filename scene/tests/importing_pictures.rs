//! Checks pictures of OBJ files: holes, and that damaged pictures are told and never panic.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use photonstream_scene::{AssetRoots, Scene, SceneConfig};
use proptest::prelude::*;
use std::{fs, io::Cursor, path::Path};

/// A square from (-1, -1) to (1, 1) that looks along +z, its texture coordinates those of the whole picture.
const OBJ: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl paint\nf 1/1 2/2 3/3 4/4\n";

fn file(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn scene(mtl: &str, pictures: &[(&str, &[u8])]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), OBJ).unwrap();
    fs::write(folder.path().join("a.mtl"), format!("newmtl paint\nKd 0.5 0.5 0.5\n{mtl}")).unwrap();
    pictures.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    let text = "origin_m = [0, 0, 0]\ncamera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }\n\
        [object.it]\nobj = { path = \"a.obj\" }\n";
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    let config = SceneConfig::from_text(text, Path::new("x.toml")).unwrap();
    config.build_with(&roots).unwrap_or_else(|e| panic!("{e}"))
}

/// Whether something is left and right of the middle, and below and above it, well within each quarter.
fn is_there(scene: &Scene) -> [bool; 4] {
    [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]].map(|[x, y]| {
        let origin = Vec3::new(x, y, 1.0);
        let ray = photonstream_scene::bvh::Ray { origin, direction: Vec3::NEG_Z, t_max: f32::INFINITY };
        scene.bvh.closest(&ray).is_some()
    })
}

/// 2 × 1: left of it there, right of it not.
fn left() -> Vec<u8> {
    file(RgbImage::from_fn(2, 1, |x, _| Rgb([if x == 0 { 255 } else { 0 }; 3])), ImageFormat::Png)
}

/// A mask alone, one beside colours of another size, one whose alpha counts, and what `d` does to them.
#[test]
fn masks_cut_holes() {
    let colours = file(RgbImage::from_fn(1, 2, |_, _| Rgb([255, 0, 0])), ImageFormat::Jpeg);
    let alone = scene("map_d mask.png\n", &[("mask.png", &left())]);
    assert_eq!(is_there(&alone), [true, false, true, false]);
    let object = alone.object("it/unnamed_object/paint").unwrap();
    assert_eq!(alone.albedo(object), Vec3::splat(0.5));
    let both = "map_Kd paint.jpg\nmap_d mask.png\n";
    let pictures: &[(&str, &[u8])] = &[("mask.png", &left()), ("paint.jpg", &colours)];
    let masked = scene(both, pictures);
    assert_eq!(is_there(&masked), [true, false, true, false]);
    // Red of an sRGB JPEG, by 8 bits of each: 0.02.
    let texture = masked.materials.iter().find_map(|m| m.texture.as_ref()).unwrap();
    let mean = texture.picture.mean().truncate();
    assert!((mean - Vec3::X).abs().max_element() < 0.02, "{mean}");
    let upper = RgbaImage::from_fn(1, 2, |_, y| Rgba([9, 9, 9, if y == 0 { 255 } else { 0 }]));
    let upper = file(upper, ImageFormat::Png);
    assert_eq!(is_there(&scene("map_d upper.png\n", &[("upper.png", &upper)])), [false, false, true, true]);
    // Half of what is there is there enough, less is not.
    assert_eq!(is_there(&scene(&format!("{both}d 0.5\n"), pictures)), [true, false, true, false]);
    assert_eq!(is_there(&scene(&format!("{both}Tr 0.6\n"), pictures)), [false; 4]);
    for scene in [&alone, &masked] {
        assert!(scene.notices.iter().all(|n| !n.contains("map_d") && !n.contains(" d is ")));
    }
}

#[test]
fn what_is_not_read_of_dissolve_is_told() {
    let told = |mtl: &str, pictures: &[(&str, &[u8])], expected: &str| {
        let scene = scene(mtl, pictures);
        let found = scene.notices.iter().filter(|n| n.contains(expected)).count();
        assert_eq!(found, 1, "{expected}: {:?}", scene.notices);
        assert_eq!(is_there(&scene), [true; 4], "{mtl}");
    };
    let opaque = "d is not read: it is opaque, not 0.25; `transmit` lets light pass";
    told("d 0.25\n", &[], &format!("material \"paint\": {opaque}"));
    told("Tr 0.75\n", &[], &format!("material \"paint\": {opaque}"));
    let grey = file(RgbImage::from_pixel(1, 1, Rgb([128; 3])), ImageFormat::Png);
    let pictures: &[(&str, &[u8])] = &[("mask.png", &left()), ("grey.png", &grey)];
    told(
        "map_Kd grey.png\nmap_d -s 2 2 mask.png\n",
        pictures,
        "map_d is not read: its -s, -o or -clamp are others than those of map_Kd",
    );
    // One of two is read alone.
    told("map_Kd grey.png\nmap_d none.png\n", pictures, "none.png cannot be read (");
    let mask = scene("map_Kd none.png\nmap_d mask.png\n", pictures);
    assert_eq!(is_there(&mask), [true, false, true, false]);
    assert!(mask.notices.iter().any(|n| n.contains("none.png cannot be read (")), "{:?}", mask.notices);
}

/// Small valid pictures: PNG of 8 and 16 bits, with and without alpha, grey, and JPEG of colours and greys.
fn valid() -> Vec<Vec<u8>> {
    let colours =
        RgbaImage::from_fn(9, 7, |x, y| Rgba([(x * 28) as u8, (y * 36) as u8, 90, 255 - (x * y) as u8]));
    let colours = DynamicImage::from(colours);
    vec![
        file(colours.to_rgba8(), ImageFormat::Png),
        file(colours.to_rgb16(), ImageFormat::Png),
        file(colours.to_luma8(), ImageFormat::Png),
        file(colours.to_rgb8(), ImageFormat::Jpeg),
        file(colours.to_luma8(), ImageFormat::Jpeg),
    ]
}

/// Gives the chunks of a PNG file the checksums that their bytes have, as far as their lengths lead.
fn mend_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = png.get(at..at + 4) {
        let length = u32::from_be_bytes(length.try_into().unwrap()) as usize;
        let end = at.saturating_add(8).saturating_add(length);
        let Some(covered) = png.get(at + 4..end) else { return };
        let crc = crc32(covered).to_be_bytes();
        let Some(place) = png.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&crc);
        at = end + 4;
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

/// What is huge by its header alone is refused before its pixels have a place, in either format.
#[test]
fn huge_pictures_are_refused() {
    let all = valid();
    let mut png = all[0].clone();
    png[16..24].copy_from_slice(&[0, 0, 0xfd, 0xe8, 0, 0, 0xfd, 0xe8]);
    mend_checksums(&mut png);
    let mut jpeg = all[3].clone();
    // Height and width in the frame header: marker, length, precision.
    let frame = jpeg.windows(2).position(|two| two == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xfd, 0xe8, 0xfd, 0xe8]);
    for (name, bytes) in [("a.png", png), ("a.jpg", jpeg)] {
        let scene = scene(&format!("map_Kd {name}\n"), &[(name, &bytes)]);
        let told = format!(
            "\"{name}\" is no picture (65000 × 65000 pixels are more than 67108864); Kd is used alone"
        );
        assert!(scene.notices.iter().any(|n| n.ends_with(&told)), "{:?}", scene.notices);
    }
}

proptest! {
    // 256 cases, seed 1, so that a run repeats; PROPTEST_CASES asks for more.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    /// Bytes changed and cut off: either a picture whose texels are reflectances, or a notice that names the file. The sizes
    /// in the headers stay, so that no case takes long; the test above has others.
    #[test]
    fn damaged_pictures_are_told_and_never_panic(
        which in 0usize..5,
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in proptest::option::of(any::<prop::sample::Index>()),
        mended in any::<bool>(),
    ) {
        let whole = valid().swap_remove(which);
        let (mut bytes, is_png) = (whole.clone(), which < 3);
        for (at, with) in edits {
            let at = at.index(bytes.len());
            bytes[at] = with;
        }
        if is_png {
            bytes[16..24].copy_from_slice(&whole[16..24]);
        } else if let Some(frame) = whole.windows(2).position(|two| two == [0xff, 0xc0]) {
            bytes[frame..frame + 9].copy_from_slice(&whole[frame..frame + 9]);
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if mended && is_png {
            mend_checksums(&mut bytes);
        }
        let scene = scene("map_Kd a.png\nmap_d b.png\n", &[("a.png", &bytes), ("b.png", &whole)]);
        let told = scene.notices.iter().any(|n| n.contains("\"a.png\" is no picture ("));
        let texture = scene.materials.iter().find_map(|m| m.texture.as_ref()).unwrap();
        let mean = texture.picture.mean();
        prop_assert!(mean.is_finite() && mean.min_element() >= 0.0 && mean.max_element() <= 1.0);
        // The mask alone is white.
        prop_assert!(!told || mean.truncate() == Vec3::ONE, "{:?}", scene.notices);
    }
}
