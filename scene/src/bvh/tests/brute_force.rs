//! Turns random soups and rays into exact agreement between the walk and a loop over all triangles.

use glam::{DVec3, Vec3, vec3};

use super::shapes::{Mesh, Random, build, cube, moved, on_every_path, soup, sphere};
use crate::bvh::ray_frame::RayFrame;
use crate::bvh::triangle::{Nearest, is_solid, resolve};
use crate::bvh::{Hit, Ray};

fn corners(mesh: &Mesh, id: usize) -> [Vec3; 3] {
    mesh.1[id].map(|i| mesh.0[i as usize])
}

/// Minimum of (t, id) over all triangles, by the structure's own triangle test and nothing else of it.
fn loop_over_all(mesh: &Mesh, ray: &Ray) -> Option<Hit> {
    // The frame's bounds affect node tests only.
    let frame = RayFrame::new(ray, Vec3::ZERO, Vec3::ZERO)?;
    let mut nearest = Nearest::none(frame.t_max);
    for id in 0..mesh.1.len() {
        let corners = corners(mesh, id);
        if is_solid(&corners)
            && let Some(hit) = resolve(&frame, &corners.map(|v| v.to_array()))
        {
            nearest.offer(id as u32, hit);
        }
    }
    nearest.found.then_some(Hit {
        t: nearest.t * frame.t_scale,
        u: nearest.u,
        v: nearest.v,
        triangle: nearest.id,
    })
}

/// Origins inside, outside and on the mesh; directions random, towards vertices and edges, along axes, of any length.
fn ray(random: &mut Random, mesh: &Mesh, scale: f32, offset: Vec3) -> Ray {
    let vertex = |random: &mut Random| mesh.0[random.below(mesh.0.len())];
    let mut origin = random.in_cube() * 2.0 * scale + offset;
    if random.below(8) == 0 {
        origin = vertex(random);
    }
    let mut direction = match random.below(6) {
        0 => vertex(random) - origin,
        1 => {
            let [a, b, _] = corners(mesh, random.below(mesh.1.len()));
            a + (b - a) * random.unit() - origin
        }
        2 => {
            let mut axis = Vec3::ZERO;
            axis[random.below(3)] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            axis
        }
        3 => {
            let mut flat = random.in_cube();
            flat[random.below(3)] = if random.below(2) == 0 { 0.0 } else { f32::from_bits(1) };
            flat
        }
        _ => random.in_cube(),
    };
    direction *= [1.0, 1.0, 1e-30, 1e30, 1e-3, 1e4][random.below(6)];
    let t_max = match random.below(4) {
        0 => random.unit() * 2.0 * scale / direction.length(),
        1 => 1.0,
        _ => f32::INFINITY,
    };
    Ray { origin, direction, t_max }
}

/// Every path of the processor gives the loop's (t, u, v, id) bit for bit; `occluded` says the same as `closest`.
fn compare(mesh: &Mesh, seed: u64, rays: usize, scale: f32, offset: Vec3) {
    let scene = build(mesh);
    let paths = on_every_path(&scene);
    let mut random = Random(seed);
    let mut hits = 0;
    for _ in 0..rays {
        let ray = ray(&mut random, mesh, scale, offset);
        let expected = loop_over_all(mesh, &ray);
        hits += usize::from(expected.is_some());
        for path in &paths {
            let name = path.instruction_set();
            assert_eq!(path.closest(&ray), expected, "{name}: {ray:?}");
            assert_eq!(path.occluded(&ray), expected.is_some(), "{name}: {ray:?}");
        }
    }
    assert!(hits > rays / 20 && hits < rays, "the rays test nothing: {hits} of {rays} hit");
}

#[test]
fn random_soups_agree_with_a_loop_exactly() {
    // N = 5 sizes × 8 000 rays, seeds 1..=5; tolerance none: the promise is exact equality, ties included.
    for (seed, (count, size)) in
        [(5, 1.0), (40, 0.5), (300, 0.2), (1000, 0.1), (600, 2.0)].into_iter().enumerate()
    {
        let mesh = soup(&mut Random(seed as u64 + 1), count, size);
        compare(&mesh, seed as u64, 8_000, 1.0, Vec3::ZERO);
    }
}

