//! The GPU's pictures are the CPU's.

use crate::scenes::{self, Lit};
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_renderer_wgpu::{Shadows, Show, View};
use photonstream_scene::Visibility;
use photonstream_shading::Kernel;

/// Relative RMSE of `a` against `b` over the pixels that `counts` keeps.
fn rel_rmse(a: &[Vec3], b: &[Vec3], counts: impl Fn(usize) -> bool) -> f64 {
    let kept: Vec<_> = (0..a.len()).filter(|&i| counts(i)).collect();
    let square = |i: &usize| f64::from((a[*i] - b[*i]).length_squared());
    let mean = kept.iter().map(|&i| f64::from(b[i].element_sum())).sum::<f64>() / (3 * kept.len()) as f64;
    (kept.iter().map(square).sum::<f64>() / (3 * kept.len()) as f64).sqrt() / mean
}

fn cpu(lit: &Lit, view: &View, layers: &[LayerKind]) -> Vec<Vec<Vec3>> {
    let options = RenderOptions {
        width: view.width,
        height: view.height,
        kernel: view.kernel,
        visibility: view.visibility,
        epsilon: view.epsilon,
        light_samples: view.light_samples,
        layers: layers.to_vec(),
        ..RenderOptions::from_settings(&lit.scene.render)
    };
    let vsls = VslSet::from_records(&lit.frame.vsls).unwrap();
    let film = render(&lit.scene, &vsls, &options, Watch::default()).unwrap().film;
    film.layers().iter().map(|l| l.pixels.clone()).collect()
}

/// A first look: every layer of the Cornell box.
#[test]
fn every_layer_is_the_cpus() {
    let lit = scenes::cornell(
        "power_w = [14, 12.5, 10]\nspot = { position_m = [0.15, 1.95, 0.1], target_m = [-0.05, 0, -0.05], outer_half_angle_deg = 55, inner_half_angle_deg = 30 }",
        "vsls = 300\npool_paths = 8192",
    );
    let Some(mut renderer) = scenes::renderer(&lit) else { return };
    for kernel in Kernel::ALL {
        let view = View {
            width: 160,
            height: 120,
            kernel,
            visibility: Visibility::None,
            shadows: Shadows::Maps,
            epsilon: 0.0,
            ..View::from_settings(&lit.scene.render, &lit.scene.camera)
        };
        let expected = cpu(&lit, &view, &LayerKind::ALL);
        for (layer, expected) in LayerKind::ALL.into_iter().zip(expected) {
            renderer.draw(&View { show: Show::Layer(layer), ..view }).unwrap();
            let found = renderer.pixels().unwrap();
            let error = rel_rmse(&found, &expected, |_| true);
            let off = (0..found.len())
                .filter(|&i| (found[i] - expected[i]).length() > 0.05 * expected[i].length() + 1e-4)
                .count();
            eprintln!("{kernel} {layer}: {error:e}, {off} of {} pixels off", found.len());
        }
    }
}
