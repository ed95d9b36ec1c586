//! Three ways to sum the same lights give the same picture, and say what their range loses.

use crate::{
    against_cpu::same_surface,
    scenes::{self, LAMPS, layer, rel_rmse},
};
use photonstream_renderer::{FrameRenderer, LayerKind, RenderOptions, Rendered, Watch};
use photonstream_renderer_cpu::CpuRenderer;
use photonstream_renderer_wgpu::{Accumulation, Choices, View, WgpuRenderer, test_gpu};
use photonstream_scene::{RangeCulling, Visibility};

/// Without a range and with one, in one batch of lights and in three; relative RMSE ≤ 1e-3. The sums differ in order
/// alone: 1e-5 is what is expected, so twice that is asserted where no pixel is cut off.
#[test]
fn forward_splat_and_tiled_agree() {
    for vsls in [150, 3000] {
        let lit = scenes::cornell(LAMPS[0].1, &format!("vsls = {vsls}\npool_paths = 4096"));
        let Some(mut renderer) = lit.renderer() else { return };
        let (cut, by_lot) = (RangeCulling::Cut, RangeCulling::Stochastic);
        for (epsilon, culling) in [(0.0, cut), (2e-3, cut), (2e-3, by_lot)] {
            let view = View { epsilon, culling, ..lit.view(97, 61) };
            let [forward, splat, tiled] = [Accumulation::Forward, Accumulation::Splat, Accumulation::Tiled]
                .map(|accumulation| {
                    layer(&mut renderer, &View { accumulation, ..view }, LayerKind::Indirect)
                });
            for (name, found) in [("splat", splat), ("forward", forward)] {
                let error = rel_rmse(&found, &tiled, |_| true);
                assert!(error <= 2e-5, "{vsls} lights, epsilon {epsilon}, {name}: {error:e}");
            }
            let whole = layer(&mut renderer, &View { epsilon: 0.0, ..view }, LayerKind::Indirect);
            let lost = rel_rmse(&tiled, &whole, |_| true);
            assert_eq!(lost > 1e-4, epsilon > 0.0, "the range cuts something off, or nothing: {lost:e}");
        }
    }
}

/// What a range loses is at most what is reported, for each accumulation; without a range nothing is reported.
#[test]
fn the_reported_loss_bounds_the_loss() {
    let lit = scenes::cornell(LAMPS[0].1, "vsls = 400\npool_paths = 4096");
    for accumulation in Accumulation::ALL {
        let Some(gpu) = test_gpu::gpu() else { return };
        let choices = Choices { accumulation: *accumulation, ..Choices::default() };
        let mut renderer = WgpuRenderer::new(gpu, choices).unwrap();
        let mut render = |epsilon| {
            let options = RenderOptions {
                width: 64,
                height: 64,
                epsilon,
                culling: RangeCulling::Cut,
                visibility: Visibility::None,
                layers: vec![LayerKind::Indirect],
                ..RenderOptions::from_settings(&lit.scene.render)
            };
            let rendered = renderer.render(&lit.scene, &lit.frame, &options, Watch::default()).unwrap();
            let sum: f64 = rendered.film.layers()[0].pixels.iter().map(|p| f64::from(p.max_element())).sum();
            (sum, rendered.stats.range_loss_share)
        };
        let (whole, nothing) = render(0.0);
        assert_eq!(nothing, 0.0);
        for epsilon in [1e-4, 1e-3, 5e-3] {
            let (kept, reported) = render(epsilon);
            let lost = (whole - kept) / kept;
            assert!(
                lost <= reported + 1e-6,
                "{accumulation}, {epsilon}: lost {lost:e}, reported {reported:e}"
            );
            assert!(epsilon < 1e-3 || lost > 1e-3, "{accumulation}, {epsilon}: nothing was cut off");
        }
    }
}

/// Lights drawn by lot are those of the CPU: every accumulation and rays to every light, relative RMSE ≤ 1e-3, and both report
/// no loss. The GPU bounds the error closer, by tiles of 16 pixels and without lights that all of a tile faces away from, but not
/// by a fifth. 48 × 40 pixels, 400 lights, ε = 1e-2, where the lots change the picture by more than 0.01. The same options twice
/// give the same bits.
#[test]
fn lots_are_the_cpus() {
    let lit = scenes::cornell(LAMPS[0].1, "vsls = 400\npool_paths = 4096");
    for accumulation in Accumulation::ALL {
        for visibility in [Visibility::None, Visibility::Rays] {
            let Some(gpu) = test_gpu::gpu() else { return };
            let choices = Choices { accumulation: *accumulation, rays_per_pixel: 0, ..Choices::default() };
            let mut renderer = WgpuRenderer::new(gpu, choices).unwrap();
            let options = RenderOptions {
                width: 48,
                height: 40,
                epsilon: 1e-2,
                culling: RangeCulling::Stochastic,
                visibility,
                layers: vec![LayerKind::Indirect, LayerKind::Normal, LayerKind::Albedo],
                ..RenderOptions::from_settings(&lit.scene.render)
            };
            let mut render = |options: &RenderOptions| {
                renderer.render(&lit.scene, &lit.frame, options, Watch::default()).unwrap()
            };
            let found = render(&options);
            assert_eq!(render(&options).film, found.film, "the same bits again");
            let expected = CpuRenderer.render(&lit.scene, &lit.frame, &options, Watch::default()).unwrap();
            let pixels = |rendered: &Rendered, layer: usize| rendered.film.layers()[layer].pixels.clone();
            let [normals, albedos] = [1, 2].map(|i| [pixels(&found, i), pixels(&expected, i)]);
            let same = same_surface([&normals[0], &normals[1]], [&albedos[0], &albedos[1]]);
            let error = rel_rmse(&pixels(&found, 0), &pixels(&expected, 0), |i| same[i]);
            assert!(error <= 1e-3, "{accumulation}, {visibility:?}: {error:e}");
            let whole = render(&RenderOptions { epsilon: 0.0, ..options.clone() });
            let lots = rel_rmse(&pixels(&found, 0), &pixels(&whole, 0), |_| true);
            let (stated, on_cpu) = (found.stats.range_error, expected.stats.range_error);
            println!(
                "{accumulation}, {visibility:?}: lots {lots:.3}, stated {stated:.3}, on the CPU {on_cpu:.3}"
            );
            assert!(lots > 0.01 && stated > 0.0, "{lots}, stated {stated}");
            assert!(stated <= on_cpu * 1.001 && stated > 0.8 * on_cpu, "{stated}, on the CPU {on_cpu}");
            assert_eq!((found.stats.range_loss_share, whole.stats.range_error), (0.0, 0.0));
        }
    }
}
