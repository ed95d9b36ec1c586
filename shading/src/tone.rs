//! Turns linear radiance into display colour: exposure, a named tone map, the sRGB transfer function.

use glam::Vec3;

/// How radiance beyond the display's range is brought into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ToneMap {
    /// Clipped at 1.
    Linear,
    /// x/(1 + x) per channel. Source: Reinhard et al., SIGGRAPH 2002, eq. 3.
    Reinhard,
    /// A filmic curve. Source: Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.
    #[default]
    Aces,
}

impl ToneMap {
    /// All tone maps, in the order of their discriminants.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Reinhard, Self::Aces];

    /// The name used in configs and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Reinhard => "reinhard",
            Self::Aces => "aces",
        }
    }

    /// Display-linear colour in [0, 1] of `radiance` (W m⁻² sr⁻¹) after an exposure of `exposure_ev` stops.
    pub fn apply(self, radiance: Vec3, exposure_ev: f32) -> Vec3 {
        let x = (radiance * exposure_ev.exp2()).max(Vec3::ZERO);
        let mapped = match self {
            Self::Linear => x,
            Self::Reinhard => x / (Vec3::ONE + x),
            // Divided through by x², so that huge radiances do not overflow.
            Self::Aces => {
                let inverse = 1.0 / x.max(Vec3::splat(1e-20));
                (Vec3::splat(2.51) + 0.03 * inverse)
                    / (Vec3::splat(2.43) + 0.59 * inverse + 0.14 * inverse * inverse)
            }
        };
        mapped.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

impl core::str::FromStr for ToneMap {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            format!("unknown tone map \"{name}\"; expected one of: {}", Self::ALL.map(Self::name).join(", "))
        })
    }
}

/// Display-linear colour in [0, 1] as 8-bit sRGB (IEC 61966-2-1).
pub fn to_srgb8(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|x| {
        let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0 + 0.5) as u8
    })
}

/// Rec. 709 luminance of a linear colour.
#[inline]
pub fn luminance(colour: Vec3) -> f32 {
    colour.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_map_is_monotone_bounded_and_black_at_black() {
        for map in ToneMap::ALL {
            assert!(map.apply(Vec3::ZERO, 0.0).max_element() < 1e-6);
            let mut last = Vec3::splat(-1.0);
            for exponent in -40..120 {
                let y = map.apply(Vec3::splat((exponent as f32 * 0.25).exp2()), 0.0);
                assert!(
                    y.is_finite()
                        && y.min_element() >= last.min_element() - f32::EPSILON
                        && y.max_element() <= 1.0,
                    "{map:?}"
                );
                last = y;
            }
            assert!(map.apply(Vec3::splat(f32::MAX), 0.0).is_finite());
            assert_eq!(map.name().parse(), Ok(map));
        }
    }

    #[test]
    fn exposure_counts_in_stops() {
        let a = ToneMap::Reinhard.apply(Vec3::splat(0.5), 2.0);
        assert!((a - ToneMap::Reinhard.apply(Vec3::splat(2.0), 0.0)).length() < 1e-6);
    }

    #[test]
    fn srgb_has_its_published_values() {
        assert_eq!(to_srgb8(Vec3::new(0.0, 1.0, 0.214_041_14)), [0, 255, 128]);
        assert_eq!(to_srgb8(Vec3::splat(0.001)), [3; 3]);
        assert!((luminance(Vec3::ONE) - 1.0).abs() < 1e-6);
    }
}
