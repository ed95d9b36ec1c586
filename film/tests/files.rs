//! Turns pictures into files and back: values, names, metadata, refusals, atomicity.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_film::{Display, Film, FilmError, Metadata};
use photonstream_shading::tone::ToneMap;

fn gradient(width: u32, height: u32) -> Film {
    let mut film = Film::new(width, height).unwrap();
    let pixel = |i: u32| Vec3::new(i as f32 * 0.1, 1e-30 * i as f32, 3e30 / (1 + i) as f32);
    film.push("full", (0..width * height).map(pixel).collect()).unwrap();
    film.push("normal", (0..width * height).map(|i| Vec3::splat(-(i as f32))).collect()).unwrap();
    film.metadata = Metadata {
        frame: Some(u64::MAX),
        scene_hash: Some(0x00FE_DCBA_9876_5432),
        scene_name: Some("Cornell box – é".into()),
        method: Some("photon-streaming".into()),
        kernel: Some("disc".into()),
        visibility: Some("rays".into()),
        samples_per_pixel: Some(4),
        photon_paths: Some(131_072),
        vsls: Some(1000),
        noise_rel_rmse: Some(0.001_25),
        software: Some("photonstream 0.1.0".into()),
    };
    film
}

#[test]
fn exr_keeps_every_bit_name_and_text() {
    let folder = tempfile::tempdir().unwrap();
    // 17 rows: more than one ZIP block of 16.
    let film = gradient(31, 17);
    let path = folder.path().join("new/folder/a.exr");
    film.write_exr(&path).unwrap();
    let back = Film::read_exr(&path).unwrap();
    assert_eq!(back, film);
    assert_eq!(Metadata::read_exr(&path).unwrap(), film.metadata);
    let only = film.only("normal").unwrap();
    only.write_exr(&path).unwrap();
    assert_eq!(Film::read_exr(&path).unwrap().layers(), only.layers());
}

#[test]
fn bad_pixels_leave_the_old_file_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    gradient(4, 4).write_exr(&path).unwrap();
    let before = std::fs::read(&path).unwrap();
    let mut bad = Film::new(4, 4).unwrap();
    let mut pixels = vec![Vec3::ZERO; 16];
    pixels[6].z = f32::INFINITY;
    bad.push("full", pixels).unwrap();
    for error in [bad.write_exr(&path).unwrap_err(), bad.write_png(&path, "full", Display::Data).unwrap_err()]
    {
        assert!(matches!(error, FilmError::NotFinite { x: 2, y: 1, channel: 'B', .. }), "{error}");
        assert!(error.to_string().contains("pixel (2, 1), channel B: found inf"), "{error}");
    }
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file was left behind");
}

#[test]
fn png_has_the_tone_mapped_colours_and_the_texts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut film = Film::new(2, 1).unwrap();
    film.push("full", vec![Vec3::splat(0.5), Vec3::new(2.0, 0.0, 0.107_020_57)]).unwrap();
    film.metadata.scene_hash = Some(0xAB);
    let display = Display::Radiance { exposure_ev: 1.0, tone_map: ToneMap::Linear };
    film.write_png(&path, "full", display).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let text = b"photonstream.scene_hash\x0000000000000000ab";
    assert!(bytes.windows(text.len()).any(|w| w == text));
    // The decoder checks the checksums of the chunks.
    let image = image::load_from_memory(&bytes).unwrap().to_rgb8();
    assert_eq!(image.as_raw(), &[255, 255, 255, 255, 0, 128]);
}

#[test]
fn unreadable_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    assert!(matches!(Film::read_exr(&path), Err(FilmError::Read { .. })));
    for bytes in [&b""[..], b"not an exr", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]] {
        std::fs::write(&path, bytes).unwrap();
        let error = Film::read_exr(&path).unwrap_err();
        assert!(matches!(error, FilmError::Decode { .. }) && error.to_string().contains("a.exr"), "{error}");
    }
    let film = gradient(2, 2);
    assert!(matches!(film.write_png(&path, "depth", Display::Data), Err(FilmError::NoSuchLayer { .. })));
    let file_as_folder = path.join("b.exr");
    assert!(matches!(film.write_exr(&file_as_folder), Err(FilmError::Write { .. })));
}
