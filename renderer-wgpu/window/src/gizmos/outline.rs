//! Turns spheres, boxes and hulls into lines in space, and those into lines of the picture.

use crate::{navigation::project, picking::Eye};
use glam::{DAffine3, DVec3, Vec3};
use photonstream_scene::vpls::ProxyShape;

/// Corners of a circle.
const CORNERS: usize = 40;

/// A line from one point to another, in metres from the scene's origin.
pub(super) type Line = [Vec3; 2];

/// A circle about `centre` in the plane of two vectors of its radius.
pub(super) fn circle(centre: Vec3, u: Vec3, v: Vec3) -> Vec<Line> {
    let corner = |i: usize| {
        let (sin, cos) = (i as f32 * (core::f32::consts::TAU / CORNERS as f32)).sin_cos();
        centre + u * cos + v * sin
    };
    (0..CORNERS).map(|i| [corner(i), corner(i + 1)]).collect()
}

/// The rim of a sphere as it is seen from `eye`; nothing from within.
pub(super) fn rim(eye: Vec3, centre: Vec3, radius: f32) -> Vec<Line> {
    let way = centre - eye;
    let distance = way.length();
    if distance <= radius {
        return Vec::new();
    }
    let forward = way / distance;
    let (u, v) = forward.any_orthonormal_pair();
    // Where the rays that touch the sphere do so.
    let sine = radius / distance;
    let at = centre - forward * (radius * sine);
    let wide = radius * (1.0 - sine * sine).sqrt();
    circle(at, u * wide, v * wide)
}

/// The three great circles of a sphere whose axes are those of `map`, of which `map` leads to the scene.
pub(super) fn great_circles(map: &DAffine3, radius: f64) -> Vec<Line> {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z]
        .map(|axis| (map.transform_vector3(axis).normalize_or(axis) * radius).as_vec3());
    let centre = map.translation.as_vec3();
    [(x, y), (y, z), (z, x)].into_iter().flat_map(|(u, v)| circle(centre, u, v)).collect()
}

/// The edges of a body whose own space `map` leads from.
pub(super) fn body(map: &DAffine3, shape: &ProxyShape) -> Vec<Line> {
    let line = |(a, b): (DVec3, DVec3)| [a, b].map(|p| map.transform_point3(p).as_vec3());
    match shape {
        ProxyShape::Cuboid { centre, half } => {
            let corner = |i: i32| {
                let sign = |bit: i32| f64::from(i >> bit & 1) * 2.0 - 1.0;
                *centre + *half * DVec3::new(sign(0), sign(1), sign(2))
            };
            let edges = (0..8).flat_map(|i| (0..3).map(move |bit| (i, i | 1 << bit)));
            edges.filter(|(a, b)| a != b).map(|(a, b)| line((corner(a), corner(b)))).collect()
        }
        ProxyShape::Sphere { radius } => great_circles(map, *radius),
        ProxyShape::Hull { points, planes } => hull_edges(points, planes).into_iter().map(line).collect(),
    }
}

/// The edges of a hull: pairs of its points that share two planes.
fn hull_edges(points: &[DVec3], planes: &[(DVec3, f64)]) -> Vec<(DVec3, DVec3)> {
    let extent = points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max);
    let is_in = |p: DVec3, (normal, offset): &(DVec3, f64)| (normal.dot(p) - offset).abs() <= 1e-6 * extent;
    let mut edges = Vec::new();
    for (i, &a) in points.iter().enumerate() {
        let of_a: Vec<_> = planes.iter().filter(|plane| is_in(a, plane)).collect();
        for &b in &points[i + 1..] {
            if of_a.iter().filter(|plane| is_in(b, plane)).count() >= 2 {
                edges.push((a, b));
            }
        }
    }
    edges
}

/// Lines as they are seen: without what is behind the camera or nearer than `near`, in pixels, and without those beside
/// the picture.
pub(super) fn segments(eye: &Eye<'_>, lines: &[Line], near: f32) -> Vec<[[f32; 2]; 2]> {
    lines.iter().filter_map(|line| segment(eye, *line, near)).collect()
}

fn segment(eye: &Eye<'_>, [a, b]: Line, near: f32) -> Option<[[f32; 2]; 2]> {
    let depth = |p: Vec3| (p - eye.camera.position).dot(eye.camera.forward);
    let (da, db) = (depth(a), depth(b));
    let cut = |from: Vec3, to: Vec3, d_from: f32, d_to: f32| {
        if d_from >= near { from } else { from + (to - from) * ((near - d_from) / (d_to - d_from)) }
    };
    if da < near && db < near {
        return None;
    }
    let seen = |p| project(eye.camera, p, eye.width, eye.height);
    let ends = [seen(cut(a, b, da, db))?, seen(cut(b, a, db, da))?];
    let [p, q] = ends;
    let beside = |axis: usize, size: u32| p[axis].max(q[axis]) < 0.0 || p[axis].min(q[axis]) > size as f32;
    (!beside(0, eye.width) && !beside(1, eye.height)).then_some(ends)
}
