//! Checks that a resolved text gives the same scene, that hashes tell scenes apart, and that no text makes a panic.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{AssetRoots, Sampling, Scene, SceneConfig};
use proptest::prelude::*;
use std::path::Path;

const TABLES: [&str; 6] = [
    "[camera]\nposition_m = [0.1, 1, 4]\ntarget_m = [0, 1, 0]\nvertical_fov_deg = 40.3\n",
    "[material.white]\nalbedo = 0.7\n",
    "[material.red]\nalbedo = [0.6, 0.1, 0.1]\n",
    "[object.ball]\nmaterial = \"red\"\nposition_m = [0.1, 0.2, 0.3]\nrotation_deg = [1, 2, 3]\nscale = [0.3, -0.2, 0.1]\n\
     sphere = { radius_m = 1.1, segments = 8 }\n",
    "[object.floor]\nmaterial = \"white\"\nsides = \"both\"\n\
     quad = { corner_m = [-1.1, 0, 1.3], edge_u_m = [2.7, 0, 0], edge_v_m = [0, 0, -2.3] }\n",
    "[light.cone]\npower_w = [1.1, 2.2, 3.3]\n\
     spot = { position_m = [0, 3.1, 0], target_m = [0.1, 0, 0], outer_half_angle_deg = 33.3 }\n",
];

fn build(text: &str) -> Scene {
    SceneConfig::from_text(text, Path::new("a/test.toml"))
        .unwrap()
        .build_with(&AssetRoots::default())
        .unwrap()
}

fn assert_same(a: &Scene, b: &Scene) {
    assert_eq!((a.hash, &a.resolved_text, &a.name), (b.hash, &b.resolved_text, &b.name));
    assert_eq!((&a.geometry, a.bounds, a.origin_m), (&b.geometry, b.bounds, b.origin_m));
    assert_eq!((&a.materials, &a.objects, &a.lights), (&b.materials, &b.objects, &b.lights));
    assert_eq!((a.camera, &a.streaming, &a.render), (b.camera, &b.streaming, &b.render));
    assert_eq!((&a.features, &a.notices), (&b.features, &b.notices));
}

#[test]
fn a_resolved_text_gives_the_same_scene() {
    let scene = build(&TABLES.concat());
    assert_same(&scene, &Scene::from_resolved(&scene.resolved_text).unwrap());
    assert_eq!(scene.name, "test");
    for default in
        ["segments = 8", "sampling = \"replay\"", "epsilon = 0.000001", "placement_scale = 0.9", "sides"]
    {
        assert!(scene.resolved_text.contains(default), "{default} in\n{}", scene.resolved_text);
    }
    assert_eq!(scene.streaming, photonstream_scene::StreamingSettings::default());
    assert_eq!(scene.render, photonstream_scene::RenderSettings::default());
}

#[test]
fn the_order_of_tables_is_irrelevant() {
    let mut tables = TABLES;
    tables.reverse();
    assert_same(&build(&TABLES.concat()), &build(&tables.concat()));
}

/// Golden: changes only when the set of keys, a default, or the way numbers are written changes.
#[test]
fn hashes_are_stable_and_tell_scenes_apart() {
    let text = TABLES.concat();
    let hash = build(&text).hash;
    assert_eq!(hash, 0xbfae_cd0e_9f36_1b05, "{hash:#018x}");
    for (from, to) in [
        ("0.7", "0.71"),
        ("edge_v_m = [0, 0, -2.3]", "edge_v_m = [0, 0, -2.300000001]"),
        ("segments = 8", "segments = 9"),
        ("[object.ball]", "[object.boll]"),
        ("sides = \"both\"", "sides = \"front\""),
        ("power_w = [1.1", "power_w = [1.2"),
    ] {
        assert_ne!(build(&text.replace(from, to)).hash, hash, "{to}");
    }
    // What says the same has the same hash.
    assert_eq!(build(&text.replace("0.7", "[0.7, 0.7, 7e-1]")).hash, hash);
    assert_eq!(build(&text.replace("sides = \"both\"", "sides = \"both\" # thin")).hash, hash);
}

