//! Turns scenes into the claim that rays on the device bring what the CPU renderer's rays bring.
#![allow(clippy::unwrap_used)]

use super::{bindings::buffer, *};
use crate::{
    layout::{ALL_LIGHTS, CameraUniform, FrameUniform, LightUniform, VslUniform},
    readback,
    shadow_views::light_uniform,
    targets::{GBUFFER, HDR, Target},
    test_gpu::gpu,
};
use glam::Vec2;
use photonstream_renderer::{LayerKind, RenderOptions, Vsl, VslSet};
use photonstream_scene::{RangeCulling, RenderSettings, Scene, SceneConfig, Side, Visibility, bvh::Ray};
use photonstream_shading::{Camera, Kernel, culling, kernel, octahedral, sampling, sobol::Sequence, surface};
use std::path::Path;
use wgpu::{BufferUsages, TextureUsages};

mod answers;
mod holes;
mod pictures;
mod splitting;

fn scene(text: &str) -> Scene {
    SceneConfig::from_text(text, Path::new("test.toml")).unwrap().build().unwrap()
}

fn config(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name)).unwrap()
}

/// Rays against `scene` and its holes.
fn rays_of(gpu: &Gpu, scene: &Scene) -> Rays {
    let holes = scene.bvh.has_holes().then(|| Arc::new(Source::of(scene)));
    Rays::new(gpu, &scene.geometry, holes.as_ref()).unwrap()
}

/// A picture on the device: what each pixel sees, taken from the CPU's rays, and the frame's numbers.
struct Picture {
    gpu: Gpu,
    rays: Rays,
    sky: SkyOnDevice,
    frame: FrameUniform,
    frame_buffer: wgpu::Buffer,
    gbuffer: Target,
    output: Target,
}

impl Picture {
    fn new(gpu: &Gpu, scene: &Scene, size: [u32; 2]) -> Self {
        let (lo, hi) = scene.bvh.bounds();
        let Camera { position, forward, right, up, tan_half_fov } = scene.camera;
        let frame = FrameUniform {
            camera: CameraUniform {
                position: position.to_array(),
                tan_half_fov,
                forward: forward.to_array(),
                right: right.to_array(),
                up: up.to_array(),
                ..CameraUniform::default()
            },
            size,
            jitter: [0.5; 2],
            albedo_max: 1.0,
            magnitude: lo.abs().max(hi.abs()).max_element(),
            area_factor: 1.0,
            light_samples: 1,
            seed_low: 1,
            only_light: ALL_LIGHTS,
            ..FrameUniform::default()
        };
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let gbuffer = Target::new(gpu, "G-buffer", size, GBUFFER, usage);
        let words: Vec<[u32; 4]> = (0..size[0] * size[1])
            .map(|i| {
                let at = Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5);
                let direction = scene.camera.direction(at.x, at.y, size[0], size[1]);
                let ray = Ray { origin: position, direction, t_max: f32::INFINITY };
                let Some(hit) = scene.bvh.closest(&ray) else { return [0; 4] };
                let front = scene.geometry.normals[hit.triangle as usize];
                let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
                let folded = octahedral::encode(front * side.sign());
                let object = scene.geometry.object_of[hit.triangle as usize].0;
                let word = object << 1 | u32::from(side == Side::Front);
                [hit.t.to_bits(), folded.x.to_bits(), folded.y.to_bits(), word]
            })
            .collect();
        let row = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size[0] * 16),
            rows_per_image: None,
        };
        let copied = gbuffer.texture.as_image_copy();
        gpu.queue.write_texture(copied, bytemuck::cast_slice(&words), row, gbuffer.texture.size());
        let usage = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        let rays = rays_of(gpu, scene);
        let mut sky = SkyOnDevice::new(gpu);
        sky.update(gpu, &scene.lights).unwrap();
        let bytes = size_of::<FrameUniform>() as u64;
        let frame_buffer = buffer(gpu, "frame", bytes, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let output = Target::new(gpu, "irradiance", size, HDR, usage);
        Self { gpu: gpu.clone(), rays, sky, frame, frame_buffer, gbuffer, output }
    }

    fn direct(&mut self, scene: &Scene, light_samples: u32) -> (Vec<Vec3>, Traced) {
        let mut lights: Vec<LightUniform> =
            scene.lights.iter().map(|l| light_uniform(&l.light.shape, l.light.power)).collect();
        (self.frame.lights, self.frame.light_samples) = (lights.len() as u32, light_samples);
        let count = lights.len() as u32;
        lights.resize(lights.len().max(1), LightUniform::default());
        let lights = upload(&self.gpu, "lights", bytemuck::cast_slice(&lights));
        self.trace(&lights, count, 0, |rays, gpu, encoder, inputs| {
            rays.encode_direct(gpu, encoder, inputs, light_samples)
        })
    }

    fn indirect(&mut self, vsls: &VslSet, epsilon: f32, budget: u32, sample: u32) -> (Vec<Vec3>, Traced) {
        let mut lights: Vec<VslUniform> = (0..vsls.len())
            .filter_map(|i| vsls.get(i))
            .zip(0..)
            .map(|(v, index)| VslUniform {
                position: v.position.to_array(),
                range_sq: kernel::range_sq(v.flux.max_element(), self.frame.albedo_max, epsilon)
                    / if self.frame.flux_of_range > 0.0 {
                        culling::lot(index, self.frame.first_lot)
                    } else {
                        1.0
                    },
                normal: v.normal.to_array(),
                area_term: v.area,
                flux: v.flux.to_array(),
                object: v.object,
            })
            .collect();
        let count = lights.len() as u32;
        self.frame.vsls = count;
        // Buffers are whole batches: what lies behind the lights must not be read.
        let beyond = VslUniform {
            position: [0.0, 1.0, 0.0],
            normal: [0.0, 1.0, 0.0],
            flux: [1e9; 3],
            range_sq: 1e9,
            area_term: 1.0,
            object: 0,
        };
        lights.push(beyond);
        let lights = upload(&self.gpu, "lights", bytemuck::cast_slice(&lights));
        self.trace(&lights, count, sample, |rays, gpu, encoder, inputs| {
            rays.encode_indirect(gpu, encoder, inputs, budget)
        })
    }

    fn trace(
        &mut self,
        lights: &wgpu::Buffer,
        count: u32,
        sample: u32,
        trace: impl FnOnce(&mut Rays, &Gpu, &mut wgpu::CommandEncoder, &RayInputs<'_>) -> Result<Traced, GpuError>,
    ) -> (Vec<Vec3>, Traced) {
        self.gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&self.frame));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let patches = upload(&self.gpu, "no patches", &[0; size_of::<photonstream_protocol::PatchRecord>()]);
        let inputs = RayInputs {
            frame: &self.frame_buffer,
            gbuffer: &self.gbuffer.view,
            size: self.frame.size,
            lights,
            patches: &patches,
            sky: &self.sky,
            count,
            sample,
            output: &self.output.view,
            watch: Watch::default(),
        };
        let traced = trace(&mut self.rays, &self.gpu, &mut encoder, &inputs).unwrap();
        self.gpu.queue.submit([encoder.finish()]);
        (readback::colours(&self.gpu, &self.output.texture).unwrap(), traced)
    }
}

