//! Turns a way between a VPL and a light into the share of light that takes it.

use crate::{
    blocker::{Blocker, Segment},
    light::Arrival,
};
use glam::Vec3;

/// What stands between lights and VPLs.
pub enum Visibility<'a> {
    /// Nothing.
    None,
    /// Spheres, which dim softly and multiply where they overlap.
    Blockers(&'a [Blocker]),
    /// Whatever the caller knows, for example by tracing the ray: the share of light that passes, 0 to 1. Asked only
    /// where light would arrive.
    Asked(&'a mut dyn FnMut(ShadowRay) -> f32),
}

/// A way that light may take, from the VPL that receives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowRay {
    /// The VPL's position, in m.
    pub origin: Vec3,
    /// Unit vector from there to the light.
    pub direction: Vec3,
    /// Distance to the light in m; infinite for directional lights.
    pub distance: f32,
}

impl Visibility<'_> {
    /// The share of light that passes, 0 to 1.
    #[inline]
    pub(crate) fn passing(&mut self, x: Vec3, arrival: &Arrival) -> f32 {
        match self {
            Self::None => 1.0,
            Self::Blockers(blockers) => Segment::new(x, arrival.wi, arrival.distance).passing(blockers),
            Self::Asked(ask) => {
                let share = ask(ShadowRay { origin: x, direction: arrival.wi, distance: arrival.distance });
                if share > 0.0 { share.min(1.0) } else { 0.0 }
            }
        }
    }
}
