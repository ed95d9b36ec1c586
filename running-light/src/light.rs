//! Turns light sources into the light that arrives at a point.

use crate::finite::saturated;
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;

/// A light source. Powers and falloffs are those of `photonstream_shading::Light`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// The same intensity in all directions.
    Point {
        /// World position in m.
        position: Vec3,
        /// Intensity in W sr⁻¹, linear RGB: the power over 4π.
        intensity: Vec3,
    },
    /// A cone of light with a smooth edge.
    Spot(Spot),
    /// A small piece of a diffusely emitting surface: several make a lamp.
    Emitter {
        /// World position in m.
        position: Vec3,
        /// The surface's normal, of unit length.
        normal: Vec3,
        /// Intensity along the normal in W sr⁻¹, linear RGB: the power over π.
        intensity: Vec3,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// The way the light travels, of unit length.
        direction: Vec3,
        /// Irradiance of a surface that faces it in W m⁻², linear RGB.
        irradiance: Vec3,
    },
}

/// A spot light: full intensity within the inner cone, none beyond the outer one, a smooth cubic between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// World position in m.
    pub position: Vec3,
    /// The axis, the way the light travels, of unit length.
    pub direction: Vec3,
    /// 1 − cos of the *half* angle within which the intensity is full.
    pub versine_inner: f32,
    /// 1 − cos of the *half* angle beyond which there is no light; at least `versine_inner`, more than 0.
    pub versine_outer: f32,
    /// Intensity along the axis in W sr⁻¹, linear RGB.
    pub intensity: Vec3,
}

/// Light at a point if nothing stands between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    /// Unit vector from the point to the light.
    pub(crate) wi: Vec3,
    /// Distance to the light in m; infinite for directional lights.
    pub(crate) distance: f32,
    /// Irradiance of a surface that faces `wi`, in W m⁻².
    pub(crate) irradiance: Vec3,
}

impl Spot {
    /// A spot of the given power in W, linear RGB; `half_angles` from the axis to the inner and the outer edge, in
    /// radians, 0 ≤ inner ≤ outer ≤ π.
    ///
    /// `direction` may have any length; without one (zero) the spot is dark. The intensity along the axis is
    /// P / π(v_inner + v_outer), v = 1 − cos, because the profile's integral over the sphere is its denominator.
    pub fn new(position: Vec3, direction: Vec3, half_angles: [f32; 2], power: Vec3) -> Self {
        let [versine_inner, versine_outer] = half_angles.map(versine);
        let per_power = FRAC_1_PI / (versine_inner + versine_outer);
        let dark = direction.try_normalize().is_none() || !per_power.is_finite();
        Self {
            position,
            direction: direction.normalize_or(Vec3::NEG_Y),
            versine_inner,
            versine_outer,
            intensity: if dark { Vec3::ZERO } else { saturated(power * per_power) },
        }
    }

    /// Intensity towards `-wi` relative to the axis, 0 to 1.
    #[inline]
    fn profile(&self, wi: Vec3) -> f32 {
        let versine = (wi + self.direction).length_squared() * 0.5;
        if versine <= self.versine_inner {
            1.0
        } else if versine >= self.versine_outer {
            0.0
        } else {
            let x = (self.versine_outer - versine) / (self.versine_outer - self.versine_inner);
            x * x * (3.0 - 2.0 * x)
        }
    }
}

impl Light {
    /// A point light of the given power in W, linear RGB.
    pub fn point(position: Vec3, power: Vec3) -> Self {
        Self::Point { position, intensity: power * (0.25 * FRAC_1_PI) }
    }

    /// A piece of a diffusely emitting surface of the given power in W, linear RGB; `normal` may have any length, without
    /// one (zero) it is dark.
    pub fn emitter(position: Vec3, normal: Vec3, power: Vec3) -> Self {
        let power = if normal.try_normalize().is_some() { power } else { Vec3::ZERO };
        let normal = normal.normalize_or(Vec3::NEG_Y);
        Self::Emitter { position, normal, intensity: saturated(power * FRAC_1_PI) }
    }

    /// What arrives at `x`; `None` where no light goes.
    #[inline]
    pub(crate) fn arrival(&self, x: Vec3) -> Option<Arrival> {
        match self {
            Self::Point { position, intensity } => from_position(*position - x, *intensity, |_| 1.0),
            Self::Spot(spot) => from_position(spot.position - x, spot.intensity, |wi| spot.profile(wi)),
            Self::Emitter { position, normal, intensity } => {
                from_position(*position - x, *intensity, |wi| (-normal.dot(wi)).max(0.0))
            }
            Self::Directional { direction, irradiance } => {
                Some(Arrival { wi: -*direction, distance: f32::INFINITY, irradiance: saturated(*irradiance) })
            }
        }
    }

