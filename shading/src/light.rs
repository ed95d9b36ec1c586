//! Turns light sources into photons that leave them and irradiance that arrives from them.

use crate::{sampling, sky::Sky, sobol::Sample, surface};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;
use std::sync::Arc;

mod mesh;

pub use mesh::{EmissiveMesh, EmissivePlace};

/// A light source: a shape that says where light starts and how it spreads, and a power.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Where the light starts and how it spreads.
    pub shape: LightShape,
    /// Emitted power in W, linear RGB; for [`LightShape::Directional`] the irradiance in W m⁻² of a surface that
    /// faces the light, for [`LightShape::Sky`] the mean radiance over the sphere in W m⁻² sr⁻¹.
    pub power: Vec3,
}

/// Where a light starts and how it spreads. Lengths in metres from the scene's origin, directions of unit length.
#[derive(Clone, Debug, PartialEq)]
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
    /// A diffuse emitter of many triangles, which all emit the same radiance from their fronts.
    Mesh {
        /// Its triangles.
        mesh: Arc<EmissiveMesh>,
    },
    /// Light from infinitely far away in all directions.
    Sky {
        /// How it is spread over the directions.
        sky: Arc<Sky>,
    },
}

/// The sphere that holds all geometry: what light from infinitely far away has to reach.
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
    /// Its share of the light's power relative to the mean photon, linear RGB; the mean over all samples is 1 in each
    /// channel that shines. Grey but for a sky.
    pub weight: Vec3,
}

/// Light that reaches a point if nothing stands between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Illumination {
    /// Unit vector from the point to the light.
    pub wi: Vec3,
    /// Distance to the light in m; infinite for directional lights and skies.
    pub distance: f32,
    /// Irradiance of a surface that faces `wi`, in W m⁻² per unit of the light's `power`, linear RGB. Grey but for a sky.
    pub irradiance: Vec3,
}

impl LightShape {
    /// Watts emitted into the scene per unit of the light's `power`: 1, or for light from infinitely far away the cross
    /// section of `bounds` in m², times 4π sr for a sky.
    pub fn watts_per_power(&self, bounds: Bounds) -> f32 {
        let cross_section = PI * bounds.radius * bounds.radius;
        match self {
            Self::Directional { .. } => cross_section,
            Self::Sky { .. } => 4.0 * PI * cross_section,
            _ => 1.0,
        }
    }

    /// Whether it comes from infinitely far away: its beam covers the bounds of the scene.
    pub fn is_distant(&self) -> bool {
        matches!(self, Self::Directional { .. } | Self::Sky { .. })
    }

    /// The sky, if it is one.
    pub fn sky(&self) -> Option<&Arc<Sky>> {
        match self {
            Self::Sky { sky } => Some(sky),
            _ => None,
        }
    }

    /// One photon; takes two 2D dimensions of `sample`: for [`LightShape::emit_with`] the direction, then the position.
    #[inline]
    pub fn emit(&self, bounds: Bounds, sample: &mut Sample) -> Emission {
        let u = sample.next_2d();
        self.emit_with(bounds, u, sample.next_2d())
    }

    /// One photon from its random numbers: `u` for its direction (its place in the beam of a directional light),
    /// `u_position` for its place on an area light or in the beam of a sky, which other lights ignore.
    #[inline]
    pub fn emit_with(&self, bounds: Bounds, u: [f32; 2], u_position: [f32; 2]) -> Emission {
        match *self {
            Self::Point { position } => {
                Emission { origin: position, direction: sampling::sphere(u), weight: Vec3::ONE }
            }
            Self::Sky { ref sky } => {
                let sample = sky.sample(u);
                let weight = sample.relative / sky.importance(sample.relative);
                let weight = if weight.is_finite() { weight } else { Vec3::ZERO };
                Emission { origin: beam(bounds, -sample.wi, u_position), direction: -sample.wi, weight }
            }
            Self::Spot { position, direction: axis, versine_inner, versine_outer } => {
                let direction = sampling::cone(axis, versine_outer, u);
                // u[0] is uniform in the versine, so the profile needs no cosine of the rounded direction.
                let weight =
                    spot_profile(u[0] * versine_outer, versine_inner, versine_outer) * 2.0 * versine_outer
                        / (versine_inner + versine_outer);
                Emission { origin: position, direction, weight: Vec3::splat(weight) }
            }
            Self::Directional { direction } => {
                Emission { origin: beam(bounds, direction, u), direction, weight: Vec3::ONE }
            }
            Self::Mesh { ref mesh } => {
                let place = mesh.place(u_position);
                let direction = sampling::cosine_hemisphere(place.normal, u);
                Emission { origin: place.point, direction, weight: Vec3::ONE }
            }
            Self::Parallelogram { .. } | Self::Triangle { .. } => {
                let normal = self.emitter_normal();
                let origin = self.offset_emitter_point(u_position);
                Emission { origin, direction: sampling::cosine_hemisphere(normal, u), weight: Vec3::ONE }
            }
        }
    }

