//! Turns lights into virtual point lights where a few photons of fixed directions meet the scene.
//!
//! Source: Keller, "Instant Radiosity", SIGGRAPH 1997, as paper B §5.3.4 has it: one bounce, and directions that stay the
//! same from update to update, so that a still scene has still light. Deviates: directions are low-discrepancy samples of
//! the lights' own profiles instead of uniform random ones.

use super::{Shown, nearest};
use crate::{apportion::apportion, emitters::watts, streams::stream_of};
use core::f32::consts::PI;
use glam::Vec3;
use photonstream_running_light::VirtualLight;
use photonstream_scene::{Detail, ObjectId, Scene, Side, bvh::Ray};
use photonstream_shading::{sobol::Sequence, surface};

/// The stream of directions.
const STREAM: u32 = 0x1b6;

/// The photons of each light: equal shares of the scene's number of them, at least one. A light that is dimmed keeps them.
pub(super) fn counts(scene: &Scene) -> Vec<u32> {
    if scene.lights.is_empty() {
        return Vec::new();
    }
    let equal = 1.0 / scene.lights.len() as f64;
    apportion(&vec![equal; scene.lights.len()], scene.vpls.settings.photons)
}

/// For each light of the scene one virtual light for each of its photons; without flux where it meets nothing that reflects.
pub(super) fn trace(scene: &Scene) -> Vec<Vec<Shown>> {
    let counts = counts(scene);
    let watts = watts(scene);
    let lights = scene.lights.iter().zip(watts).zip(counts);
    lights
        .map(|((light, watts), count)| {
            let sequence = Sequence::new(scene.streaming.seed, stream_of(&light.name, STREAM));
            let photon = |index: u32| {
                let emission = light.light.shape.emit(scene.bounds, &mut sequence.sample(index.into()));
                let flux = watts * emission.weight / count as f32;
                meet(scene, emission.origin, emission.direction, flux).unwrap_or(Shown::NONE)
            };
            (0..count).map(photon).collect()
        })
        .collect()
}

/// The virtual light where a photon of `flux` W meets a reflecting surface.
fn meet(scene: &Scene, origin: Vec3, direction: Vec3, flux: Vec3) -> Option<Shown> {
    if flux == Vec3::ZERO {
        return None;
    }
    let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
    let front = scene.geometry.normals[hit.triangle as usize];
    let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
    let object: ObjectId = scene.geometry.object_of[hit.triangle as usize];
    if !scene.objects[object.0 as usize].sides.contains(side) {
        return None;
    }
    let albedo = scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Finest);
    let position = surface::point(scene.geometry.triangle(hit.triangle), hit.u, hit.v);
    let light = VirtualLight { position, normal: front * side.sign(), flux: flux * albedo, area: 0.0 };
    Some(Shown { light, object: Some(object) })
}

/// Gives each light that shines the area that it stands for: a disc half way to the closest other one.
pub(super) fn give_areas(scene: &Scene, lights: &mut [Shown]) {
    let shining: Vec<usize> =
        (0..lights.len()).filter(|&index| lights[index].light.flux != Vec3::ZERO).collect();
    let places: Vec<Vec3> = shining.iter().map(|&index| lights[index].light.position).collect();
    let share = (scene.reflecting_area_m2() / shining.len().max(1) as f64) as f32;
    for (&index, distance_sq) in shining.iter().zip(nearest::squared_distances(&places)) {
        let disc = PI * 0.25 * distance_sq;
        // One alone has no disc, nor have those that coincide.
        lights[index].light.area = if disc > 0.0 && disc.is_finite() { disc } else { share };
    }
}