/// `count` lights of random flux over the surface of a scene, by area. Seed 11.
fn scattered_vsls(scene: &Scene, count: usize) -> VslSet {
    let geometry = &scene.geometry;
    let triangles = 0..geometry.triangles.len() as u32;
    let areas: Vec<f64> = triangles.map(|t| surface::area(geometry.triangle(t))).collect();
    let total: f64 = areas.iter().sum();
    let mut vsls = Vec::new();
    let mut sum = 0.0;
    for (t, area) in areas.iter().enumerate() {
        sum += area / total * count as f64;
        while (vsls.len() as f64) + 0.5 < sum {
            let mut sample = Sequence::new(11, 0).sample(vsls.len() as u64);
            let [u, v] = sampling::triangle(sample.next_2d());
            let object = geometry.object_of[t];
            let side = scene.objects[object.0 as usize].sides.iter().next().unwrap();
            vsls.push(Vsl {
                position: surface::point(geometry.triangle(t as u32), u, v),
                normal: geometry.normals[t] * side.sign(),
                flux: Vec3::new(sample.next_1d(), sample.next_1d(), sample.next_1d()) / count as f32,
                area: (total / count as f64) as f32,
                object: object.0,
            });
        }
    }
    VslSet::new(vsls).unwrap()
}

/// Without a range.
const WHOLE: (f32, RangeCulling) = (0.0, RangeCulling::Cut);

/// The CPU renderer's irradiance where a surface reflects and does not shine itself, else `None`.
fn expected(
    scene: &Scene,
    vsls: &VslSet,
    size: [u32; 2],
    layer: LayerKind,
    light_samples: u32,
    (epsilon, culling): (f32, RangeCulling),
) -> Vec<Option<Vec3>> {
    let options = RenderOptions {
        width: size[0],
        height: size[1],
        kernel: Kernel::Disc,
        visibility: Visibility::Rays,
        epsilon,
        culling,
        light_samples,
        layers: vec![layer, LayerKind::Albedo],
        ..RenderOptions::from_settings(&RenderSettings::default())
    };
    let rendered = photonstream_renderer_cpu::render(scene, vsls, &options, Watch::default()).unwrap();
    let [shown, albedo] = [layer, LayerKind::Albedo].map(|l| &rendered.film.layer(l.name()).unwrap().pixels);
    let shines = |index: usize| {
        let (x, y) = (index as u32 % size[0], index as u32 / size[0]);
        let direction = scene.camera.direction(x as f32 + 0.5, y as f32 + 0.5, size[0], size[1]);
        let hit = scene.bvh.closest(&Ray { origin: scene.camera.position, direction, t_max: f32::INFINITY });
        hit.is_some_and(|h| {
            scene.objects[scene.geometry.object_of[h.triangle as usize].0 as usize].emitter.is_some()
        })
    };
    (0..shown.len())
        .map(|i| {
            (albedo[i].min_element() > 0.0 && !shines(i)).then(|| shown[i] / albedo[i] * std::f32::consts::PI)
        })
        .collect()
}

/// Rel. RMSE of `found` over the pixels that have an expected value.
fn relative_rmse(found: &[Vec3], expected: &[Option<Vec3>]) -> f64 {
    let pairs =
        || found.iter().zip(expected).filter_map(|(f, e)| Some((f.as_dvec3(), e.as_ref()?.as_dvec3())));
    let count = pairs().count() as f64 * 3.0;
    let square: f64 = pairs().map(|(f, e)| (f - e).length_squared()).sum();
    let mean = pairs().map(|(_, e)| e.element_sum()).sum::<f64>() / count;
    assert!(mean > 0.0, "a lit picture");
    (square / count).sqrt() / mean
}