    /// What reaches a surface at `x` with the given normal: as [`LightShape::illuminate`], with all samples of a sky above
    /// the surface.
    #[inline]
    pub fn illuminate_surface(&self, x: Vec3, normal: Vec3, u: [f32; 2]) -> Option<Illumination> {
        match self {
            Self::Sky { sky } => {
                let (wi, irradiance) = sky.sample_above(normal, u)?;
                Some(Illumination { wi, distance: f32::INFINITY, irradiance })
            }
            _ => self.illuminate(x, u),
        }
    }

    /// What reaches `x`; `u` chooses the point of an area light or the direction of a sky. `None` where no light goes.
    ///
    /// For both this is one sample of the integral over the light: its mean over `u` is the irradiance.
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
                Some(Illumination { wi: -direction, distance: f32::INFINITY, irradiance: Vec3::ONE })
            }
            Self::Sky { ref sky } => {
                let sample = sky.sample(u);
                let irradiance = sample.relative * (4.0 * PI / sky.importance(sample.relative));
                let distance = f32::INFINITY;
                irradiance.is_finite().then_some(Illumination { wi: sample.wi, distance, irradiance })
            }
            Self::Mesh { ref mesh } => {
                let place = mesh.place(u);
                from_position(place.point - x, |wi| FRAC_1_PI * place.normal.dot(-wi).max(0.0))
            }
            Self::Parallelogram { .. } | Self::Triangle { .. } => {
                let normal = self.emitter_normal();
                from_position(self.offset_emitter_point(u) - x, |wi| FRAC_1_PI * normal.dot(-wi).max(0.0))
            }
        }
    }

    /// Whether one sample of [`LightShape::illuminate`] is exact: all but area lights and skies.
    pub fn is_delta(&self) -> bool {
        !matches!(
            self,
            Self::Parallelogram { .. } | Self::Triangle { .. } | Self::Mesh { .. } | Self::Sky { .. }
        )
    }

    /// Area of an emitter in m²; 0 for lights without one.
    pub fn area(&self) -> f32 {
        match *self {
            Self::Mesh { ref mesh } => mesh.area(),
            Self::Parallelogram { edge_u, edge_v, .. } => {
                edge_u.as_dvec3().cross(edge_v.as_dvec3()).length() as f32
            }
            Self::Triangle { edge_u, edge_v, .. } => {
                edge_u.as_dvec3().cross(edge_v.as_dvec3()).length() as f32 * 0.5
            }
            _ => 0.0,
        }
    }

    /// Unit normal of the emitting side; zero for lights without an area, and for meshes.
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
            Self::Directional { .. } | Self::Sky { .. } | Self::Mesh { .. } => return Vec3::ZERO,
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

    /// Radiance from infinitely far away in the direction `wi` of unit length, in W m⁻² sr⁻¹, where nothing stands
    /// between; zero for all lights but skies.
    #[inline]
    pub fn background(&self, wi: Vec3) -> Vec3 {
        self.shape.sky().map_or(Vec3::ZERO, |sky| self.power * sky.relative(wi))
    }
}

/// Where a photon starts that travels along `direction` from far away: a point of the disc beside `bounds`.
#[inline]
fn beam(bounds: Bounds, direction: Vec3, u: [f32; 2]) -> Vec3 {
    let disc = sampling::disc(u) * bounds.radius;
    let local = Vec3::new(disc.x, disc.y, 0.0);
    bounds.centre - direction * (1.01 * bounds.radius) + crate::basis::from_local(direction, local)
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
    (irradiance > 0.0 && irradiance.is_finite()).then_some(Illumination {
        wi,
        distance,
        irradiance: Vec3::splat(irradiance),
    })
}

#[cfg(test)]
mod tests;
