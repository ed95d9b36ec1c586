//! Turns a scene into random virtual point lights: one where each light path meets a surface.
//!
//! Source: Keller, "Instant Radiosity", SIGGRAPH 1997; deviates: photons survive with the probability max(albedo), as
//! everywhere here. Unbounded, a light is a point (kernel `paper`, area 0). Bounded, it has the area A that is its share
//! of all surfaces and kernel `disc`, 1/(π r² + A): the usual clamp of 1/r² with a rounded corner.

use crate::EvaluateError;
use glam::Vec3;
use photonstream_renderer::{Vsl, VslSet};
use photonstream_scene::{Detail, Scene, Side, bvh::Ray};
use photonstream_shading::{sampling, sobol::Sequence, surface};
use rayon::prelude::*;

const PATHS_PER_BLOCK: u64 = 256;
/// A scene whose light meets nothing has no virtual lights: more paths are not tried.
const MOST_PATHS: u64 = 1 << 20;
/// As streamed paths: a white path ends some day, too.
const MAX_SURVIVAL: f32 = 0.999;
/// The stream of light paths: not one of pixels.
const STREAM: u32 = 0x1b5;

/// At least `count` virtual lights (the last path is whole), fewer where no light meets a surface.
pub(super) fn lights(
    scene: &Scene,
    count: u32,
    seed: u64,
    is_bounded: bool,
) -> Result<VslSet, EvaluateError> {
    let power = Powers::new(scene);
    let sequence = Sequence::new(seed, STREAM);
    let (mut vsls, mut paths) = (Vec::new(), 0u64);
    'blocks: while power.total > 0.0 && paths < MOST_PATHS {
        let block: Vec<Vec<Vsl>> = (paths..paths + PATHS_PER_BLOCK)
            .into_par_iter()
            .map(|index| follow(scene, &power, sequence, index))
            .collect();
        for path in block {
            paths += 1;
            vsls.extend(path);
            if vsls.len() >= count as usize {
                break 'blocks;
            }
        }
    }
    let surfaces: f64 = (0..scene.geometry.triangles.len() as u32)
        .map(|id| {
            let object = &scene.objects[scene.geometry.object_of[id as usize].0 as usize];
            surface::area(scene.geometry.triangle(id)) * object.sides.iter().count() as f64
        })
        .sum();
    let area = if is_bounded { (surfaces / vsls.len().max(1) as f64) as f32 } else { 0.0 };
    let share = 1.0 / paths.max(1) as f32;
    Ok(VslSet::new(vsls.into_iter().map(|vsl| Vsl { flux: vsl.flux * share, area, ..vsl }))?)
}

/// Watts of all lights.
struct Powers {
    watts: Vec<Vec3>,
    total: f32,
}

impl Powers {
    fn new(scene: &Scene) -> Self {
        let watts: Vec<Vec3> = scene
            .lights
            .iter()
            .map(|light| light.light.power * light.light.shape.watts_per_power(scene.bounds))
            .collect();
        let total = watts.iter().map(|w| w.element_sum()).sum();
        Self { watts, total }
    }

    /// A light by its power, and its watts over the probability of that.
    fn pick(&self, u: f32) -> (usize, Vec3) {
        let mut left = u * self.total;
        let last = self.watts.len() - 1;
        for (index, watts) in self.watts.iter().enumerate() {
            let own = watts.element_sum();
            if (left < own || index == last) && own > 0.0 {
                return (index, *watts * (self.total / own));
            }
            left -= own;
        }
        (last, Vec3::ZERO)
    }
}

fn follow(scene: &Scene, power: &Powers, sequence: Sequence, index: u64) -> Vec<Vsl> {
    let mut sample = sequence.sample(index);
    let (light, mut flux) = power.pick(sample.next_1d());
    let emission = scene.lights[light].light.shape.emit(scene.bounds, &mut sample);
    flux *= emission.weight;
    let (mut origin, mut direction) = (emission.origin, emission.direction);
    let mut vsls = Vec::new();
    while flux.max_element() > 0.0 {
        let Some(hit) = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY }) else { break };
        let vertices = scene.geometry.triangle(hit.triangle);
        let front = scene.geometry.normals[hit.triangle as usize];
        let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
        let id = scene.geometry.object_of[hit.triangle as usize];
        let albedo = scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Finest);
        let survival = albedo.max_element().min(MAX_SURVIVAL);
        if !scene.objects[id.0 as usize].sides.contains(side) || survival <= 0.0 {
            break;
        }
        let normal = front * side.sign();
        let position = surface::point(vertices, hit.u, hit.v);
        vsls.push(Vsl { position, normal, flux: flux * albedo, area: 0.0, object: id.0 });
        if sample.next_1d() >= survival {
            break;
        }
        flux *= albedo / survival;
        origin = surface::offset(vertices, position, normal);
        direction = sampling::cosine_hemisphere(normal, sample.next_2d());
    }
    vsls
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_scene::SceneConfig;
    use std::path::Path;

    /// In a closed sphere of albedo ρ = 0.5 all light that leaves surfaces is P ρ/(1−ρ) = P. N = 20 000 lights of about
    /// 10 000 paths; a path's total has a standard deviation below 1.5 of its mean 1: 1.5 % of the sum, tolerance 4 σ.
    #[test]
    fn flux_of_a_closed_sphere() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/integrating-sphere.toml");
        let scene = SceneConfig::from_file(&path).unwrap().build().unwrap();
        let albedo = scene.albedo(photonstream_scene::ObjectId(0)).max_element();
        let vsls = lights(&scene, 20_000, 1, false).unwrap();
        let flux: Vec3 = vsls.flux().iter().sum();
        let power: Vec3 = scene.lights.iter().map(|l| l.light.power).sum();
        let expected = power * albedo / (1.0 - albedo);
        let error = (flux / expected - Vec3::ONE).abs().max_element();
        assert!(error < 0.06, "{flux} against {expected}");
        assert!(vsls.len() >= 20_000);
        let bounded = lights(&scene, 100, 1, true).unwrap();
        assert!(bounded.area().iter().all(|&a| a > 0.0));
    }
}
