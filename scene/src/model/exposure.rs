//! Turns a lit scene into the exposure that brings what its camera sees to a middle grey.

use crate::{
    bvh::Ray,
    scene::{Scene, Side},
    texturing::Detail,
};
use glam::Vec3;
use photonstream_shading::{
    sampling,
    sobol::{Sample, Sequence},
    surface,
    tone::luminance,
};
use std::f32::consts::FRAC_1_PI;

/// Pixels, paths for each, and reflections of a path.
const PIXELS: (u32, u32) = (32, 24);
const PATHS: u64 = 8;
const REFLECTIONS: u32 = 4;
/// What the geometric mean of the radiances is brought to.
const MIDDLE: f32 = 0.15;
/// Radiances below this share of their mean count as much.
const DARK: f32 = 0.02;

/// Stops, to a tenth, within ±32; `None` where the camera sees no light. 32 × 24 pixels of 8 paths.
pub(super) fn exposure_ev(scene: &Scene) -> Option<f64> {
    let mut radiances = Vec::new();
    for pixel in 0..PIXELS.0 * PIXELS.1 {
        let mut sum = Vec3::ZERO;
        let mut is_seen = false;
        for path in 0..PATHS {
            let mut sample = Sequence::new(17, pixel).sample(path);
            let [u, v] = sample.next_2d();
            let x = ((pixel % PIXELS.0) as f32 + u) * scene.render.width as f32 / PIXELS.0 as f32;
            let y = ((pixel / PIXELS.0) as f32 + v) * scene.render.height as f32 / PIXELS.1 as f32;
            let direction = scene.camera.direction(x, y, scene.render.width, scene.render.height);
            let found = radiance(scene, scene.camera.position, direction, &mut sample);
            is_seen |= found.is_some();
            sum += found.unwrap_or_default();
        }
        if is_seen {
            radiances.push(luminance(sum / PATHS as f32));
        }
    }
    let number = radiances.len() as f32;
    let mean = radiances.iter().sum::<f32>() / number;
    if !(mean > 0.0 && mean.is_finite()) {
        return None;
    }
    let log_mean = radiances.iter().map(|l| l.max(DARK * mean).log2()).sum::<f32>() / number;
    let stops = f64::from(MIDDLE.log2() - log_mean);
    Some(((stops * 10.0).round() / 10.0).clamp(-32.0, 32.0))
}

/// One sample of the radiance along a ray; `None` where it meets nothing.
fn radiance(scene: &Scene, mut origin: Vec3, mut direction: Vec3, sample: &mut Sample) -> Option<Vec3> {
    let (mut sum, mut beta) = (Vec3::ZERO, Vec3::ONE);
    for reflection in 0..REFLECTIONS {
        let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY });
        let Some(hit) = hit else { return (reflection > 0).then_some(sum) };
        let front = scene.geometry.normals[hit.triangle as usize];
        let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
        let object = scene.geometry.object_of[hit.triangle as usize];
        if reflection == 0 {
            sum += scene.emitted_radiance(object, side);
        }
        if !scene.objects[object.0 as usize].sides.contains(side) {
            break;
        }
        let vertices = scene.geometry.triangle(hit.triangle);
        let normal = front * side.sign();
        origin = surface::offset(vertices, surface::point(vertices, hit.u, hit.v), normal);
        beta *= scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Transport);
        sum += beta * FRAC_1_PI * irradiance(scene, origin, normal, sample);
        direction = sampling::cosine_hemisphere(normal, sample.next_2d());
    }
    Some(sum)
}

/// One sample of the irradiance that lights give straight: of one of them, drawn by lot.
fn irradiance(scene: &Scene, origin: Vec3, normal: Vec3, sample: &mut Sample) -> Vec3 {
    let number = scene.lights.len();
    if number == 0 {
        return Vec3::ZERO;
    }
    let index = ((sample.next_1d() * number as f32) as usize).min(number - 1);
    let light = &scene.lights[index].light;
    let Some(arriving) = light.shape.illuminate(origin, sample.next_2d()) else { return Vec3::ZERO };
    let cos = normal.dot(arriving.wi);
    let ray = Ray { origin, direction: arriving.wi, t_max: arriving.distance };
    if cos <= 0.0 || scene.bvh.occluded(&ray) {
        return Vec3::ZERO;
    }
    light.power * (arriving.irradiance * cos * number as f32)
}
