//! Turns a point of free space into many, each half the free distance along a random direction from one before.

use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;
use photonstream_shading::{LightShape, sampling, sobol::Sequence};

/// Directions tried for one point: in the open most of them meet nothing.
const TRIES: u32 = 64;

/// `start` and up to `count` points beyond it, each reached from any of those before, and not from the last alone: in the
/// open, where only surfaces stop a step, that would come ever closer to one. Along directions without end no step is
/// taken, so that all stays among the surfaces.
pub(super) fn explore(scene: &Scene, start: Vec3, count: u32, sequence: Sequence) -> Vec<Vec3> {
    let mut points = vec![start];
    for step in 0..count {
        let mut sample = sequence.sample(u64::from(step));
        let here = points[(sample.next_1d() * points.len() as f32) as usize];
        let free = (0..TRIES).find_map(|_| {
            let direction = sampling::sphere(sample.next_2d());
            let hit = scene.bvh.closest(&Ray { origin: here, direction, t_max: f32::INFINITY })?;
            Some(direction * (0.5 * hit.t))
        });
        points.extend(free.map(|free| here + free));
    }
    points
}

/// Where the lights stand that stand somewhere: not those infinitely far away, nor surfaces of many triangles, which are
/// found as surfaces.
pub(super) fn of_lights(scene: &Scene) -> Vec<Vec3> {
    let position = |shape: &LightShape| match *shape {
        LightShape::Point { position } | LightShape::Spot { position, .. } => Some(position),
        LightShape::Parallelogram { corner, edge_u, edge_v } => {
            Some(corner + (edge_u + edge_v) * 0.5 + lift(edge_u, edge_v))
        }
        LightShape::Triangle { corner, edge_u, edge_v } => {
            Some(corner + (edge_u + edge_v) / 3.0 + lift(edge_u, edge_v))
        }
        LightShape::Directional { .. } | LightShape::Mesh { .. } | LightShape::Sky { .. } => None,
    };
    scene.lights.iter().filter_map(|light| position(&light.light.shape)).collect()
}

/// From a lamp's surface to just before it: a hundredth of its size.
fn lift(edge_u: Vec3, edge_v: Vec3) -> Vec3 {
    let normal = edge_u.cross(edge_v);
    normal.normalize_or_zero() * (0.01 * normal.length().sqrt())
}
