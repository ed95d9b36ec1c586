//! Turns three radiances into a sky that changes with height alone: ground, horizon, zenith.

use super::SkySample;
use crate::sampling::sin_cos_turn;
use glam::Vec3;

/// Radiances relative to the sky's mean: `horizon` to `zenith` linear in y, the sine of the elevation, and `ground` for
/// y < 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// Where y = 1.
    pub zenith: Vec3,
    /// Where y = 0, from above.
    pub horizon: Vec3,
    /// Where y < 0.
    pub ground: Vec3,
}

impl Gradient {
    pub(super) fn new(zenith: Vec3, horizon: Vec3, ground: Vec3) -> Self {
        Self { zenith, horizon, ground }
    }

    pub(super) fn is_constant(&self) -> bool {
        self.zenith == self.horizon && self.horizon == self.ground
    }

    #[inline]
    pub(super) fn relative(&self, y: f32) -> Vec3 {
        if y < 0.0 { self.ground } else { self.horizon + (self.zenith - self.horizon) * y }
    }

    /// The importance is linear in y, so that its sums can be inverted: no sample weighs more than another.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], channels: f32) -> SkySample {
        let importance = |relative: Vec3| relative.element_sum() / channels;
        let (a, b) = (importance(self.horizon), importance(self.zenith));
        let below = 0.5 * importance(self.ground);
        let y = if u[0] < below {
            u[0] / below - 1.0
        } else {
            let t = ((u[0] - below) / (1.0 - below)).min(1.0);
            // Source: the inverse of a linear density without cancellation, as in pbrt-v4's SampleLinear.
            let root = (a * a + t * (b * b - a * a)).max(0.0).sqrt();
            if a + root > 0.0 { (t * (a + b) / (a + root)).min(1.0) } else { 0.0 }
        };
        // Rounding leaves 0 to the sky above.
        let y = if u[0] < below { y.min(-f32::MIN_POSITIVE) } else { y };
        let radius = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
        let (sin, cos) = sin_cos_turn(u[1]);
        SkySample { wi: Vec3::new(radius * sin, y, -radius * cos), relative: self.relative(y) }
    }
}