    /// The way the light as a whole travels, of unit length: its axis; for a point light, from it to `x`.
    pub(crate) fn direction_towards(&self, x: Vec3) -> Option<Vec3> {
        match self {
            Self::Point { position, .. } => (x - *position).try_normalize(),
            Self::Spot(Spot { direction, .. })
            | Self::Emitter { normal: direction, .. }
            | Self::Directional { direction, .. } => Some(*direction),
        }
    }
}

/// Inverse-square light of the given intensity along the axis, at vector `d` from the receiver.
#[inline]
fn from_position(d: Vec3, intensity: Vec3, profile: impl Fn(Vec3) -> f32) -> Option<Arrival> {
    let distance_sq = d.length_squared();
    let distance = d.length();
    let wi = d / distance;
    let per_intensity = profile(wi) / distance_sq;
    (per_intensity > 0.0 && per_intensity.is_finite()).then(|| Arrival {
        wi,
        distance,
        irradiance: saturated(intensity * per_intensity),
    })
}

/// 1 − cos of an angle in radians from 0 to π, without the cancellation.
fn versine(angle: f32) -> f32 {
    let sine = libm::sinf(angle.clamp(0.0, PI) * 0.5);
    2.0 * sine * sine
}

#[cfg(test)]
mod tests {
    use super::*;

    fn irradiance(light: &Light, x: Vec3) -> Vec3 {
        light.arrival(x).map_or(Vec3::ZERO, |a| a.irradiance)
    }

    /// By hand: 8π W everywhere are 2 W/sr; at distance 2, 0.5 W/m². Tolerance: four roundings.
    #[test]
    fn point_light_falls_with_the_square() {
        let light = Light::point(Vec3::ZERO, Vec3::splat(8.0 * PI));
        assert!(irradiance(&light, Vec3::new(0.0, -2.0, 0.0)).abs_diff_eq(Vec3::splat(0.5), 3e-7));
        let arrival = light.arrival(Vec3::new(0.0, -2.0, 0.0)).unwrap();
        assert_eq!((arrival.wi, arrival.distance), (Vec3::Y, 2.0));
        assert!(light.arrival(Vec3::ZERO).is_none(), "no direction, no light");
    }

    /// By hand: half angles 0 and 90° have versines 0 and 1, so π W are 1 W/sr along the axis. At 60° the versine is ½,
    /// the cubic ½ too; at the edge and beyond it there is exactly none.
    #[test]
    fn spot_falls_from_the_axis_to_the_half_angle() {
        let spot = Spot::new(Vec3::ZERO, Vec3::NEG_Y * 3.0, [0.0, PI / 2.0], Vec3::splat(PI));
        assert!((spot.intensity - 1.0).abs().max_element() < 1e-6, "{}", spot.intensity);
        let light = Light::Spot(spot);
        let sixty = Vec3::new(0.75f32.sqrt(), -0.5, 0.0);
        assert!((irradiance(&light, Vec3::NEG_Y).x - 1.0).abs() < 1e-6);
        assert!((irradiance(&light, sixty).x - 0.5).abs() < 1e-6);
        assert!(light.arrival(Vec3::new(1.0, 1e-3, 0.0)).is_none());
        assert!(light.arrival(Vec3::Y).is_none());
    }

    /// By hand: 2π W are 2 W/sr along the normal; at 60° and distance 2, 2 · ½ / 4 W/m². None behind. Tolerance: four
    /// roundings.
    #[test]
    fn emitter_falls_with_its_cosine() {
        let light = Light::emitter(Vec3::ZERO, Vec3::NEG_Y * 3.0, Vec3::splat(2.0 * PI));
        let sixty = Vec3::new(0.75f32.sqrt(), -0.5, 0.0) * 2.0;
        assert!(irradiance(&light, sixty).abs_diff_eq(Vec3::splat(0.25), 3e-7));
        assert!(light.arrival(Vec3::Y).is_none() && light.arrival(Vec3::X).is_none());
        assert_eq!(light.direction_towards(Vec3::X), Some(Vec3::NEG_Y));
        let dark = Light::emitter(Vec3::ZERO, Vec3::ZERO, Vec3::ONE);
        assert_eq!(irradiance(&dark, Vec3::NEG_Y), Vec3::ZERO);
    }

    #[test]
    fn spot_without_axis_or_cone_is_dark() {
        for (direction, angles) in [(Vec3::ZERO, [0.1, 0.2]), (Vec3::X, [0.0, 0.0])] {
            let spot = Spot::new(Vec3::ZERO, direction, angles, Vec3::ONE);
            assert_eq!(spot.intensity, Vec3::ZERO);
            assert!(spot.direction.is_normalized());
            assert_eq!(irradiance(&Light::Spot(spot), Vec3::X), Vec3::ZERO);
        }
    }
}
