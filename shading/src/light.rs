//! Turns light sources into photons that leave them and irradiance that arrives from them.

use crate::{sampling, sobol::Sample, surface};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;

/// A light source: a shape that says where light starts and how it spreads, and a power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where the light starts and how it spreads.
    pub shape: LightShape,
    /// Emitted power in W, linear RGB; for [`LightShape::Directional`] the irradiance in W m⁻² of a surface that
    /// faces the light.
    pub power: Vec3,
}

/// Where a light starts and how it spreads. Lengths in metres from the scene's origin, directions of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// The same intensity in all directions.
    Point {
        /// Where it stands.
        position: Vec3,
    },
    /// A cone of light with a smooth edge.
    ///
    /// Angles are kept as versines, 1 - cos: in f32 a cosine cannot tell cones below 0.02° apart.
    Spot {
        /// Where it stands.
        position: Vec3,
        /// The axis, the way the light travels.
        direction: Vec3,
        /// 1 - cos of the half angle within which the intensity is full.
        versine_inner: f32,
        /// 1 - cos of the half angle beyond which there is no light; ≥ `versine_inner`, > 0.
        versine_outer: f32,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// The way the light travels.
        direction: Vec3,
    },
    /// A diffuse emitter; it emits towards `edge_u × edge_v`.
    Parallelogram {
        /// The corner from which both edges start.
        corner: Vec3,
        /// First edge.
        edge_u: Vec3,
        /// Second edge.
        edge_v: Vec3,
    },
    /// A diffuse emitter; it emits towards `edge_u × edge_v`.
    Triangle {
        /// The corner from which both edges start.
        corner: Vec3,
        /// First edge.
        edge_u: Vec3,
        /// Second edge.
        edge_v: Vec3,
    },
}

/// The sphere that holds all geometry: what a directional light has to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Centre, in metres from the scene's origin.
    pub centre: Vec3,
    /// Radius in metres.
    pub radius: f32,
}

/// A photon as it leaves a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit vector along which it travels.
    pub direction: Vec3,
    /// Its share of the light's power relative to the mean photon; the mean over all samples is 1.
    pub weight: f32,
}

/// Light that reaches a point if nothing stands between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Illumination {
    /// Unit vector from the point to the light.
    pub wi: Vec3,
    /// Distance to the light in m; infinite for directional lights.
    pub distance: f32,
    /// Irradiance of a surface that faces `wi`, in W m⁻² per unit of the light's `power`.
    pub irradiance: f32,
}

impl LightShape {
    /// Watts emitted into the scene per unit of the light's `power`: 1, or the cross section of `bounds` in m² for a
    /// directional light.
    pub fn watts_per_power(&self, bounds: Bounds) -> f32 {
        match self {
            Self::Directional { .. } => PI * bounds.radius * bounds.radius,
            _ => 1.0,
        }
    }

    /// One photon; takes two 2D dimensions of `sample`: for [`LightShape::emit_with`] the direction, then the position.
    #[inline]
    pub fn emit(&self, bounds: Bounds, sample: &mut Sample) -> Emission {
        let u = sample.next_2d();
        self.emit_with(bounds, u, sample.next_2d())
    }

    /// One photon from its random numbers: `u` for its direction (its place in the beam of a directional light),
    /// `u_position` for its place on an area light, which other lights ignore.
    #[inline]
    pub fn emit_with(&self, bounds: Bounds, u: [f32; 2], u_position: [f32; 2]) -> Emission {
        match *self {
            Self::Point { position } => {
                Emission { origin: position, direction: sampling::sphere(u), weight: 1.0 }
            }
            Self::Spot { position, direction: axis, versine_inner, versine_outer } => {
                let direction = sampling::cone(axis, versine_outer, u);
                // u[0] is uniform in the versine, so the profile needs no cosine of the rounded direction.
                let weight =
                    spot_profile(u[0] * versine_outer, versine_inner, versine_outer) * 2.0 * versine_outer
                        / (versine_inner + versine_outer);
                Emission { origin: position, direction, weight }
            }
            Self::Directional { direction } => {
                let disc = sampling::disc(u) * bounds.radius;
                let local = Vec3::new(disc.x, disc.y, 0.0);
                let origin = bounds.centre - direction * (1.01 * bounds.radius)
                    + crate::basis::from_local(direction, local);
                Emission { origin, direction, weight: 1.0 }
            }
            Self::Parallelogram { .. } | Self::Triangle { .. } => {
                let normal = self.emitter_normal();
                let origin = self.offset_emitter_point(u_position);
                Emission { origin, direction: sampling::cosine_hemisphere(normal, u), weight: 1.0 }
            }
        }
    }

