//! Turns two versions of a scene into what the step from one to the other means for the paths of each light.

use crate::simulation::Simulation;
use glam::Vec3;
use std::sync::Arc;

/// What a new version of the scene means for the paths of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRevision {
    /// Its paths stand for the old version and have to be traced again.
    pub stale: bool,
    /// What its old deposits are multiplied by to stand for the same light in the new version's units until then.
    pub factor: Vec3,
}

impl LightRevision {
    /// Nothing to do.
    pub const NONE: Self = Self { stale: false, factor: Vec3::ONE };
}

/// The revision of each light, in their order, from `old` to `new`, a version of it.
///
/// A moved object makes all paths stale, a moved light its own. The power of a light with a column of its own is a factor
/// of that column: no path is stale. In a shared column it weighs the light's paths against those of the others.
pub fn revisions(old: &Simulation, new: &Simulation) -> Vec<LightRevision> {
    let moved = !Arc::ptr_eq(&old.scene.geometry, &new.scene.geometry);
    let lights = old.scene.lights.iter().zip(&new.scene.lights);
    let slots = old.emitters.lights.iter().zip(&new.emitters.lights);
    lights
        .zip(slots)
        .map(|((old, new), (old_slots, new_slots))| {
            let weighed_anew = old_slots.birth != new_slots.birth;
            let stale = moved || old.light.shape != new.light.shape || weighed_anew;
            let watts = if old_slots.watts_per_power == new_slots.watts_per_power {
                1.0
            } else {
                old_slots.watts_per_power / new_slots.watts_per_power
            };
            let ratio = |old: f32, new: f32| match (old, new) {
                (old, new) if old == new => 1.0,
                (0.0, _) => 0.0,
                (old, new) => new / old,
            };
            let [r, g, b] = [0, 1, 2].map(|i| ratio(old_slots.birth[i], new_slots.birth[i]));
            LightRevision { stale, factor: Vec3::new(r, g, b) * watts }
        })
        .collect()
}
