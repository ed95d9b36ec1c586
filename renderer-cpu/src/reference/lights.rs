//! Turns a surface into one sample of the light that reaches it straight from the lights.

use crate::{direct, surface::Surface};
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_shading::sobol::Sample;

/// Up to so many lights, each is sampled at every vertex; of more, one by its power.
const SAMPLE_ALL_UP_TO: usize = 8;

/// Chooses lights to sample.
pub(crate) struct LightSampler<'a> {
    scene: &'a Scene,
    /// Running sums of the lights' shares of the power, the last one 1; empty where all are sampled.
    cumulative: Vec<f32>,
}

impl<'a> LightSampler<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let watts = |light: &photonstream_scene::SceneLight| {
            f64::from(light.light.power.element_sum() * light.light.shape.watts_per_power(scene.bounds))
        };
        let total: f64 = scene.lights.iter().map(watts).sum();
        let cumulative = if scene.lights.len() > SAMPLE_ALL_UP_TO && total > 0.0 {
            let sums = scene.lights.iter().scan(0.0, |sum, light| {
                *sum += watts(light) / total;
                Some(*sum as f32)
            });
            sums.collect()
        } else {
            Vec::new()
        };
        Self { scene, cumulative }
    }

    /// One sample of the irradiance of all lights in W m⁻²; its mean is the irradiance.
    pub(crate) fn irradiance(&self, surface: &Surface, sample: &mut Sample, rays: &mut u64) -> Vec3 {
        if self.cumulative.is_empty() {
            let lights = self.scene.lights.iter();
            return lights
                .map(|light| {
                    let light = &light.light;
                    let u = if light.shape.is_delta() { [0.5; 2] } else { sample.next_2d() };
                    direct::irradiance(self.scene, light, surface, u, rays)
                })
                .sum();
        }
        let u = sample.next_1d();
        let index = self.cumulative.partition_point(|&sum| sum <= u).min(self.cumulative.len() - 1);
        let before = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let probability = self.cumulative[index] - before;
        let light = &self.scene.lights[index].light;
        let u = sample.next_2d();
        if probability <= 0.0 {
            // Rounding has picked a dark light at the end of the list.
            return Vec3::ZERO;
        }
        direct::irradiance(self.scene, light, surface, u, rays) / probability
    }
}
