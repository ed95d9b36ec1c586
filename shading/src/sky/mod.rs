//! Turns radiance that comes from infinitely far away into directions drawn by importance, and into irradiance.

mod gradient;
mod map;
#[cfg(test)]
mod tests;

pub use gradient::Gradient;
pub use map::SkyMap;

use crate::sampling;
use core::f32::consts::PI;
use glam::{DVec3, Vec3};

/// Light from all directions around the scene, +Y upwards. Immutable, shared by all versions of a scene.
///
/// It keeps its mean radiance apart from how that is spread over the directions: the spread has the mean 1 over the
/// sphere in each channel that shines, and photons are drawn by it whatever the sky's strength.
#[derive(Clone, Debug)]
pub struct Sky {
    mean: Vec3,
    /// Number of channels that shine.
    channels: f32,
    spread: Spread,
}

/// How the radiance of a sky is spread over the directions, relative to its mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Spread {
    /// A gradient of heights.
    Gradient(Gradient),
    /// A picture of the whole sphere, turned about +Y by a share of a full turn.
    Map(SkyMap, f32),
}

/// A direction of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkySample {
    /// Unit vector towards it.
    pub wi: Vec3,
    /// Radiance from there relative to the sky's mean, per channel.
    pub relative: Vec3,
}

/// The same sky is known by its place in memory: no version of a scene copies one.
impl PartialEq for Sky {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::eq(self, other)
            || (self.mean, self.channels, &self.spread) == (other.mean, other.channels, &other.spread)
    }
}

impl Sky {
    /// A sky between three radiances in W m⁻² sr⁻¹, each finite and not negative: above the horizon linear in the sine of
    /// the elevation, from `horizon` to `zenith`; below it `ground` everywhere.
    pub fn gradient(zenith: DVec3, horizon: DVec3, ground: DVec3) -> Self {
        let mean = 0.5 * (ground + 0.5 * (horizon + zenith));
        let relative = |radiance: DVec3| relative(radiance, mean);
        let spread = Gradient::new(relative(zenith), relative(horizon), relative(ground));
        Self { mean: mean.as_vec3(), channels: channels(mean), spread: Spread::Gradient(spread) }
    }

    /// A sky of a picture of `width` texels around and `height` from zenith to nadir, row by row, radiances in
    /// W m⁻² sr⁻¹, each finite and not negative: the radiance is the same all over a texel. The middle of the picture
    /// lies at −Z, its right half at +X; `rotation_deg` turns it about +Y, counter-clockwise seen from above.
    ///
    /// # Panics
    /// If the number of texels is not width × height, or none.
    pub fn map(width: u32, height: u32, texels: &[[f32; 3]], rotation_deg: f64) -> Self {
        let mean = SkyMap::mean(width, height, texels);
        let map = SkyMap::new(width, height, texels, mean, channels(mean));
        let turn = (rotation_deg / 360.0).rem_euclid(1.0) as f32;
        Self { mean: mean.as_vec3(), channels: channels(mean), spread: Spread::Map(map, turn) }
    }

    /// Mean radiance over the sphere in W m⁻² sr⁻¹: what the power of a light of this sky is at a scale of 1.
    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    /// What its radiances are multiplied by where a light of this sky has the given power; 0 in channels that are dark.
    pub fn scale_of(&self, power: Vec3) -> Vec3 {
        let of = |c: usize| if self.mean[c] > 0.0 { power[c] / self.mean[c] } else { 0.0 };
        Vec3::new(of(0), of(1), of(2))
    }

    /// How its radiance is spread over the directions.
    pub fn spread(&self) -> &Spread {
        &self.spread
    }

    /// Number of channels that shine, 1 to 3: what no weight of a photon exceeds.
    pub fn channels(&self) -> f32 {
        self.channels
    }

    /// Whether the radiance is the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(&self.spread, Spread::Gradient(gradient) if gradient.is_constant())
    }

    /// Radiance from the direction `wi` of unit length, relative to the mean.
    #[inline]
    pub fn relative(&self, wi: Vec3) -> Vec3 {
        match &self.spread {
            Spread::Gradient(gradient) => gradient.relative(wi.y),
            Spread::Map(map, turn) => map.relative(wi, *turn),
        }
    }

    /// `pdf_solid_angle` of [`Sky::sample`] times 4π, where the sky has the given relative radiance: the mean of the
    /// channels that shine, each relative to its own mean.
    ///
    /// Not the luminance: a blue sky's photons would weigh up to 1/0.07 in the blue channel; so none weighs more than 3.
    #[inline]
    pub fn importance(&self, relative: Vec3) -> f32 {
        relative.element_sum() / self.channels
    }

    /// A direction drawn with `pdf_solid_angle` = importance/(4π).
    ///
    /// The shares of a map's texels are kept in f32: rows and, within a row, texels are drawn as often as they should be
    /// up to 2⁻²⁴ of all.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> SkySample {
        match &self.spread {
            Spread::Gradient(gradient) => gradient.sample(u, self.channels),
            Spread::Map(map, turn) => map.sample(u, *turn),
        }
    }

    /// A direction above a surface, and the irradiance of one that faces it, per unit of mean radiance: one sample of the
    /// integral over the hemisphere. `None` where no light comes from.
    ///
    /// Half of the samples are drawn by the sky's importance, with those from below mirrored in the surface; the other half
    /// by the cosine, so that what a sun leaves dark is found, too. The density is that of both together.
    /// Source: Veach & Guibas 1995, one sample of the balance heuristic.
    #[inline]
    pub fn sample_above(&self, normal: Vec3, u: [f32; 2]) -> Option<(Vec3, Vec3)> {
        let wi = if u[0] < 0.5 {
            let wi = self.sample([2.0 * u[0], u[1]]).wi;
            if normal.dot(wi) < 0.0 { mirrored(normal, wi) } else { wi }
        } else {
            sampling::cosine_hemisphere(normal, [2.0 * u[0] - 1.0, u[1]])
        };
        let relative = self.relative(wi);
        let importance = self.importance(relative) + self.importance(self.relative(mirrored(normal, wi)));
        let pdf_solid_angle = importance / (8.0 * PI) + normal.dot(wi).max(0.0) / (2.0 * PI);
        let irradiance = relative / pdf_solid_angle;
        (relative != Vec3::ZERO && irradiance.is_finite()).then_some((wi, irradiance))
    }
}

/// `wi` mirrored in a surface.
#[inline]
fn mirrored(normal: Vec3, wi: Vec3) -> Vec3 {
    (wi - normal * (2.0 * normal.dot(wi))).normalize_or_zero()
}

/// `radiance` relative to `mean` by channel; 0 in channels that are dark, 1 in a sky that is dark altogether.
fn relative(radiance: DVec3, mean: DVec3) -> Vec3 {
    if mean == DVec3::ZERO {
        return Vec3::ONE;
    }
    let of = |c: usize| if mean[c] > 0.0 { radiance[c] / mean[c] } else { 0.0 };
    DVec3::new(of(0), of(1), of(2)).as_vec3()
}

/// Number of channels that shine; all of a dark sky are drawn alike.
fn channels(mean: DVec3) -> f32 {
    let shining = mean.to_array().iter().filter(|&&c| c > 0.0).count();
    if shining == 0 { 3.0 } else { shining as f32 }
}
