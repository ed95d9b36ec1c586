//! Checks what a sky may be in a scene file, what of it can be changed, and that mistakes are told with their place.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError};
use std::path::Path;

fn try_build(lights: &str, folder: &Path) -> Result<Scene, SceneError> {
    let text = format!(
        "[camera]\nposition_m = [0, 1, 4]\ntarget_m = [0, 1, 0]\nvertical_fov_deg = 40\n[material.a]\nalbedo = 0.5\n\
         [object.floor]\nmaterial = \"a\"\nquad = {{ corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }}\n{lights}"
    );
    SceneConfig::from_text(&text, &folder.join("test.toml"))?
        .build_with(&AssetRoots { folders: vec![folder.to_owned()] })
}

fn build(lights: &str) -> Scene {
    try_build(lights, Path::new("")).unwrap()
}

/// One texel of (64, 32, 16) times `strength`, a whole number below 4.
fn map(strength: u8) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n".to_vec();
    bytes.extend([64 * strength, 32 * strength, 16 * strength, 136]);
    bytes
}

#[test]
fn skies_have_their_radiances() {
    let scene = build("[light.s]\nsky = { radiance_w_m2_sr = [1, 2, 3], scale = 2 }\n");
    assert_eq!(scene.background(Vec3::X), Vec3::new(2.0, 4.0, 6.0));
    assert_eq!((scene.features.skies, scene.features.area_lights, scene.features.lights()), (1, 0, 1));
    let scene = build("[light.s]\nsky = { zenith_w_m2_sr = 4, horizon_w_m2_sr = 2, ground_w_m2_sr = 1 }\n");
    let at = |y: f32| scene.background(Vec3::new((1.0 - y * y).sqrt(), y, 0.0)).x;
    // Linear in the sine of the elevation; four roundings of f32.
    for (y, expected) in [(1.0, 4.0), (0.5, 3.0), (0.0, 2.0), (-0.5, 1.0), (-1.0, 1.0)] {
        assert!((at(y) - expected).abs() < 1e-6, "{y}: {}", at(y));
    }
    // Without a sky there is nothing.
    assert_eq!(build("").background(Vec3::Y), Vec3::ZERO);
}

#[test]
fn maps_are_assets_whose_content_counts() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("day.hdr");
    let text = "[light.s]\nsky = { map = \"day.hdr\", rotation_deg = 20 }\n";
    let missing = try_build(text, folder.path()).unwrap_err();
    assert!(matches!(missing, SceneError::AssetMissing { .. }), "{missing}");
    std::fs::write(&file, map(1)).unwrap();
    let scene = try_build(text, folder.path()).unwrap();
    assert_eq!(scene.background(Vec3::NEG_Y), Vec3::new(64.0, 32.0, 16.0));
    assert!(scene.files.contains(&file), "{:?}", scene.files);
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.lights), (scene.hash, &scene.lights));
    std::fs::write(&file, map(2)).unwrap();
    assert_ne!(try_build(text, folder.path()).unwrap().hash, scene.hash);
    for bad in [&map(1)[..40], b"", b"\x76\x2f\x31\x01 cut"] {
        std::fs::write(&file, bad).unwrap();
        let error = try_build(text, folder.path()).unwrap_err();
        assert!(matches!(error, SceneError::Asset { .. }), "{error}");
        assert!(error.to_string().contains("light.s.sky.map"), "{error}");
    }
}

