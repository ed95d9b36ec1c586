//! Checks that every scene in `configs/` loads, and that the documented keys are exactly those that exist.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{AssetRoots, Scene};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// The scene of a config, or `None` and a loud notice where its assets are not there.
fn load(name: &str) -> Option<Scene> {
    let path = folder().join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    if text.contains("obj =") && std::env::var_os(AssetRoots::VARIABLE).is_none() {
        eprintln!("SKIP {name}: needs assets; set {}", AssetRoots::VARIABLE);
        return None;
    }
    Some(Scene::load(&path).unwrap_or_else(|e| panic!("{e}")))
}

#[test]
fn every_config_loads_and_resolves_to_itself() {
    let mut count = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        count += 1;
        let Some(scene) = load(path.file_name().unwrap().to_str().unwrap()) else { continue };
        assert!(scene.notices.is_empty(), "{:?}", scene.notices);
        assert!(!scene.lights.is_empty());
        let again = Scene::from_resolved(&scene.resolved_text).unwrap();
        assert_eq!(again.resolved_text, scene.resolved_text);
        assert_eq!(again.hash, scene.hash);
        assert_eq!(again.geometry, scene.geometry);
        assert_eq!((&again.objects, &again.lights), (&scene.objects, &scene.lights));
        assert_eq!((&again.materials, again.camera), (&scene.materials, scene.camera));
        assert_eq!((&again.streaming, &again.render), (&scene.streaming, &scene.render));
        assert_eq!((again.origin_m, again.bounds), (scene.origin_m, scene.bounds));
        assert_eq!((&again.name, &again.features), (&scene.name, &scene.features));
        println!(
            "{}: {} triangles, {:x}, {:?}, origin {}, bounds {:?}",
            path.display(),
            scene.geometry.triangles.len(),
            scene.hash,
            scene.features,
            scene.origin_m,
            scene.bounds
        );
    }
    assert_eq!(count, 5);
}
