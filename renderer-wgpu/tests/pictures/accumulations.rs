//! Three ways to sum the same lights give the same picture, and say what their range loses.

use crate::scenes::{self, LAMPS, layer, rel_rmse};
use photonstream_renderer::{FrameRenderer, LayerKind, RenderOptions, Watch};
use photonstream_renderer_wgpu::{Accumulation, Choices, View, WgpuRenderer, test_gpu};
use photonstream_scene::Visibility;

/// Without a range and with one, in one batch of lights and in three; relative RMSE ≤ 1e-3. The sums differ in order
/// alone: 1e-5 is what is expected, so twice that is asserted where no pixel is cut off.
#[test]
fn forward_splat_and_tiled_agree() {
    for vsls in [150, 3000] {
        let lit = scenes::cornell(LAMPS[0].1, &format!("vsls = {vsls}\npool_paths = 4096"));
        let Some(mut renderer) = lit.renderer() else { return };
        for epsilon in [0.0, 2e-3] {
            let view = View { epsilon, ..lit.view(97, 61) };
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