#[test]
fn mistakes_are_told_with_their_place() {
    let sky = "radiance_w_m2_sr = 1";
    for (lights, field, found) in [
        (
            format!("[light.a]\nsky = {{ {sky} }}\n[light.b]\nsky = {{ {sky} }}\n"),
            "light.b.sky",
            "a second sky besides \"a\"",
        ),
        (format!("[light.a]\npower_w = 1\nsky = {{ {sky} }}\n"), "light.a.power_w", "sky.scale"),
        (
            format!("[light.a]\npoint = {{ position_m = [0, 1, 0] }}\nsky = {{ {sky} }}\n"),
            "light.a",
            "point and sky",
        ),
        (
            format!("[light.a]\nsky = {{ {sky}, map = \"x.hdr\" }}\n"),
            "light.a.sky",
            "radiance_w_m2_sr and map",
        ),
        (format!("[light.a]\nsky = {{ {sky}, rotation_deg = 5 }}\n"), "light.a.sky.rotation_deg", "map"),
        ("[light.a]\nsky = {}\n".into(), "light.a.sky", "none"),
        ("[light.a]\nsky = { zenith_w_m2_sr = 1 }\n".into(), "light.a.sky", "horizon_w_m2_sr"),
        (
            "[light.a]\nsky = { radiance_w_m2_sr = -1 }\n".into(),
            "light.a.sky.radiance_w_m2_sr",
            "[-1, -1, -1]",
        ),
        ("[light.a]\nsky = { radiance_w_m2_sr = nan }\n".into(), "light.a.sky.radiance_w_m2_sr", "NaN"),
        (format!("[light.a]\nsky = {{ {sky}, scale = inf }}\n"), "light.a.sky.scale", "inf"),
        (format!("[light.a]\nsky = {{ {sky}, colour = 1 }}\n"), "light.a.sky", "colour"),
    ] {
        let error = try_build(&lights, Path::new("")).unwrap_err().to_string();
        assert!(error.contains(field) && error.contains(found), "{lights}: {error}");
    }
}

/// What is set equals what is written, and a sky that was switched off is what it was when it is switched on.
#[test]
fn scale_and_switch_can_be_set() {
    let text = |scale: &str| {
        format!("[light.s]\nsky = {{ zenith_w_m2_sr = [1, 2, 3], horizon_w_m2_sr = 2, scale = {scale} }}\n")
    };
    let scene = build(&text("1"));
    let set = |scene: &Scene, key: &str, value: serde_json::Value| {
        let mut edit = scene.edit();
        edit.set_light("s", &[(key.to_owned(), value)].into_iter().collect()).map(|_| edit.finish())
    };
    let dimmed = set(&scene, "scale", serde_json::json!([0.5, 0, 2])).unwrap();
    assert_eq!(dimmed.lights[0].light, build(&text("[0.5, 0, 2]")).lights[0].light);
    let off = set(&dimmed, "enabled", false.into()).unwrap();
    assert_eq!(off.background(Vec3::Y), Vec3::ZERO);
    assert_eq!(set(&off, "sky.enabled", true.into()).unwrap().lights, dimmed.lights);
    let error = set(&scene, "scale", serde_json::json!(-1)).unwrap_err().to_string();
    assert!(error.contains("light.s.sky.scale"), "{error}");
    let error = set(&scene, "power_w", serde_json::json!(1)).unwrap_err().to_string();
    assert!(error.contains("unknown key \"power_w\"") && error.contains("scale"), "{error}");
}

/// Dawn: the scale of a sky may be animated, from nothing, and is what the config at that time says.
#[test]
fn a_sky_may_dawn() {
    let text = "[light.s]\nsky = { radiance_w_m2_sr = 4 }\n[[animation]]\nlight = \"s\"\nproperty = \"scale\"\ntimes_s = [0, 2]\n\
                values = [0, [1, 0.5, 0.25]]\nrepeat = \"once\"\n";
    let scene = build(text);
    assert_eq!(scene.background(Vec3::Y), Vec3::ZERO);
    let mut edit = scene.edit();
    scene.animation.apply(1.0, &mut edit).unwrap();
    let half = edit.finish();
    assert_eq!(half.background(Vec3::Y), Vec3::new(2.0, 1.0, 0.5));
    assert_eq!((scene.features.moving_lights, scene.features.moving_objects), (0, 0));
    let wrong = text.replace("\"scale\"", "\"power_w\"");
    assert!(try_build(&wrong, Path::new("")).unwrap_err().to_string().contains("what a sky has: scale"));
}
