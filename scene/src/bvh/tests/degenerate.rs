//! Turns meshes and rays that carry no information into absence of hits and of panics.

use glam::{Vec3, vec3};

use super::shapes::{Mesh, Random, build, cube, moved, on_every_path, soup};
use crate::bvh::{MAX_COORDINATE, Ray, SceneBvh};

const ALONG_X: Ray = Ray { origin: vec3(-3.0, 0.1, 0.2), direction: Vec3::X, t_max: f32::INFINITY };

fn triangle() -> Mesh {
    (vec![vec3(0.0, -1.0, -1.0), vec3(0.0, 1.0, -1.0), vec3(0.0, 0.0, 1.0)], vec![[0, 1, 2]])
}

#[test]
fn nothing_is_hit_where_nothing_is() {
    for parts in [&[][..], &[0..0], &[0..0, 0..0], &[0..7]] {
        let scene = SceneBvh::build(&[], &[], parts);
        scene.validate().unwrap();
        assert_eq!(scene.closest(&ALONG_X), None);
        assert!(!scene.occluded(&ALONG_X));
        assert_eq!(scene.bounds(), (Vec3::ZERO, Vec3::ZERO));
    }
}

#[test]
fn one_triangle_is_hit_from_both_sides() {
    let scene = build(&triangle());
    assert_eq!(scene.closest(&ALONG_X).unwrap().t, 3.0);
    let back = Ray { origin: vec3(2.0, 0.0, 0.0), direction: -Vec3::X, t_max: f32::INFINITY };
    assert_eq!(scene.closest(&back).unwrap().t, 2.0);
    assert_eq!(scene.bounds(), (vec3(0.0, -1.0, -1.0), vec3(0.0, 1.0, 1.0)));
}

#[test]
fn thousands_of_copies_make_a_shallow_tree_and_one_answer() {
    let (vertices, _) = triangle();
    let mesh = (vertices, vec![[0, 1, 2]; 20_000]);
    for scene in on_every_path(&build(&mesh)) {
        assert_eq!(scene.closest(&ALONG_X).unwrap().triangle, 0);
    }
}

#[test]
fn zero_area_foreign_and_infinite_triangles_are_left_out_and_counted() {
    let (mut vertices, mut triangles) = triangle();
    vertices.extend([
        Vec3::ZERO,
        vec3(0.0, 0.5, 0.0),
        vec3(0.0, 1.0, 0.0),
        Vec3::splat(f32::NAN),
        Vec3::splat(f32::INFINITY),
        Vec3::splat(MAX_COORDINATE * 2.0),
    ]);
    triangles.extend([
        [0, 0, 1],
        [3, 3, 3],
        [3, 4, 5],
        [0, 1, 6],
        [0, 1, 7],
        [0, 1, 8],
        [0, 1, 99],
        [u32::MAX; 3],
    ]);
    let mesh = (vertices, triangles);
    let scene = build(&mesh);
    assert_eq!(scene.ignored(), 8);
    assert_eq!(scene.closest(&ALONG_X).unwrap().triangle, 0);
    let towards_line = Ray { origin: vec3(-3.0, 0.25, 0.0), ..ALONG_X };
    assert_eq!(scene.closest(&towards_line).unwrap().triangle, 0);
}

#[test]
fn rays_without_sense_hit_nothing() {
    let scene = build(&cube(3));
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    for scene in on_every_path(&scene) {
        for (bad, axis) in bad.into_iter().flat_map(|bad| [0, 1, 2].map(|axis| (bad, axis))) {
            let good =
                Ray { origin: Vec3::splat(0.1), direction: vec3(1.0, 0.5, 0.25), t_max: f32::INFINITY };
            assert!(scene.occluded(&good));
            let (mut origin, mut direction) = (good, good);
            origin.origin[axis] = bad;
            direction.direction[axis] = bad;
            assert_eq!(scene.closest(&origin), None);
            assert_eq!(scene.closest(&direction), None);
            assert!(!scene.occluded(&Ray { direction: Vec3::ZERO, ..good }));
            for t_max in [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0, -0.0] {
                assert!(!scene.occluded(&Ray { t_max, ..good }));
            }
            assert!(!scene.occluded(&Ray { origin: Vec3::splat(-1e30), direction: Vec3::ONE, ..good }));
        }
    }
}

#[test]
fn directions_of_any_length_give_the_same_hit() {
    // Powers of two are exact, so the distance must be too; the ends are the smallest and largest normal lengths.
    let scene = build(&soup(&mut Random(5), 200, 0.8));
    let mut random = Random(6);
    let mut hits = 0;
    for _ in 0..2_000 {
        let ray = Ray { origin: random.in_cube(), direction: random.in_cube(), t_max: f32::INFINITY };
        let Some(hit) = scene.closest(&ray) else { continue };
        hits += 1;
        for exponent in [-100, -40, -1, 1, 40, 100] {
            let scale = 2.0f32.powi(exponent);
            let scaled = scene.closest(&Ray { direction: ray.direction * scale, ..ray }).unwrap();
            assert_eq!((scaled.t * scale, scaled.triangle), (hit.t, hit.triangle));
        }
    }
    assert!(hits > 500);
}

#[test]
fn a_part_in_a_thousand_of_the_scene_is_found() {
    // Teapot in a stadium: a box of 10⁻³ m inside one of 10⁴ m; rays from within end on the small one.
    let small = moved(&cube(4), 1e-3, vec3(7.0, -3.0, 2.0));
    let mut mesh = moved(&cube(4), 1e4, Vec3::ZERO);
    let base = mesh.0.len() as u32;
    let first = mesh.1.len() as u32;
    mesh.0.extend(&small.0);
    mesh.1.extend(small.1.iter().map(|t| t.map(|i| i + base)));
    let scene = build(&mesh);
    let mut random = Random(8);
    for _ in 0..2_000 {
        let ray = Ray { origin: vec3(7.0, -3.0, 2.0), direction: random.in_cube(), t_max: f32::INFINITY };
        assert!(scene.closest(&ray).unwrap().triangle >= first);
    }
}

#[test]
fn sizes_in_geometric_progression_stay_within_the_depth_bound() {
    // Shells that enclose each other from 10⁻¹² m to 10¹² m: every cut peels few off, the binary tree is a comb.
    let mut mesh = Mesh::default();
    for i in 0..2_000 {
        let shell = moved(&triangle(), 10.0f32.powf(-12.0 + 24.0 * i as f32 / 2_000.0), Vec3::ZERO);
        let base = mesh.0.len() as u32;
        mesh.0.extend(shell.0);
        mesh.1.push([base, base + 1, base + 2]);
    }
    for scene in on_every_path(&build(&mesh)) {
        // All lie in the plane x = 0; numbers rise with size.
        let through = |y: f32| {
            let ray = Ray { origin: vec3(-1.0, y, 0.0), direction: Vec3::X, t_max: f32::INFINITY };
            scene.closest(&ray).unwrap().triangle
        };
        assert_eq!(through(0.0), 0);
        assert!(through(1e-6) < through(1.0) && through(1.0) < through(1e6));
    }
}
