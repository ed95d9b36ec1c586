//! Turns the smooth edge of a spot light into cones whose intensity falls linearly with the angle, as Mitsuba's do.
//!
//! Our spots fall from full to none by a cubic in the versine (1 − cos) of the angle to the axis, Mitsuba's linearly in
//! the angle. [`PIECES`] of theirs at one place add up to the straight lines between points of our curve, exact at each
//! of them. Mitsuba keeps cosines in f32: edges of cones below 1° come out coarse.

use photonstream_shading::light::spot_profile;

/// Straight lines that stand for a smooth edge. The largest error is about 6/(8 · 64²) = 0.02 % of the intensity on the
/// axis (0.04 % where full intensity ends at the axis itself), above in the curve's outer half and below in its inner
/// one, so that little of it is left in the power.
pub const PIECES: u32 = 64;

/// A Mitsuba `spot`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Half angle, in degrees, within which the intensity is full.
    pub beam_width_deg: f64,
    /// Half angle, in degrees, at which it has fallen to nothing.
    pub cutoff_angle_deg: f64,
    /// Its intensity relative to that of the whole light on its axis, in (0, 1].
    pub share: f64,
}

impl Cone {
    /// How often this one of `count` cones is sampled, relative to a light of weight 1: half by its share, which takes
    /// the noise from where all of them shine, half as often as any other, which takes it from the edge.
    pub fn sampling_weight(&self, count: usize) -> f64 {
        0.5 * (self.share + 1.0 / count as f64)
    }
}

/// Cones that add up to a spot light of these versines; their shares sum to 1.
pub fn cones(versine_inner: f32, versine_outer: f32) -> Vec<Cone> {
    let angle_deg = |versine: f64| (2.0 * (versine * 0.5).sqrt().min(1.0).asin()).to_degrees();
    let (inner, outer) = (f64::from(versine_inner), f64::from(versine_outer));
    if inner >= outer {
        let cutoff = angle_deg(outer);
        return vec![Cone { beam_width_deg: cutoff, cutoff_angle_deg: cutoff, share: 1.0 }];
    }
    let versine = |knot: u32| inner + (outer - inner) * f64::from(knot) / f64::from(PIECES);
    let profile = |knot: u32| f64::from(spot_profile(versine(knot) as f32, versine_inner, versine_outer));
    (0..PIECES)
        .map(|knot| Cone {
            beam_width_deg: angle_deg(versine(knot)),
            cutoff_angle_deg: angle_deg(versine(knot + 1)),
            share: profile(knot) - profile(knot + 1),
        })
        .filter(|cone| cone.share > 0.0)
        .collect()
}