    /// What reaches `x`; `u` chooses the point of an area light. `None` where no light goes.
    ///
    /// For area lights this is one sample of the integral over the emitter: its mean over `u` is the irradiance.
    #[inline]
    pub fn illuminate(&self, x: Vec3, u: [f32; 2]) -> Option<Illumination> {
        match *self {
            Self::Point { position } => from_position(position - x, |_| 1.0 / (4.0 * PI)),
            Self::Spot { position, direction: axis, versine_inner, versine_outer } => {
                from_position(position - x, |wi| {
                    let versine = (wi + axis).length_squared() * 0.5;
                    spot_profile(versine, versine_inner, versine_outer) * FRAC_1_PI
                        / (versine_inner + versine_outer)
                })
            }
            Self::Directional { direction } => {
                Some(Illumination { wi: -direction, distance: f32::INFINITY, irradiance: 1.0 })
            }
            Self::Parallelogram { .. } | Self::Triangle { .. } => {
                let normal = self.emitter_normal();
                from_position(self.offset_emitter_point(u) - x, |wi| FRAC_1_PI * normal.dot(-wi).max(0.0))
            }
        }
    }

    /// Whether one sample of [`LightShape::illuminate`] is exact: all but area lights.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Parallelogram { .. } | Self::Triangle { .. })
    }

    /// Area of an emitter in m²; 0 for lights without one.
    pub fn area(&self) -> f32 {
        match *self {
            Self::Parallelogram { edge_u, edge_v, .. } => {
                edge_u.as_dvec3().cross(edge_v.as_dvec3()).length() as f32
            }
            Self::Triangle { edge_u, edge_v, .. } => {
                edge_u.as_dvec3().cross(edge_v.as_dvec3()).length() as f32 * 0.5
            }
            _ => 0.0,
        }
    }

    /// Unit normal of the emitting side; zero for lights without an area.
    #[inline]
    pub fn emitter_normal(&self) -> Vec3 {
        match *self {
            Self::Parallelogram { edge_u, edge_v, .. } | Self::Triangle { edge_u, edge_v, .. } => {
                edge_u.cross(edge_v).normalize_or_zero()
            }
            _ => Vec3::ZERO,
        }
    }

    /// A point of the emitter moved just off its surface, so that the emitter itself does not shade it.
    #[inline]
    fn offset_emitter_point(&self, u: [f32; 2]) -> Vec3 {
        let (corner, edge_u, edge_v, [a, b]) = match *self {
            Self::Parallelogram { corner, edge_u, edge_v } => (corner, edge_u, edge_v, u),
            Self::Triangle { corner, edge_u, edge_v } => (corner, edge_u, edge_v, sampling::triangle(u)),
            Self::Point { position } | Self::Spot { position, .. } => return position,
            Self::Directional { .. } => return Vec3::ZERO,
        };
        let point = corner + edge_u * a + edge_v * b;
        surface::offset([corner, corner + edge_u, corner + edge_v], point, self.emitter_normal())
    }
}

impl Light {
    /// Radiance of the emitting side in W m⁻² sr⁻¹; zero for lights without an area.
    pub fn emitted_radiance(&self) -> Vec3 {
        let area = self.shape.area();
        if area > 0.0 { self.power * (FRAC_1_PI / area) } else { Vec3::ZERO }
    }
}

