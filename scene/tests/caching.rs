//! Turns one scene, loaded with and without kept trees, into the same hits.
#![allow(clippy::unwrap_used, missing_docs)]

use glam::Vec3;
use photonstream_scene::{Scene, bvh::Ray, kept};
use std::path::Path;

#[test]
fn a_scene_finds_the_tree_of_its_large_object_again() {
    // The knot of 100 000 triangles is kept, the room around it is not; 4 000 rays from the room's middle, tolerance none.
    let folder = tempfile::tempdir().unwrap();
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-knot.toml");
    let without = Scene::load(&config).unwrap();
    assert!(kept::use_in_this_process(folder.path().to_owned()));
    assert!(!kept::use_in_this_process(folder.path().join("others")), "a process has one");
    for round in 0..2 {
        let with = Scene::load(&config).unwrap();
        let files: Vec<_> = std::fs::read_dir(folder.path().join("trees")).unwrap().collect();
        assert_eq!(files.len(), 1, "round {round}");
        with.bvh.validate().unwrap();
        assert_eq!(with.hash, without.hash);
        let (lo, hi) = with.bvh.bounds();
        for i in 0..4_000u32 {
            // A spiral over the sphere.
            let z = 1.0 - (i as f32 + 0.5) / 2_000.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let direction = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            let ray = Ray { origin: (lo + hi) * 0.5, direction, t_max: f32::INFINITY };
            assert_eq!(with.bvh.closest(&ray), without.bvh.closest(&ray), "round {round}, ray {i}");
        }
    }
}
