//! Turns the flux of virtual point lights into intensities.

use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// A static virtual point light: a place from which diffusely reflected light can come, and how much of it.
///
/// Source: paper B §4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vpl {
    /// World position in m; the caller moves what is attached to an object.
    pub position: Vec3,
    /// The axis of its hemisphere: the surface's normal, of unit length.
    pub normal: Vec3,
    /// Diffuse reflectance, linear RGB, 0 to 1.
    pub albedo: Vec3,
    /// How much surface it stands for, w: its area is w · a with the set's `area_per_weight` a; 0 or more.
    pub weight: f32,
}

/// The index of a VPL in its set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VplId(pub u32);

/// A diffuse light on one side of a point: what is left to shade with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualLight {
    /// World position in m.
    pub position: Vec3,
    /// The axis of its hemisphere, of unit length.
    pub normal: Vec3,
    /// Flux that leaves it in W, linear RGB: Φ = ρ E A.
    pub flux: Vec3,
    /// The area that it stands for in m².
    pub area: f32,
}

impl VirtualLight {
    /// Intensity along the normal, I = Φ/π, in W sr⁻¹.
    ///
    /// Source: paper B §4.1, its exitance M = ρ E and I = M A/π in one.
    #[inline]
    pub fn intensity(&self) -> Vec3 {
        self.flux * FRAC_1_PI
    }

    /// Intensity towards `direction` of unit length, I max(0, n · l), in W sr⁻¹.
    ///
    /// Source: paper B §4.1, Lambert's cosine law.
    #[inline]
    pub fn intensity_towards(&self, direction: Vec3) -> Vec3 {
        self.intensity() * self.normal.dot(direction).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::PI;

    /// By hand: 3π W leave as 3 W/sr along the normal, 1.5 W/sr at 60° (cos = ½), none at 90° and behind. Tolerance:
    /// two roundings of f32, 2⁻²³ each.
    #[test]
    fn intensity_falls_with_the_cosine() {
        let flux = Vec3::new(3.0, 0.0, 1.0) * PI;
        let light = VirtualLight { position: Vec3::ZERO, normal: Vec3::Z, flux, area: 1.0 };
        let sixty = Vec3::new(0.75f32.sqrt(), 0.0, 0.5);
        assert!(light.intensity().abs_diff_eq(Vec3::new(3.0, 0.0, 1.0), 1e-6));
        assert!(light.intensity_towards(sixty).abs_diff_eq(Vec3::new(1.5, 0.0, 0.5), 1e-6));
        assert_eq!(light.intensity_towards(Vec3::X), Vec3::ZERO);
        assert_eq!(light.intensity_towards(-Vec3::Z), Vec3::ZERO);
    }
}