/// Intensity of a spot relative to its axis: 1 within the inner cone, 0 beyond the outer, a cubic between.
///
/// Its integral over the sphere is π (`versine_inner` + `versine_outer`).
#[inline]
pub fn spot_profile(versine: f32, versine_inner: f32, versine_outer: f32) -> f32 {
    let width = versine_outer - versine_inner;
    if versine <= versine_inner {
        1.0
    } else if versine >= versine_outer {
        0.0
    } else {
        let x = (versine_outer - versine) / width;
        x * x * (3.0 - 2.0 * x)
    }
}

/// Inverse-square light of the given intensity (W sr⁻¹ per W, from `wi`) at vector `d` from the receiver.
#[inline]
fn from_position(d: Vec3, intensity: impl Fn(Vec3) -> f32) -> Option<Illumination> {
    let distance_sq = d.length_squared();
    let distance = distance_sq.sqrt();
    let wi = d / distance;
    let irradiance = intensity(wi) / distance_sq;
    (irradiance > 0.0 && irradiance.is_finite()).then_some(Illumination { wi, distance, irradiance })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sobol::Sequence;

    fn versine(half_angle_deg: f64) -> f32 {
        (2.0 * (half_angle_deg.to_radians() / 2.0).sin().powi(2)) as f32
    }

    fn spot(inner_deg: f64, outer_deg: f64) -> LightShape {
        LightShape::Spot {
            position: Vec3::new(0.3, 0.2, 0.1),
            direction: Vec3::new(2.0, -3.0, 6.0) / 7.0,
            versine_inner: versine(inner_deg),
            versine_outer: versine(outer_deg),
        }
    }

    const PATCH: LightShape = LightShape::Parallelogram {
        corner: Vec3::new(-0.2, 0.1, -0.3),
        edge_u: Vec3::new(0.5, 0.0, 0.0),
        edge_v: Vec3::new(0.1, 0.0, 0.7),
    };
    const TRIANGLE: LightShape = LightShape::Triangle {
        corner: Vec3::new(-0.2, 0.1, -0.3),
        edge_u: Vec3::new(0.5, 0.0, 0.0),
        edge_v: Vec3::new(0.1, 0.0, 0.7),
    };
    const BOUNDS: Bounds = Bounds { centre: Vec3::ZERO, radius: 2.0 };

    /// All that leaves a light arrives on a sphere around it: ∫ E dA = P. Quasi-Monte Carlo over the sphere, N = 2^16
    /// points × 1 emitter point; the 1 % allows for the discontinuous edge of the narrowest cone and the emitter's
    /// own sampling noise (σ ≤ 0.3 %).
    #[test]
    fn all_emitted_power_arrives() {
        let n = 1 << 16;
        let radius = 3.0f32;
        for shape in [
            LightShape::Point { position: Vec3::X },
            spot(20.0, 30.0),
            spot(60.0, 60.0),
            spot(90.0, 180.0),
            PATCH,
            TRIANGLE,
        ] {
            let sum: f64 = (0..n)
                .map(|i| {
                    let mut sample = Sequence::new(1, 1).sample(i);
                    let normal = sampling::sphere(sample.next_2d());
                    let arriving = shape.illuminate(normal * radius, sample.next_2d());
                    arriving.map_or(0.0, |a| f64::from(a.irradiance * (-normal).dot(a.wi).max(0.0)))
                })
                .sum();
            let power = sum / n as f64 * 4.0 * core::f64::consts::PI * f64::from(radius * radius);
            assert!((power - 1.0).abs() < 0.01, "{shape:?}: {power}");
        }
    }

    /// The mean photon weight is 1 and photons start at the light. N = 2^14, stratified: error ≪ 1/√N; 0.1 %.
    #[test]
    fn photons_carry_all_power() {
        let n = 1 << 14;
        let directional = LightShape::Directional { direction: Vec3::NEG_Y };
        for shape in [
            LightShape::Point { position: Vec3::X },
            spot(0.04, 0.05),
            spot(10.0, 40.0),
            spot(90.0, 180.0),
            directional,
            PATCH,
            TRIANGLE,
        ] {
            let mut sum = 0.0;
            for i in 0..n {
                let photon = shape.emit(BOUNDS, &mut Sequence::new(3, 0).sample(i));
                assert!(photon.origin.is_finite() && (photon.direction.length() - 1.0).abs() < 1e-6);
                sum += f64::from(photon.weight);
            }
            assert!((sum / n as f64 - 1.0).abs() < 1e-3, "{shape:?}: {}", sum / n as f64);
        }
    }

    /// Photons and irradiance describe the same light: photons through a small cap agree with E there.
    /// N = 2^20; each cap holds ≥ 4 000 photons, 4 σ = 6 %.
    #[test]
    fn photons_match_the_irradiance() {
        let n = 1 << 20;
        for shape in [spot(25.0, 40.0), PATCH, TRIANGLE] {
            let axis = if let LightShape::Spot { direction, .. } = shape {
                direction
            } else {
                shape.emitter_normal()
            };
            for tilt in [0.0f32, 0.2, 0.5] {
                let towards = (axis + Vec3::X * tilt).normalize();
                let (distance, cap) = (8.0f32, 0.5f32);
                let centre = towards * distance;
                let count: f64 = (0..n)
                    .map(|i| {
                        let photon = shape.emit(BOUNDS, &mut Sequence::new(9, 0).sample(i));
                        let t = (centre - photon.origin).dot(towards) / photon.direction.dot(towards);
                        let hit = photon.origin + photon.direction * t;
                        if t > 0.0 && hit.distance(centre) < cap { f64::from(photon.weight) } else { 0.0 }
                    })
                    .sum();
                let irradiance: f64 = (0..4096)
                    .map(|i| {
                        let mut sample = Sequence::new(11, 0).sample(i);
                        let p = sampling::disc(sample.next_2d()) * cap;
                        let x = centre + crate::basis::from_local(towards, Vec3::new(p.x, p.y, 0.0));
                        shape
                            .illuminate(x, sample.next_2d())
                            .map_or(0.0, |a| f64::from(a.irradiance * a.wi.dot(-towards).max(0.0)))
                    })
                    .sum::<f64>()
                    / 4096.0;
                let (got, expected) = (count / n as f64, irradiance * f64::from(PI * cap * cap));
                let tolerance = 4.0 * (expected / n as f64).sqrt() + 0.01 * expected;
                assert!(
                    (got - expected).abs() < tolerance,
                    "{shape:?} tilt {tilt}: {got:e} against {expected:e}"
                );
            }
        }
    }

    #[test]
    fn area_lights_emit_to_one_side_with_their_radiance() {
        let normal = PATCH.emitter_normal();
        assert!((normal - Vec3::NEG_Y).length() < 1e-6);
        assert!(PATCH.illuminate(Vec3::Y * 2.0, [0.5, 0.5]).is_none());
        let light = Light { shape: PATCH, power: Vec3::splat(7.0) };
        assert!((light.emitted_radiance().x - 7.0 / (PI * 0.35)).abs() < 1e-4);
        assert_eq!(TRIANGLE.area() * 2.0, PATCH.area());
    }

    #[test]
    fn a_light_at_the_receiver_is_finite() {
        let light = LightShape::Point { position: Vec3::ONE };
        assert_eq!(light.illuminate(Vec3::ONE, [0.5; 2]), None);
        assert!(
            light.illuminate(Vec3::ONE + Vec3::X * 1e-6, [0.5; 2]).is_none_or(|a| a.irradiance.is_finite())
        );
    }

    #[test]
    fn directional_photons_cover_the_bounds() {
        let shape = LightShape::Directional { direction: Vec3::new(0.6, -0.8, 0.0) };
        assert!((shape.watts_per_power(BOUNDS) - 4.0 * PI).abs() < 1e-5);
        for i in 0..1000 {
            let photon = shape.emit(BOUNDS, &mut Sequence::new(5, 0).sample(i));
            assert!((BOUNDS.centre - photon.origin).dot(photon.direction) > BOUNDS.radius);
            let miss = (BOUNDS.centre - photon.origin).cross(photon.direction).length();
            assert!(miss <= BOUNDS.radius * 1.0001);
        }
    }
}
