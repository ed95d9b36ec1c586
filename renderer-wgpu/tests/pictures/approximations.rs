//! What is faster than exact has an error that is known.

use crate::scenes::{self, LAMPS, layer, rel_rmse};
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::View;
use photonstream_scene::Visibility;

/// Interleaved sampling, 160 × 120 pixels, 1 000 lights: measured 1.6 % and 2.3 % relative RMSE in this view, most of it
/// in the first row of pixels along contacts. The limits leave a half more for other devices' rounding at edges.
#[test]
fn interleaving_costs_little() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 1000\npool_paths = 16384");
    let Some(mut renderer) = lit.renderer() else { return };
    let view = lit.view(160, 120);
    let exact = layer(&mut renderer, &view, LayerKind::Indirect);
    for (interleave, limit) in [(2, 0.024), (4, 0.035)] {
        let found = layer(&mut renderer, &View { interleave, ..view }, LayerKind::Indirect);
        let error = rel_rmse(&found, &exact, |_| true);
        // It is an approximation, and it keeps the brightness.
        assert!(error > 1e-4 && error <= limit, "{interleave}: {error:e}");
        let sum = |p: &[glam::Vec3]| p.iter().map(|p| f64::from(p.element_sum())).sum::<f64>();
        assert!((sum(&found) / sum(&exact) - 1.0).abs() < 0.005, "{interleave}");
    }
}

/// Ambient occlusion darkens contacts only: it takes light, never adds any, leaves open walls as they are, and is no
/// farther from ray-traced shadows than none at all. 80 × 60 pixels, 100 lights.
#[test]
fn occlusion_darkens_contacts_towards_the_truth() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 100\npool_paths = 8192");
    let Some(mut renderer) = lit.renderer() else { return };
    let view = lit.view(80, 60);
    let none = layer(&mut renderer, &view, LayerKind::Indirect);
    let ao = layer(&mut renderer, &View { visibility: Visibility::Ao, ..view }, LayerKind::Indirect);
    assert!(none.iter().any(|p| p.x > 0.0));
    let truth = lit.on_cpu(&View { visibility: Visibility::Rays, ..view }, &[LayerKind::Indirect]).remove(0);
    assert!((0..ao.len()).all(|i| (none[i] - ao[i]).min_element() >= 0.0));
    let [without, with] = [&none, &ao].map(|p| rel_rmse(p, &truth, |_| true));
    assert!(with < without, "{with} against {without}");
    // Most of the room is far from everything.
    let lit = (0..ao.len()).filter(|&i| none[i].x > 0.0).count();
    let open = (0..ao.len()).filter(|&i| none[i].x > 0.0 && ao[i].x > 0.9 * none[i].x).count();
    assert!(open * 2 > lit, "{open} of {lit}");
}
