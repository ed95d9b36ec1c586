//! Turns rays from a point in a scene into what surrounds it: nothing, the inside of a body, or a room.

use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;
use photonstream_shading::{sampling, sobol::Sequence};

/// Rays from a point, spread over the sphere.
const RAYS: u64 = 64;
/// Points of the middle third of a scene's box, along each axis.
const POINTS: u32 = 4;

/// What rays in all directions from one point meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    /// Share of the rays that leave the scene.
    pub(super) escape: f32,
    /// Share of the hits that are on fronts.
    pub(super) fronts: f32,
    /// Distance to the nearest hit, m.
    pub(super) nearest: f32,
}

impl Surroundings {
    pub(super) fn of(scene: &Scene, point: Vec3) -> Self {
        let (mut hits, mut fronts, mut nearest) = (0u32, 0u32, f32::INFINITY);
        for index in 0..RAYS {
            let direction = sampling::sphere(Sequence::new(11, 0).sample(index).next_2d());
            let ray = Ray { origin: point, direction, t_max: f32::INFINITY };
            let Some(hit) = scene.bvh.closest(&ray) else { continue };
            hits += 1;
            fronts += u32::from(scene.geometry.normals[hit.triangle as usize].dot(direction) < 0.0);
            nearest = nearest.min(hit.t);
        }
        Self { escape: 1.0 - hits as f32 / RAYS as f32, fronts: fronts as f32 / hits.max(1) as f32, nearest }
    }

    /// Whether the point is in a room: few rays leave, and most surfaces face the point, unlike from within a body.
    pub(super) fn is_room(&self) -> bool {
        self.escape < 0.3 && self.fronts > 0.6
    }
}

/// Whether a scene is a room or has one in its middle: a quarter of 64 points there are in one.
pub(super) fn is_interior(scene: &Scene) -> bool {
    let (low, high) = scene.bvh.bounds();
    let along = |i: u32| (1.0 + (i as f32 + 0.5) / POINTS as f32) / 3.0;
    let points = (0..POINTS.pow(3)).map(|i| {
        let share = Vec3::new(along(i % POINTS), along(i / POINTS % POINTS), along(i / POINTS / POINTS));
        low + (high - low) * share
    });
    let rooms = points.filter(|point| Surroundings::of(scene, *point).is_room()).count() as u32;
    4 * rooms >= POINTS.pow(3)
}
