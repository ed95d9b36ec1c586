//! Turns a receiver and a virtual surface light into the share of its flux that arrives: the kernels K.

use crate::patch::NEAR_AREAS;
use core::f32::consts::PI;
use glam::Vec3;

/// How the flux of a virtual surface light falls off towards a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Kernel {
    /// K = 1/(π r²): a point. Unbounded beside a light. Source: paper A, the sum of §0.4.1.
    Paper,
    /// K = 1/(π r² + A): a disc of area A seen on its axis; bounded by 1/A, too dark beside an edge.
    ///
    /// Source: Wallace, Elmquist & Haines, "A Ray Tracing Algorithm for Progressive Radiosity", SIGGRAPH 1989.
    Disc,
    /// The light's own polygon where π r² is below [`NEAR_AREAS`] times its area, the form factor in closed form
    /// ([`crate::patch`]); a point beyond.
    #[default]
    Patch,
}

impl Kernel {
    /// All kernels, in the order of their discriminants.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Disc, Self::Patch];

    /// The name used in configs and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Disc => "disc",
            Self::Patch => "patch",
        }
    }

    /// What is added to π r² in the denominator for a light of `area` m²; with [`Kernel::Patch`] where it is far.
    #[inline]
    pub fn area_term(self, area: f32) -> f32 {
        match self {
            Self::Paper | Self::Patch => 0.0,
            Self::Disc => area,
        }
    }

    /// Whether a receiver at a squared distance of `r_sq` m² sees the polygon, of `area` m², instead of a point.
    #[inline]
    pub fn is_near(self, r_sq: f32, area: f32) -> bool {
        self == Self::Patch && PI * r_sq < NEAR_AREAS * area
    }

    /// cos θ cos θ_s K in m⁻², with [`Kernel::Patch`] that of a far light: times Φ_s and V, the irradiance that the light adds at the receiver.
    ///
    /// `d` leads from receiver to light (m, not normalised), `n` and `n_s` are their unit normals, `area` is the
    /// light's in m². Zero where either faces away and where the two coincide.
    #[inline]
    pub fn transfer(self, d: Vec3, n: Vec3, n_s: Vec3, area: f32) -> f32 {
        let r_sq = d.length_squared();
        let cosines = n.dot(d).max(0.0) * (-n_s.dot(d)).max(0.0);
        let denominator = r_sq * (PI * r_sq + self.area_term(area));
        if cosines > 0.0 && denominator > 0.0 { cosines / denominator } else { 0.0 }
    }
}

impl core::str::FromStr for Kernel {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| {
            format!("unknown kernel \"{name}\"; expected one of: {}", Self::ALL.map(Self::name).join(", "))
        })
    }
}

impl core::fmt::Display for Kernel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Beyond this squared distance (m²) a virtual surface light of flux `flux_max` (W, largest channel) adds less than
/// `epsilon` (W m⁻² sr⁻¹) to the radiance of any surface of albedo `albedo_max`; infinite for `epsilon` = 0.
///
/// Source: paper A §0.7.3, with R = ρ/π.
pub fn range_sq(flux_max: f32, albedo_max: f32, epsilon: f32) -> f32 {
    if epsilon > 0.0 { flux_max * albedo_max / (PI * PI * epsilon) } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facing_patches_have_the_inverse_square_law() {
        for r in [0.1f32, 1.0, 25.0] {
            let k = Kernel::Paper.transfer(Vec3::Z * r, Vec3::Z, Vec3::NEG_Z, 0.5);
            assert!((k * PI * r * r - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn disc_is_bounded_by_its_area_and_meets_the_point_far_away() {
        let area = 0.25;
        for exponent in -18..6 {
            let r = 10f32.powi(exponent);
            let k = Kernel::Disc.transfer(Vec3::Z * r, Vec3::Z, Vec3::NEG_Z, area);
            assert!(k <= 1.0 / area && k.is_finite());
        }
        let far = Vec3::Z * 1e3;
        let ratio = Kernel::Disc.transfer(far, Vec3::Z, Vec3::NEG_Z, area)
            / Kernel::Paper.transfer(far, Vec3::Z, Vec3::NEG_Z, area);
        assert!((ratio - 1.0).abs() < 1e-6);
    }

    /// On its axis a disc of radius a gives E = B a²/(a² + r²), which is Φ/(π r² + A): exact, whatever the distance.
    #[test]
    fn disc_is_exact_on_the_axis_of_a_disc() {
        let radius = 0.7f32;
        let area = PI * radius * radius;
        for r in [0.05f32, 0.3, 1.0, 4.0] {
            let exact = radius * radius / (radius * radius + r * r) / area;
            let k = Kernel::Disc.transfer(Vec3::Y * r, Vec3::Y, Vec3::NEG_Y, area);
            assert!((k / exact - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn nothing_arrives_from_behind_from_afar_or_from_the_same_place() {
        for kernel in Kernel::ALL {
            assert_eq!(kernel.transfer(Vec3::NEG_Z, Vec3::Z, Vec3::Z, 0.1), 0.0);
            assert_eq!(kernel.transfer(Vec3::Z, Vec3::Z, Vec3::Z, 0.1), 0.0);
            assert_eq!(kernel.transfer(Vec3::ZERO, Vec3::Z, Vec3::NEG_Z, 0.1), 0.0);
            assert_eq!(kernel.name().parse(), Ok(kernel));
        }
    }

    #[test]
    fn range_is_where_the_contribution_falls_to_epsilon() {
        let (flux, albedo, epsilon) = (3.0f32, 0.8, 1e-3);
        let r = range_sq(flux, albedo, epsilon).sqrt();
        let radiance = albedo / PI * flux * Kernel::Paper.transfer(Vec3::Z * r, Vec3::Z, Vec3::NEG_Z, 0.0);
        assert!((radiance / epsilon - 1.0).abs() < 1e-5);
    }
}
