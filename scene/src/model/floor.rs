//! Turns what lies on nothing into what stands on a floor, which gives it light from below.

use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;

/// Rays from above, along each horizontal axis.
const RAYS: u32 = 16;
/// A model whose lowest surfaces are seen from above in this share of its footprint has a floor of its own.
const OWN_FLOOR: f32 = 0.4;
/// Half the edge of a floor, in half diagonals of what stands on it.
const WIDTH: f32 = 2.5;

/// A level square, in the scene's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Floor {
    pub(super) centre: Vec3,
    pub(super) half: f32,
}

impl Floor {
    /// A floor for a scene that is seen from outside, unless it has one.
    pub(super) fn below(scene: &Scene, choices: &mut Vec<String>) -> Option<Self> {
        let (low, high) = scene.bvh.bounds();
        let extent = high - low;
        let ground = low.y + (0.05 * extent.y).max(1e-3 * extent.max_element());
        let at = |i: u32| (i as f32 + 0.5) / RAYS as f32;
        let is_ground = |i: &u32| {
            let share = Vec3::new(at(i % RAYS), 0.0, at(i / RAYS));
            let mut origin = low + extent * share;
            origin.y = high.y + extent.max_element();
            let hit = scene.bvh.closest(&Ray { origin, direction: Vec3::NEG_Y, t_max: f32::INFINITY });
            hit.is_some_and(|hit| origin.y - hit.t <= ground)
        };
        let covered = (0..RAYS * RAYS).filter(is_ground).count() as f32 / (RAYS * RAYS) as f32;
        if covered >= OWN_FLOOR {
            return None;
        }
        choices.push("floor: a grey one was added below it, which had nothing to stand on".into());
        let half = (0.5 * WIDTH * Vec3::new(extent.x, 0.0, extent.z).length()).max(0.5 * extent.y);
        let mut centre = (low + high) * 0.5;
        // Below a flat base, not in it.
        centre.y = low.y - 1e-4 * extent.max_element();
        Some(Self { centre, half })
    }

    pub(super) fn area_sq_m(&self) -> f64 {
        4.0 * f64::from(self.half) * f64::from(self.half)
    }
}