#[test]
fn settings_can_be_changed_before_building() {
    let mut config = SceneConfig::from_text(&TABLES.concat(), Path::new("a/test.toml")).unwrap();
    config.streaming.vsls = Some(7);
    config.streaming.sampling = Some(Sampling::Fresh);
    config.render.width_px = Some(32);
    let scene = config.build_with(&AssetRoots::default()).unwrap();
    assert_eq!(
        (scene.streaming.vsls, scene.streaming.sampling, scene.render.width),
        (7, Sampling::Fresh, 32)
    );
    assert_same(&scene, &Scene::from_resolved(&scene.resolved_text).unwrap());
}

#[test]
fn deeply_nested_text_is_an_error() {
    for text in [
        "a = ".to_owned() + &"[".repeat(100_000),
        "a = ".to_owned() + &"{a=".repeat(100_000),
        "[a".to_owned() + &".a".repeat(100_000) + "]",
    ] {
        assert!(SceneConfig::from_text(&text, Path::new("x.toml")).is_err());
    }
}

/// Builds what parses, unless it asks for more triangles than a test should make; only a panic fails.
fn try_all(text: &str) {
    let Ok(config) = SceneConfig::from_text(text, Path::new("x.toml")) else { return };
    let large = |n: Option<u32>| n.is_some_and(|n| n > 64);
    if config.object.values().any(|o| o.sphere.as_ref().is_some_and(|s| large(s.segments))) {
        return;
    }
    if let Ok(scene) = config.build_with(&AssetRoots::default()) {
        assert_same(&scene, &Scene::from_resolved(&scene.resolved_text).unwrap());
        assert!(scene.geometry.vertices.iter().all(|v| v.is_finite()));
        assert!(scene.geometry.normals.iter().all(|n| n.is_normalized()));
        assert!(!scene.geometry.triangles.is_empty());
    }
}

proptest! {
    // 256 cases each, seed 1, so that a run repeats; PROPTEST_CASES asks for more.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_text_never_panics(text in any::<String>()) {
        try_all(&text);
    }

    #[test]
    fn random_toml_never_panics(
        lines in proptest::collection::vec(("[a-z_.\\[\\]\"]{0,12}", " ?= ?", "[-0-9.eainf\\[\\]{},\" =]{0,16}"), 0..12)
    ) {
        try_all(&lines.into_iter().map(|(a, b, c)| format!("{a}{b}{c}\n")).collect::<String>());
    }

    #[test]
    fn damaged_scenes_never_panic(
        edits in proptest::collection::vec((0usize..1000, "[-0-9.e,\\[\\]{}=\"a-z\n ]{0,3}"), 1..4)
    ) {
        let mut text = TABLES.concat();
        for (at, with) in edits {
            let at = at % (text.len() - 1);
            text.replace_range(at..=at, &with);
        }
        try_all(&text);
    }

    #[test]
    fn scenes_of_random_numbers_never_panic(
        p in proptest::array::uniform3(any::<f64>()),
        s in proptest::array::uniform3(-1e10..1e10f64),
        r in proptest::array::uniform3(-1e5..1e5f64),
        u in proptest::array::uniform3(any::<f32>()),
    ) {
        let text = format!(
            "{}[object.x]\nmaterial = \"white\"\nposition_m = {p:?}\nscale = {s:?}\nrotation_deg = {r:?}\n\
             quad = {{ corner_m = {u:?}, edge_u_m = [1, 0, 0], edge_v_m = {p:?} }}\n",
            TABLES.concat()
        );
        try_all(&text.replace("NaN", "nan"));
        try_all(&text.replace("NaN", "0").replace("e", "e-1"));
    }
}
