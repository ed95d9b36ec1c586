//! Checks that the scene file may take a camera of an import.

use super::files::*;
use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError};
use serde_json::{Value, json};
use std::path::Path;

/// The square and two cameras, one of which looks along −x from (5, 1, 0) with +z up; a third is orthographic.
fn with_cameras() -> Value {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    with(&[
        ("/scenes/0/nodes", json!([0, 1, 2, 3])),
        (
            "/nodes",
            json!([
                { "name": "square", "mesh": 0 },
                // −z turned to −x by a quarter turn about y, then +y to +z by one about x.
                { "name": "side", "camera": 0, "translation": [5, 1, 0], "rotation": [0.5, 0.5, 0.5, 0.5] },
                { "name": "front", "camera": 0, "translation": [0, 0, 3], "rotation": [0, 0, half, half] },
                { "name": "flat", "camera": 1 },
            ]),
        ),
        (
            "/cameras",
            json!([
                { "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } },
                { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9 } },
            ]),
        ),
    ])
}

fn build(file: &Value, camera: &str, object: &str) -> Result<Scene, SceneError> {
    let files = Files::new(file);
    let text = format!(
        "origin_m = [0, 0, 0]\n[camera]\n{camera}\n[object.it]\n{object}\ngltf = {{ path = \"a.gltf\" }}\n"
    );
    let roots = AssetRoots { folders: vec![files.0.path().to_owned()] };
    SceneConfig::from_text(&text, Path::new("x.toml"))?.build_with(&roots)
}

/// Positions and unit vectors from f32: 1e-6.
fn close(a: Vec3, b: Vec3) {
    assert!(a.distance(b) < 2e-6, "{a} {b}");
}

#[test]
fn a_camera_of_the_file_takes_the_picture() {
    let file = with_cameras();
    let scene = build(&file, "node = \"it/side\"", "").unwrap();
    close(scene.camera.position, Vec3::new(5.0, 1.0, 0.0));
    close(scene.camera.forward, Vec3::NEG_X);
    close(scene.camera.up, Vec3::Z);
    // yfov is a whole angle in radians.
    assert!((scene.camera.tan_half_fov - 0.5f32.tan()).abs() < 1e-6);
    // The text says where it is.
    assert!(!scene.resolved_text.contains("node ="), "{}", scene.resolved_text);
    let config = SceneConfig::from_text(&scene.resolved_text, Path::new("again.toml")).unwrap();
    assert_eq!(config.camera.position_m.unwrap().0.map(|x| x as f32), [5.0, 1.0, 0.0]);
    // Where its object stands, with an angle of its own.
    let keys = "rotation_deg = [0, 90, 0]\nposition_m = [0, 0, 1]\nscale = 2";
    let scene = build(&file, "node = \"it/side\"\nvertical_fov_deg = 90", keys).unwrap();
    close(scene.camera.position, Vec3::new(0.0, 2.0, -9.0));
    close(scene.camera.forward, Vec3::Z);
    close(scene.camera.up, Vec3::X);
    assert!((scene.camera.tan_half_fov - 1.0).abs() < 1e-6);
    let scene = build(&file, "node = \"it/front\"", "").unwrap();
    close(scene.camera.forward, Vec3::NEG_Z);
    close(scene.camera.up, Vec3::NEG_X);
}

#[test]
fn cameras_that_are_not_there_are_told() {
    let error = |camera: &str| build(&with_cameras(), camera, "").unwrap_err().to_string();
    assert_eq!(
        error("node = \"it/fron\""),
        "x.toml:3:8: camera.node: no camera of an imported file is called \"it/fron\"; expected one of: it/front, it/side"
    );
    let both = error("node = \"it/front\"\nup = [0, 1, 0]");
    assert!(both.starts_with("x.toml:4:6: camera.up: found up besides node = \"it/front\""), "{both}");
    let neither = error("target_m = [0, 1, 0]\nvertical_fov_deg = 40");
    assert!(neither.contains("camera: the key \"position_m\" is missing"), "{neither}");
    let none = build(&square(), "node = \"it/front\"", "").unwrap_err().to_string();
    assert!(none.contains("\"it/front\"; there is none to choose from"), "{none}");
}
