//! Turns a camera ray into one sample of its radiance.

use super::lights::LightSampler;
use crate::surface::{self, Surface};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_shading::{sampling, sobol::Sample};

/// Radiance along a camera ray in W m⁻² sr⁻¹, in two parts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PathRadiance {
    /// Emitted light, that of the sky where nothing else is seen, and the first reflection.
    pub(crate) direct: Vec3,
    /// All later reflections.
    pub(crate) indirect: Vec3,
}

/// Largest probability to survive: a white path ends some day too.
const MAX_SURVIVAL: f32 = 0.999;

/// One sample of the radiance that `surface`, seen from the camera, sends back.
pub(crate) fn radiance(
    scene: &Scene,
    lights: &LightSampler<'_>,
    seen: &Surface,
    sample: &mut Sample,
    rays: &mut u64,
) -> PathRadiance {
    let mut surface = *seen;
    let reflected = |surface: &Surface, sample: &mut Sample, rays: &mut u64| {
        surface.albedo * FRAC_1_PI * lights.irradiance(surface, sample, rays)
    };
    if surface.albedo == Vec3::ZERO {
        return PathRadiance { direct: surface.emitted, indirect: Vec3::ZERO };
    }
    let direct = surface.emitted + reflected(&surface, sample, rays);
    let mut indirect = Vec3::ZERO;
    let mut beta = Vec3::ONE;
    loop {
        let survival = surface.albedo.max_element().min(MAX_SURVIVAL);
        if sample.next_1d() >= survival {
            break;
        }
        beta *= surface.albedo / survival;
        let direction = sampling::cosine_hemisphere(surface.normal, sample.next_2d());
        if direction.dot(surface.flat) <= 0.0 {
            // Above the shading normal's horizon, and into the surface itself.
            break;
        }
        *rays += 1;
        let Some(next) = surface::first(scene, surface.ray_origin, direction, 0.0) else { break };
        if next.albedo == Vec3::ZERO {
            break;
        }
        surface = next;
        indirect += beta * reflected(&surface, sample, rays);
    }
    PathRadiance { direct, indirect }
}
