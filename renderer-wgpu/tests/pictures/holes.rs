//! Shadow rays of the GPU pass through the holes of textures as those of the CPU do.

use crate::{
    fence,
    scenes::{Lit, layer, lit},
};
use glam::Vec3;
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Renderer, Shadows, View};
use photonstream_scene::{RangeCulling, Visibility};
use serde_json::json;

const LIT: [LayerKind; 2] = [LayerKind::Direct, LayerKind::Indirect];

fn room(holes: bool) -> Lit {
    let folder = tempfile::tempdir().unwrap();
    lit(&fence::scene_text(folder.path(), holes))
}

fn by_rays(lit: &Lit) -> View {
    View {
        shadows: Shadows::Rays,
        visibility: Visibility::Rays,
        rays_per_pixel: 0,
        culling: RangeCulling::Cut,
        ..lit.view(120, 90)
    }
}

/// Pixels that see the same surface on both renderers, and those of them whose direct or indirect light differs by more than
/// 0.5 % and a thousandth of the picture's mean: more than the colours of plates, which are interpolated on a grid of 1/256
/// pixel, and less than one ray among those of 300 lights.
fn differing(renderer: &mut Renderer, lit: &Lit, view: &View) -> (usize, [usize; 2]) {
    let seen = [LayerKind::Albedo, LayerKind::Depth];
    let [albedo, depth] = seen.map(|l| layer(renderer, view, l));
    let expected = lit.on_cpu(view, &seen);
    let close = |i: usize| {
        (albedo[i] - expected[0][i]).abs().max_element() < 0.02
            && (depth[i].x - expected[1][i].x).abs() < 1e-3
    };
    let same: Vec<usize> = (0..albedo.len()).filter(|&i| close(i)).collect();
    let expected = lit.on_cpu(view, &LIT);
    let mut count = |kind: usize| {
        let found = layer(renderer, view, LIT[kind]);
        let expected = &expected[kind];
        let mean = expected.iter().sum::<Vec3>().max_element() / expected.len() as f32;
        let differs = |&&i: &&usize| {
            (found[i] - expected[i]).abs().max_element() > 5e-3 * expected[i].max_element() + 1e-3 * mean
        };
        same.iter().filter(differs).count()
    };
    (same.len(), [count(0), count(1)])
}

/// The shadow of a lamp through the plates, and the light of 300 virtual surface lights with a ray to each. 120 × 90 pixels: 5 of
/// them may differ, where a ray meets an outline within rounding or sees another side of an edge (measured: none).
#[test]
fn the_shadow_of_a_fence_is_the_cpus() {
    let (holes, solid) = (room(true), room(false));
    let Some(mut renderer) = holes.renderer() else { return };
    let view = by_rays(&holes);
    let (same, [direct, indirect]) = differing(&mut renderer, &holes, &view);
    println!("{same} of {} pixels; direct {direct}, indirect {indirect} differ", 120 * 90);
    assert!(same * 100 >= 97 * 120 * 90, "{same}");
    assert!(direct <= 5, "{direct} of {same}");
    assert!(indirect <= 5, "{indirect} of {same}");
    // Without holes it is another picture: the floor below lies in the shadow.
    let Some(mut other) = solid.renderer() else { return };
    let [through, stopped] = [&mut renderer, &mut other].map(|r| layer(r, &view, LayerKind::Direct));
    let opened = through.iter().zip(&stopped).filter(|(t, s)| t.max_element() > 0.0 && **s == Vec3::ZERO);
    assert!(opened.count() > 500);
}

/// A plate that moves takes its holes along; the picture is the bits of a renderer that never knew another place, and what the
/// CPU shows. A scene without holes in between, and back again.
#[test]
fn holes_move_with_their_objects() {
    let (mut holes, solid) = (room(true), room(false));
    let Some(mut renderer) = holes.renderer() else { return };
    let view = by_rays(&holes);
    let before = layer(&mut renderer, &view, LayerKind::Direct);
    let mut edit = holes.scene.edit();
    let name =
        holes.scene.objects.iter().map(|o| o.name.to_string()).find(|n| n.starts_with("fence/")).unwrap();
    let change = json!({ "position_m": [0.5, 0.2, 0.4], "rotation_deg": [0, 25, 10] });
    edit.move_object(&name, change.as_object().unwrap()).unwrap();
    let still = std::mem::replace(&mut holes.scene, edit.finish());
    renderer.set_scene(&holes.scene).unwrap();
    let moved = layer(&mut renderer, &view, LayerKind::Direct);
    let Some(mut fresh) = holes.renderer() else { return };
    assert!(moved == layer(&mut fresh, &view, LayerKind::Direct));
    assert!(moved != before);
    let (same, [direct, _]) = differing(&mut renderer, &holes, &view);
    println!("{same} of {} pixels; direct {direct} differ", 120 * 90);
    assert!(same * 100 >= 97 * 120 * 90 && direct <= 5, "{direct} of {same}");
    renderer.set_scene(&solid.scene).unwrap();
    assert!(layer(&mut renderer, &view, LayerKind::Direct) != before);
    renderer.set_scene(&still).unwrap();
    assert!(layer(&mut renderer, &view, LayerKind::Direct) == before);
}
