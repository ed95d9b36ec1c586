//! Turns a place and a normal into how far it lies below the surface that it stands for: shadow rays to it end in the dark.

use crate::{
    bvh::Ray,
    scene::{Scene, Side, Sides},
};
use glam::Vec3;

/// A surface is looked for up to so far above a place, relative to the radius of the scene.
const DEEPEST: f32 = 5e-2;

/// The same for what reflects on both sides: farther above, it may as well be a leaf or a cloth over the right surface.
const DEEPEST_BELOW_SHEETS: f32 = 1e-3;

/// What is not so far below a surface is on it, relative to the radius: roundings, half of what shadow rays end short by.
const ON_SURFACE: f32 = 2e-6;

/// So often a place is raised: above one surface there may be another.
const MOST_SURFACES: usize = 8;

impl Scene {
    /// How far `position` lies below a surface that reflects to where the unit vector `normal` points, m; `None` where it is
    /// on the surface or above it.
    pub(crate) fn depth_below_surface(&self, position: Vec3, normal: Vec3) -> Option<f32> {
        let radius = self.bounds.radius;
        let ray = Ray { origin: position, direction: normal, t_max: DEEPEST * radius };
        let hit = self.bvh.closest(&ray)?;
        let front = self.geometry.normals[hit.triangle as usize];
        let lit = if front.dot(normal) > 0.0 { Side::Front } else { Side::Back };
        let sides = self.objects[self.geometry.object_of[hit.triangle as usize].0 as usize].sides;
        let deepest = if sides == Sides::Both { DEEPEST_BELOW_SHEETS } else { DEEPEST };
        let is_below = sides.contains(lit) && (ON_SURFACE * radius..deepest * radius).contains(&hit.t);
        is_below.then_some(hit.t)
    }

    /// `position`, moved along `normal` onto the surface that it lies below, if it does.
    pub(crate) fn raised_onto_surface(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let mut position = position;
        for _ in 0..MOST_SURFACES {
            let Some(depth) = self.depth_below_surface(position, normal) else { break };
            position += normal * depth;
        }
        position
    }
}
