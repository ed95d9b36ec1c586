//! Turns one scene, cut into parts in several ways and moved, into the same hits.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::shapes::{Random, build, cube, on_every_path, soup};
use crate::bvh::{BvhError, Ray, SceneBvh};

fn rays(seed: u64) -> impl Iterator<Item = Ray> {
    let mut random = Random(seed);
    (0..4_000).map(move |_| Ray {
        origin: random.in_cube() * 1.5,
        direction: random.in_cube(),
        t_max: f32::INFINITY,
    })
}

/// `pieces` ranges of nearly equal length, an empty one among them.
fn pieces(count: u32, pieces: u32) -> Vec<Range<u32>> {
    let mut ranges: Vec<_> = (0..pieces).map(|i| count * i / pieces..count * (i + 1) / pieces).collect();
    ranges.insert(1, 0..0);
    ranges
}

#[test]
fn parts_do_not_change_hits() {
    // N = 5 × 4 000 rays, seed 21; tolerance none. 70 parts need a top level of two levels.
    let mesh = soup(&mut Random(20), 700, 0.3);
    let whole = build(&mesh);
    for count in [1, 2, 7, 70] {
        let scene = SceneBvh::build(&mesh.0, &mesh.1, &pieces(mesh.1.len() as u32, count));
        scene.validate().unwrap();
        assert_eq!(scene.bounds(), whole.bounds());
        for scene in on_every_path(&scene) {
            for ray in rays(21) {
                assert_eq!(scene.closest(&ray), whole.closest(&ray));
                assert_eq!(scene.occluded(&ray), whole.occluded(&ray));
            }
        }
    }
}

#[test]
fn any_number_of_threads_builds_the_same_bits() {
    // 12 parts of 0 to 1 300 triangles, not in the order of their sizes; 1, 2 and 5 threads; tolerance none.
    let mesh = soup(&mut Random(70), 4_000, 0.2);
    let ends = [0, 7, 1_300, 1_300, 1_301, 1_400, 2_600, 2_650, 3_000, 3_001, 3_020, 3_900, 4_000];
    let parts: Vec<_> = ends.windows(2).map(|ends| ends[0]..ends[1]).collect();
    let built = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| SceneBvh::build(&mesh.0, &mesh.1, &parts))
    };
    let one = built(1);
    one.validate().unwrap();
    assert!(one.parts.iter().map(|part| &part.range).eq(&parts));
    for threads in [2, 5] {
        let scene = built(threads);
        assert_eq!(bytes(&scene.top), bytes(&one.top), "{threads} threads");
        for (part, one) in scene.parts.iter().zip(&one.parts) {
            assert_eq!(part.range, one.range, "{threads} threads");
            assert_eq!(bytes(&part.bvh.nodes), bytes(&one.bvh.nodes), "{threads} threads");
            assert_eq!(bytes(&part.bvh.packets), bytes(&one.bvh.packets), "{threads} threads");
        }
    }
}

/// Bits, as coordinates of unused lanes are NaN.
fn bytes<T: bytemuck::Pod>(list: &[T]) -> &[u8] {
    bytemuck::cast_slice(list)
}

#[test]
fn a_rebuilt_part_equals_a_fresh_scene_and_leaves_clones_alone() {
    let mut mesh = soup(&mut Random(30), 300, 0.3);
    let parts = pieces(300, 3);
    let mut scene = SceneBvh::build(&mesh.0, &mesh.1, &parts);
    let before = scene.clone();
    let old: Vec<_> = rays(31).map(|ray| before.closest(&ray)).collect();
    let moved: Vec<u32> = mesh.1[100..200].iter().flatten().copied().collect();
    let mut seen = vec![false; mesh.0.len()];
    for i in moved {
        if !std::mem::replace(&mut seen[i as usize], true) {
            mesh.0[i as usize] += Vec3::splat(0.7);
        }
    }
    for part in 0..parts.len() {
        scene.rebuild_part(part, &mesh.0, &mesh.1);
        scene.validate().unwrap();
    }
    scene.rebuild_part(99, &mesh.0, &mesh.1);
    let fresh = build(&mesh);
    assert_eq!(scene.bounds(), fresh.bounds());
    assert!(rays(31).all(|ray| scene.closest(&ray) == fresh.closest(&ray)));
    assert!(rays(31).zip(old).all(|(ray, old)| before.closest(&ray) == old));
}

#[test]
fn an_object_that_moves_elsewhere_changes_no_bit_of_other_hits() {
    // Paths that never met the object are kept, so their hits must not depend on the scene's extent.
    let (vertices, triangles) = cube(6);
    let scene = SceneBvh::build(&vertices, &triangles, &[0..triangles.len() as u32]);
    let mut vertices = vertices;
    let mut triangles = triangles;
    let still = triangles.len() as u32;
    let base = vertices.len() as u32;
    vertices.extend(cube(1).0.iter().map(|v| *v + Vec3::splat(1e5)));
    triangles.extend(cube(1).1.iter().map(|t| t.map(|i| i + base)));
    let with_object = SceneBvh::build(&vertices, &triangles, &[0..still, still..triangles.len() as u32]);
    for ray in rays(40) {
        let ray = Ray { origin: ray.origin * 0.6, ..ray };
        assert_eq!(scene.closest(&ray), with_object.closest(&ray));
    }
}

#[test]
fn rebuilding_shares_the_other_parts() {
    let mesh = soup(&mut Random(50), 100, 0.3);
    let scene = SceneBvh::build(&mesh.0, &mesh.1, &[0..50, 50..100]);
    let mut next = scene.clone();
    next.rebuild_part(1, &mesh.0, &mesh.1);
    assert!(Arc::ptr_eq(&scene.parts[0].bvh, &next.parts[0].bvh));
    assert!(!Arc::ptr_eq(&scene.parts[1].bvh, &next.parts[1].bvh));
}

#[test]
fn validate_notices_what_is_broken() {
    let mesh = soup(&mut Random(60), 400, 0.3);
    let whole = build(&mesh);
    let broken = |change: fn(&mut crate::bvh::Bvh)| {
        let mut scene = whole.clone();
        change(Arc::make_mut(&mut scene.parts[0].bvh));
        scene.validate().unwrap_err()
    };
    assert!(matches!(broken(|b| b.nodes.short()[0].children.0[0] = 9_999), BvhError::Reference { .. }));
    assert!(matches!(broken(|b| b.nodes.short()[0].bounds[1][1].0[0] -= 0.5), BvhError::NotEnclosed { .. }));
    assert!(matches!(broken(|b| b.packets.short()[3].ids.0[0] = 100_000), BvhError::Triangle { .. }));
    assert!(matches!(broken(|b| b.triangles += 1), BvhError::TriangleCount { .. }));
    assert!(matches!(
        broken(|b| {
            let node = b.nodes[0];
            b.nodes.short().push(node)
        }),
        BvhError::Unreached { .. }
    ));
    assert!(matches!(
        broken(|b| {
            let packet = b.packets[0];
            b.packets.short().push(packet)
        }),
        BvhError::Unreached { .. }
    ));
    let mut lost = whole.clone();
    lost.root = crate::bvh::node::NONE;
    assert!(matches!(lost.validate(), Err(BvhError::PartMissing { part: 0 })));
}
