//! Checks that every scene in `configs/` loads, resolves to itself, and shows its camera reflecting sides.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{AssetRoots, Method, Scene, SceneConfig, Side, bvh::Ray};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// The scene of a config, or `None` and a loud notice where its assets are not there.
fn load(name: &str) -> Option<Scene> {
    let path = folder().join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    if ["obj =", "ply =", "gltf ="].iter().any(|import| text.contains(import))
        && std::env::var_os(AssetRoots::VARIABLE).is_none()
    {
        // Past the test harness, which would keep it to itself.
        let notice = format!("SKIP {name}: needs assets; set {}\n", AssetRoots::VARIABLE);
        std::io::stderr().write_all(notice.as_bytes()).unwrap();
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
        // What the models of others lack cannot be helped here; skies over scenes of few lights are told to light no VPL.
        let is_known = |n: &&String| {
            ["have no area", "of its pictures are white", "d is not read", "the sky lights no VPL"]
                .iter()
                .all(|known| !n.contains(known))
        };
        assert_eq!(scene.notices.iter().find(is_known), None);
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
        assert_eq!(again.animation, scene.animation);
    }
    assert!(count >= 5, "only {count} configs found");
}

/// 64 × 48 rays over each picture: nearly all meet something, and what they meet is a side that reflects: walls are
/// not inside out, imported faces not wound the wrong way.
#[test]
fn cameras_see_reflecting_sides() {
    for name in [
        "cornell-box.toml",
        "cornell-knot.toml",
        "cornell-original.toml",
        "cornell-light.toml",
        "cornell-ball.toml",
        "door-room.toml",
        "cell.toml",
        "spindle.toml",
        "integrating-sphere.toml",
        "two-rooms.toml",
        "bunny.toml",
        "dragon.toml",
        "sibenik.toml",
        "sponza.toml",
    ] {
        let Some(scene) = load(name) else { continue };
        let mut hits = 0;
        for i in 0..64 * 48 {
            let (x, y) = ((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5);
            let direction = scene.camera.direction(x * 0.75, y, 48, 48);
            let ray = Ray { origin: scene.camera.position, direction, t_max: f32::INFINITY };
            let Some(hit) = scene.bvh.closest(&ray) else { continue };
            hits += 1;
            let normal = scene.geometry.normals[hit.triangle as usize];
            let side = if normal.dot(direction) < 0.0 { Side::Front } else { Side::Back };
            let object = &scene.objects[scene.geometry.object_of[hit.triangle as usize].0 as usize];
            assert!(object.sides.contains(side), "{name}: {side:?} of {}", object.name);
        }
        assert!(hits > 64 * 48 * 95 / 100, "{name}: {hits} hits");
    }
}

/// VPLs that are placed by hand lie on the surfaces that they light, or above them, where shadow rays find them.
#[test]
fn hand_made_vpls_are_not_buried() {
    for name in ["cell.toml", "ruins.toml", "spindle.toml", "road.toml", "door-room.toml"] {
        let path = folder().join(name);
        let mut config = SceneConfig::from_file(&path).unwrap();
        config.streaming.method = Some(Method::StaticVpl);
        let scene = config.build().unwrap();
        let buried = scene.notices.iter().find(|notice| notice.contains("below"));
        assert!(scene.vpls.vpls.len() > 20 && buried.is_none(), "{name}: {buried:?}");
    }
}
