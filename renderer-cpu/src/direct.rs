//! Turns lights into the irradiance that reaches a surface straight from them, with ray-traced shadows.

use crate::surface::Surface;
use glam::Vec3;
use photonstream_renderer::shadow_rays::SHADOW_REACH;
use photonstream_scene::{Scene, bvh::Ray};
use photonstream_shading::{Light, light::Illumination, sobol::Sample};

/// Irradiance in W m⁻² from `light` at `surface`, through the point of the light that `u` chooses; the number of rays
/// traced is added to `rays`.
#[inline]
pub(crate) fn irradiance(
    scene: &Scene,
    light: &Light,
    surface: &Surface,
    u: [f32; 2],
    rays: &mut u64,
) -> Vec3 {
    // Where the surface is, not where its rays start: a lamp may be nearer than a few times the way between.
    let Some(Illumination { wi, distance, irradiance }) =
        light.shape.illuminate_surface(surface.position, surface.normal, u)
    else {
        return Vec3::ZERO;
    };
    let cos_theta = surface.normal.dot(wi);
    if cos_theta <= 0.0 || light.power == Vec3::ZERO {
        return Vec3::ZERO;
    }
    *rays += 1;
    let (direction, t_max) = if distance.is_finite() {
        (wi * distance - (surface.ray_origin - surface.position), SHADOW_REACH)
    } else {
        (wi, f32::INFINITY)
    };
    let ray = Ray { origin: surface.ray_origin, direction, t_max };
    if scene.bvh.occluded(&ray) { Vec3::ZERO } else { light.power * (irradiance * cos_theta) }
}

/// Irradiance in W m⁻² from all lights, area lights and skies by `light_samples` stratified points or directions each.
pub(crate) fn irradiance_of_all(
    scene: &Scene,
    surface: &Surface,
    light_samples: u32,
    sample_of: impl Fn(u32) -> Sample,
    rays: &mut u64,
) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut area_lights = false;
    for light in &scene.lights {
        if light.light.shape.is_delta() {
            sum += irradiance(scene, &light.light, surface, [0.5; 2], rays);
        } else {
            area_lights = true;
        }
    }
    if area_lights {
        let mut area_sum = Vec3::ZERO;
        for index in 0..light_samples {
            let mut sample = sample_of(index);
            for light in scene.lights.iter().filter(|l| !l.light.shape.is_delta()) {
                area_sum += irradiance(scene, &light.light, surface, sample.next_2d(), rays);
            }
        }
        sum += area_sum / light_samples as f32;
    }
    sum
}
