//! Turns the default Cornell box into figures: the gathering loop by instruction set, and camera rays.

use divan::Bencher;
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, Vsl, VslSet, Watch};
use photonstream_renderer_cpu::{InstructionSet, render_with};
use photonstream_scene::{Scene, Visibility};
use photonstream_shading::{sampling, sobol::Sequence, surface};
use std::path::Path;

fn main() {
    divan::main();
}

fn scene() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
    Scene::load(&path).expect("invariant: the default config loads")
}

fn vsls(scene: &Scene, count: u64) -> VslSet {
    let triangles = scene.geometry.triangles.len() as u64;
    let vsls = (0..count).map(|i| {
        let t = (i * triangles / count) as u32;
        let [u, v] = sampling::triangle(Sequence::new(1, 0).sample(i).next_2d());
        Vsl {
            position: surface::point(scene.geometry.triangle(t), u, v),
            normal: scene.geometry.normals[t as usize],
            flux: Vec3::splat(0.1),
            area: 0.1,
            object: scene.geometry.object_of[t as usize].0,
        }
    });
    VslSet::new(vsls).expect("invariant: normals of triangles are of unit length")
}

fn run(bencher: Bencher<'_, '_>, count: u64, layer: LayerKind, set: InstructionSet) {
    let scene = scene();
    let vsls = vsls(&scene, count);
    let options = RenderOptions {
        width: 800,
        height: 600,
        visibility: Visibility::None,
        layers: vec![layer],
        ..RenderOptions::from_settings(&scene.render)
    };
    bencher.bench(|| render_with(&scene, &vsls, &options, Watch::default(), set));
}

/// 800 × 600, camera rays alone.
#[divan::bench(sample_count = 10)]
fn camera_rays(bencher: Bencher<'_, '_>) {
    run(bencher, 0, LayerKind::Albedo, InstructionSet::Detected);
}

/// 800 × 600, camera rays and 200 lights without visibility.
#[divan::bench(sample_count = 10, args = [InstructionSet::Detected, InstructionSet::Avx2, InstructionSet::Portable])]
fn gather_200(bencher: Bencher<'_, '_>, set: InstructionSet) {
    run(bencher, 200, LayerKind::Indirect, set);
}