#[test]
fn coplanar_grids_and_spheres_agree_with_a_loop_exactly_at_any_scale_and_place() {
    // N = 8 × 4 000 rays, seed 7; tolerance none. Walls give ties on shared edges and boxes without thickness.
    for mesh in [cube(8), sphere(16, 24)] {
        for (scale, offset) in [(1.0, 0.0), (1.0, 3000.0), (1e-4, 0.0), (1e4, 0.0)] {
            let offset = Vec3::splat(offset);
            compare(&moved(&mesh, scale, offset), 7, 4_000, scale, offset);
        }
    }
}

#[test]
fn nested_slivers_agree_with_a_loop_exactly() {
    // N = 4 000 rays, seed 11; tolerance none. Aspect 1 : 10⁶, crossing, sharing vertices.
    let mut random = Random(11);
    let mut mesh = Mesh::default();
    for i in 0..400u32 {
        let a = random.in_cube();
        let along = random.in_cube();
        mesh.0.extend([a, a + along, a + along * 0.5 + random.in_cube() * 1e-6]);
        mesh.1.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh.0.extend(cube(1).0);
    mesh.1.extend(cube(1).1.iter().map(|t| t.map(|i| i + 1200)));
    compare(&mesh, 11, 4_000, 1.0, Vec3::ZERO);
}

#[test]
fn distances_and_barycentrics_match_double_precision() {
    // N = 20 000 rays, seed 3. Tolerance: vertices move by ≤ 6 round-offs of the distance (≤ 6), the hit point along
    // the plane by that over the cosine; compared as points against the plane for cosines ≥ 0.1: 6·6·2⁻²⁴/0.1 = 2e-5.
    let mesh = soup(&mut Random(3), 500, 0.5);
    let scene = build(&mesh);
    let mut random = Random(4);
    let mut compared = 0;
    for _ in 0..20_000 {
        let (origin, direction) = (random.in_cube() * 2.0, random.in_cube().normalize_or(Vec3::X));
        let Some(hit) = scene.closest(&Ray { origin, direction, t_max: f32::INFINITY }) else { continue };
        let [a, b, c] = corners(&mesh, hit.triangle as usize).map(DVec3::from);
        let normal = (b - a).cross(c - a).normalize();
        let (origin, direction) = (DVec3::from(origin), DVec3::from(direction));
        let cosine = normal.dot(direction);
        if cosine.abs() < 0.1 {
            continue;
        }
        compared += 1;
        let t = (a - origin).dot(normal) / cosine;
        assert!((t - f64::from(hit.t)).abs() < 2e-5, "{t} {hit:?}");
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        assert!(u >= -1e-6 && v >= -1e-6 && u + v <= 1.0 + 1e-6);
        let point = a * (1.0 - u - v) + b * u + c * v;
        assert!(point.distance(origin + direction * t) < 2e-5, "{point} {hit:?}");
    }
    assert!(compared > 5_000, "{compared}");
}

#[test]
fn the_lowest_number_wins_among_equal_distances() {
    // Three copies of one triangle and one turned inside out, on the left of 100 others.
    let mut mesh = soup(&mut Random(9), 100, 0.1);
    let base = mesh.0.len() as u32;
    mesh.0.extend([vec3(-5.0, -1.0, -1.0), vec3(-5.0, 1.0, -1.0), vec3(-5.0, 0.0, 1.0)]);
    let first = mesh.1.len() as u32;
    mesh.1.extend([[base, base + 2, base + 1], [base, base + 1, base + 2], [base, base + 1, base + 2]]);
    for path in on_every_path(&build(&mesh)) {
        let hit = path
            .closest(&Ray { origin: vec3(-9.0, 0.0, 0.0), direction: Vec3::X, t_max: f32::INFINITY })
            .unwrap();
        assert_eq!((hit.t, hit.triangle), (4.0, first));
    }
}

#[test]
fn segment_ends_are_excluded() {
    let scene = build(&cube(2));
    let towards = |t_max| Ray { origin: Vec3::splat(0.1), direction: vec3(0.9, 0.0, 0.0), t_max };
    assert_eq!(scene.closest(&towards(f32::INFINITY)).unwrap().t, 1.0);
    assert!(!scene.occluded(&towards(1.0)));
    assert!(scene.occluded(&towards(1.0f32.next_up())));
    let on_wall = Ray { origin: vec3(1.0, 0.1, 0.2), direction: Vec3::X, t_max: f32::INFINITY };
    assert_eq!(scene.closest(&on_wall), None, "distance 0 does not count");
}
