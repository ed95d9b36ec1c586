//! Turns closed meshes and rays aimed at their edges and vertices into proof that none escapes.

use glam::{Vec3, vec3};

use super::shapes::{Mesh, Random, build, cube, moved, on_every_path, sphere};
use crate::bvh::Ray;

const RAYS: usize = 125_000;

/// Rays from inside towards points exactly on edges, on vertices, and within an ulp of them.
fn no_ray_escapes(mesh: &Mesh, scale: f32, offset: f32) {
    let offset = Vec3::splat(offset);
    let mesh = moved(mesh, scale, offset);
    for scene in on_every_path(&build(&mesh)) {
        let mut random = Random(42);
        for _ in 0..RAYS {
            let origin = offset + random.in_cube() * 0.5 * scale;
            let [a, b, _] = mesh.1[random.below(mesh.1.len())].map(|i| mesh.0[i as usize]);
            let mut target = match random.below(4) {
                0 => a,
                1 => (a + b) * 0.5,
                _ => a + (b - a) * random.unit(),
            };
            if random.below(3) == 0 {
                let axis = random.below(3);
                target[axis] =
                    if random.below(2) == 0 { target[axis].next_up() } else { target[axis].next_down() };
            }
            let ray = Ray { origin, direction: target - origin, t_max: f32::INFINITY };
            assert!(scene.occluded(&ray), "{} {ray:?}", scene.instruction_set());
            assert!(scene.closest(&ray).is_some(), "{} {ray:?}", scene.instruction_set());
        }
    }
}

// Together N = 8 × 125 000 = 10⁶ rays on each path, seed 42; tolerance none: an escape is light lost.
#[test]
fn nothing_escapes_a_sphere() {
    no_ray_escapes(&sphere(40, 60), 1.0, 0.0);
    no_ray_escapes(&sphere(40, 60), 1e-4, 0.0);
    no_ray_escapes(&sphere(40, 60), 1e4, 0.0);
}

#[test]
fn nothing_escapes_a_sphere_far_from_the_origin() {
    no_ray_escapes(&sphere(40, 60), 1.0, 3000.0);
}

#[test]
fn nothing_escapes_a_box() {
    // Thirds are not representable: every inner vertex is rounded.
    no_ray_escapes(&cube(9), 1.0, 0.0);
    no_ray_escapes(&cube(9), 1e-4, 0.0);
    no_ray_escapes(&cube(9), 1e4, 0.0);
}

#[test]
fn nothing_escapes_a_box_far_from_the_origin() {
    no_ray_escapes(&cube(9), 1.0, 3000.0);
}

#[test]
fn rays_exactly_along_axes_edges_and_diagonals_hit() {
    for scene in on_every_path(&build(&cube(4))) {
        // From lattice points of the mesh's own planes, so that every test meets edges and vertices exactly.
        for i in 0..27 {
            let origin = vec3((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32) * 0.5 - 0.5;
            for j in (0..27).filter(|j| *j != 13) {
                let direction = vec3((j % 3) as f32, (j / 3 % 3) as f32, (j / 9) as f32) - 1.0;
                let hit = scene.closest(&Ray { origin, direction, t_max: f32::INFINITY }).unwrap();
                let point = origin + direction * hit.t;
                // Dyadic coordinates and distances: the sums are exact.
                assert_eq!(point.abs().max_element(), 1.0, "{origin} {direction} {hit:?}");
            }
        }
    }
}
