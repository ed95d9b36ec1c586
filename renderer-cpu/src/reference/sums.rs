//! Gathers path samples per pixel in two independent halves, whose difference tells the noise of their mean.

use super::{
    ReferenceOptions,
    lights::LightSampler,
    options::PixelFilter,
    path::{self, PathRadiance},
};
use crate::surface::{self, Surface};
use glam::{DVec3, Vec3};
use photonstream_renderer::{LayerKind, RenderError, Watch};
use photonstream_scene::Scene;
use photonstream_shading::sobol::Sequence;
use rayon::prelude::*;
use std::sync::atomic::AtomicUsize;

/// Sums of samples for each pixel.
pub(crate) struct Sums {
    width: u32,
    height: u32,
    pixels: Vec<PixelSums>,
    /// Samples per pixel in each half.
    pub(crate) samples_per_half: u64,
    /// Rays traced.
    pub(crate) rays: u64,
}

#[derive(Clone, Copy, Default)]
struct PixelSums {
    direct: [DVec3; 2],
    indirect: [DVec3; 2],
}

impl PixelSums {
    fn of(&self, layer: LayerKind, half: usize) -> DVec3 {
        match layer {
            LayerKind::Direct => self.direct[half],
            LayerKind::Indirect => self.indirect[half],
            _ => self.direct[half] + self.indirect[half],
        }
    }
}

/// Scrambles the second half apart from the first.
const SECOND_HALF: u64 = 0x9E37_79B9_7F4A_7C15;

impl Sums {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let pixels = vec![PixelSums::default(); width as usize * height as usize];
        Self { width, height, pixels, samples_per_half: 0, rays: 0 }
    }

    /// Adds `size` samples to each half of every pixel.
    pub(crate) fn add_pass(
        &mut self,
        scene: &Scene,
        options: &ReferenceOptions,
        size: u64,
        watch: Watch<'_>,
    ) -> Result<(), RenderError> {
        let lights = LightSampler::new(scene);
        let done = AtomicUsize::new(0);
        let (first, rows) = (self.samples_per_half, self.height as usize);
        let rays: u64 = self
            .pixels
            .par_chunks_mut(self.width as usize)
            .enumerate()
            .map(|(y, row)| {
                watch.check()?;
                let mut rays = 0;
                for (x, pixel) in row.iter_mut().enumerate() {
                    let tracer = PixelTracer { scene, options, lights: &lights, x: x as u32, y: y as u32 };
                    tracer.add(pixel, first, size, &mut rays);
                }
                watch.advance(&done, rows);
                Ok(rays)
            })
            .sum::<Result<u64, RenderError>>()?;
        self.rays += rays;
        self.samples_per_half += size;
        Ok(())
    }

    /// The mean of all samples.
    pub(crate) fn mean(&self, layer: LayerKind) -> Vec<Vec3> {
        let share = 0.5 / self.samples_per_half as f64;
        self.pixels.iter().map(|p| ((p.of(layer, 0) + p.of(layer, 1)) * share).as_vec3()).collect()
    }

    /// Estimated relative RMSE of the mean: the RMS of half the difference of the halves over the mean.
    pub(crate) fn noise(&self, layer: LayerKind) -> f64 {
        let (mut sum, mut square) = (0.0, 0.0);
        for pixel in &self.pixels {
            let (a, b) = (pixel.of(layer, 0), pixel.of(layer, 1));
            sum += (a + b).element_sum();
            square += (a - b).length_squared();
        }
        let values = self.pixels.len() as f64 * 3.0;
        if sum > 0.0 { (square / values).sqrt() / (sum / values) } else { 0.0 }
    }
}

struct PixelTracer<'a> {
    scene: &'a Scene,
    options: &'a ReferenceOptions,
    lights: &'a LightSampler<'a>,
    x: u32,
    y: u32,
}

impl PixelTracer<'_> {
    fn add(&self, pixel: &mut PixelSums, first: u64, size: u64, rays: &mut u64) {
        let stream = self.y * self.options.width + self.x;
        // All samples at the centre see the same surface.
        let centre = match self.options.pixel_filter {
            PixelFilter::Centre => {
                *rays += 1;
                match self.see([0.5, 0.5]) {
                    Ok(surface) => Some(surface),
                    Err(background) => {
                        pixel.direct.iter_mut().for_each(|half| *half += background.as_dvec3() * size as f64);
                        return;
                    }
                }
            }
            PixelFilter::Box => None,
        };
        for half in 0..2 {
            let sequence = Sequence::new(self.options.seed ^ (SECOND_HALF * half as u64), stream);
            for index in first..first + size {
                let mut sample = sequence.sample(index);
                let seen = centre.map_or_else(
                    || {
                        *rays += 1;
                        self.see(sample.next_2d())
                    },
                    Ok,
                );
                let surface = match seen {
                    Ok(surface) => surface,
                    Err(background) => {
                        pixel.direct[half] += background.as_dvec3();
                        continue;
                    }
                };
                let PathRadiance { direct, indirect } =
                    path::radiance(self.scene, self.lights, &surface, &mut sample, rays);
                pixel.direct[half] += direct.as_dvec3();
                pixel.indirect[half] += indirect.as_dvec3();
            }
        }
    }

    /// The surface at a place of the pixel, or the radiance of what lies behind all surfaces.
    fn see(&self, [u, v]: [f32; 2]) -> Result<Surface, Vec3> {
        let (width, height) = (self.options.width, self.options.height);
        let camera = &self.scene.camera;
        let direction = camera.direction(self.x as f32 + u, self.y as f32 + v, width, height);
        surface::seen(self.scene, camera.position, direction, 0.0)
            .ok_or_else(|| self.scene.background(direction))
    }
}
