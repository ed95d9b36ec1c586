//! Checks that the door room lets no ray out, and so no light in, while its door is closed.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use photonstream_scene::{Scene, bvh::Ray};
use std::path::Path;

fn at(scene: &Scene, time: f64) -> Scene {
    let mut edit = scene.edit();
    scene.animation.apply(time, &mut edit).unwrap();
    edit.finish()
}

/// SplitMix64, in [0, 1).
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Rays of `count` that leave the door room, and those that meet nothing at all: from within it in random directions, a third of them towards its edges and
/// the seams around the door, seed 1.
fn escaping(scene: &Scene, count: u32) -> (u32, u32) {
    let (low, high) = (DVec3::new(-1.99, 0.03, -1.49), DVec3::new(1.99, 2.69, 1.49));
    // Corners of room and opening, on two of whose coordinates a seam lies.
    let seams = [[-2.0, 0.3, 1.3, 2.0], [0.0, 0.02, 2.05, 2.7], [-1.5, 1.5, 1.685, 1.69]];
    let mut state = 1;
    let (mut escaped, mut missed) = (0, 0);
    for i in 0..count {
        let mut within =
            || low + (high - low) * DVec3::new(random(&mut state), random(&mut state), random(&mut state));
        let origin = within();
        let mut target = within() + (within() - within()) * 4.0;
        if i % 3 == 0 {
            target = within();
            let along = (random(&mut state) * 3.0) as usize;
            for axis in [(along + 1) % 3, (along + 2) % 3] {
                target[axis] = seams[axis][(random(&mut state) * 4.0) as usize];
            }
        }
        let ray = Ray {
            origin: (origin - scene.origin_m).as_vec3(),
            direction: (target - origin).as_vec3(),
            t_max: f32::INFINITY,
        };
        let hit = scene.bvh.closest(&ray);
        let is_inside = hit.is_some_and(|hit| {
            let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t) + scene.origin_m;
            // Up to the leaf, to 1e-5 m: f32 holds hits to 1e-6 m here.
            point.cmpge(DVec3::new(-2.0, 0.0, -1.5) - 1e-5).all()
                && point.cmple(DVec3::new(2.0, 2.7, 1.685) + 1e-5).all()
        });
        escaped += u32::from(!is_inside);
        missed += u32::from(hit.is_none());
    }
    (escaped, missed)
}

/// 300 000 rays find no way out while the door is closed, and more and more as it opens; nor does the sun find in.
#[test]
fn the_closed_door_is_light_tight() {
    let scene =
        Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/door-room.toml")).unwrap();
    for time in [0.0, 0.9, 14.5, 15.0] {
        assert_eq!(escaping(&at(&scene, time), 300_000), (0, 0), "{time} s");
    }
    let opening = [1.5, 2.0, 3.0, 4.0, 5.0].map(|time| escaping(&at(&scene, time), 30_000).1);
    assert!(opening[0] > 0 && opening.is_sorted() && opening[4] > 2 * opening[0], "{opening:?}");
}
