//! A published scene that was edited while it ran looks like one that was loaded that way.

use crate::{
    against_cpu::same_surface,
    scenes::{self, Lit, layer, rel_rmse},
};
use photonstream_protocol::VslFrame;
use photonstream_renderer::{LayerKind, published::PublishedScene};
use photonstream_renderer_wgpu::{Shadows, Show, View};
use photonstream_scene::Scene;
use photonstream_simulator::records;
use serde_json::{Value, json};
use std::sync::Arc;

const LAYERS: [LayerKind; 3] = [LayerKind::Albedo, LayerKind::Normal, LayerKind::Direct];

/// The frame that a simulator of `scene` publishes, without indirect light.
fn published(scene: &Scene) -> VslFrame {
    VslFrame {
        objects: records::object_records(scene),
        lights: records::light_records(scene),
        scene_text: Arc::clone(&scene.resolved_text),
        ..VslFrame::default()
    }
}

/// The room as it was, painted, and painted with another box, mirrored, and another sphere; with the scene of the config
/// that says so from the start.
fn versions() -> [(Scene, Scene); 3] {
    let config = |edit: &dyn Fn(String) -> String| {
        scenes::config("cornell-box.toml", |text| {
            let text = format!("origin_m = [0, 1, 0]\n{text}\n[streaming]\nvsls = 20\npool_paths = 512\n");
            edit(text)
        })
        .scene
    };
    let values = |value: Value| value.as_object().unwrap().clone();
    let replaced = |text: String, from: &str, to: &str| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    };
    let painted = |text: String| replaced(text, "albedo = [0.75, 0.75, 0.75]", "albedo = [0.2, 0.5, 0.9]");
    let grown = |text: String| {
        let text = replaced(
            painted(text),
            "rotation_deg = [0, 18, 0]",
            "rotation_deg = [0, 18, 5]\nscale = [0.7, 1.2, -0.9]",
        );
        replaced(text, "position_m = [0.42, 0.36, 0.3]", "position_m = [0.4, 0.5, 0.3]\nscale = 1.3")
    };
    let original = config(&|text| text);
    let mut edit = original.edit();
    edit.set_material("white", &values(json!({ "albedo": [0.2, 0.5, 0.9] }))).unwrap();
    let repainted = edit.finish();
    let mut edit = repainted.edit();
    let mirrored = json!({ "rotation_deg": [0, 18, 5], "scale": [0.7, 1.2, -0.9] });
    edit.move_object("box", &values(mirrored)).unwrap();
    edit.move_object("sphere", &values(json!({ "position_m": [0.4, 0.5, 0.3], "scale": 1.3 }))).unwrap();
    let regrown = edit.finish();
    [(original.clone(), original), (repainted, config(&painted)), (regrown, config(&grown))]
}

/// Albedo, normals and direct light by the CPU, each version after the one before and the first one again: to 1e-6, for a
/// vertex may differ in its last bit. 40 × 30 pixels.
#[test]
fn the_cpus_pictures_follow_paint_and_size() {
    let versions = versions();
    let mut followed = PublishedScene::default();
    let mut last = Vec::new();
    for (edited, loaded) in versions.iter().chain(&versions[..1]) {
        let found = followed.update(&published(edited)).unwrap().clone();
        let [found, expected] = [found, loaded.clone()].map(|scene| {
            let lit = Lit { scene, frame: VslFrame::default() };
            lit.on_cpu(&lit.view(40, 30), &LAYERS)
        });
        for (i, kind) in LAYERS.into_iter().enumerate() {
            let pixels = found[i].iter().zip(&expected[i]);
            let away = pixels.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
            assert!(away <= 1e-6, "{kind}: {away:e}");
        }
        // Each version is another picture: the test can fail.
        assert_ne!(last, found);
        last = found;
    }
}

/// The same by one GPU renderer, which was given the versions one after the other, against the CPU's pictures of the
/// loaded scenes: relative RMSE ≤ 1e-3, as for any scene. What paint does not change is not drawn again.
#[test]
fn the_gpus_pictures_follow_paint_and_size() {
    let versions = versions();
    let (first, _) = &versions[0];
    let Some(mut renderer) = (Lit { scene: first.clone(), frame: VslFrame::default() }).renderer() else {
        return;
    };
    renderer.set_timed(true);
    let mut followed = PublishedScene::default();
    for (step, (edited, loaded)) in versions.iter().chain(&versions[..1]).enumerate() {
        let scene = followed.update(&published(edited)).unwrap();
        renderer.set_scene(scene).unwrap();
        let lit = Lit { scene: loaded.clone(), frame: VslFrame::default() };
        let view = View { shadows: Shadows::Rays, ..lit.view(40, 30) };
        let drawn = renderer.draw(&View { show: Show::Layer(LayerKind::Direct), ..view }).unwrap();
        let names: Vec<_> = drawn.passes.iter().map(|p| p.name).collect();
        if step == 1 {
            assert_eq!(names, ["composite"]);
        } else {
            assert!(
                names.contains(&"G-buffer") && names.contains(&"direct light, rays"),
                "{step}: {names:?}"
            );
        }
        let expected = lit.on_cpu(&view, &LAYERS);
        let found = LAYERS.map(|kind| layer(&mut renderer, &view, kind));
        let same = same_surface([&found[1], &expected[1]], [&found[0], &expected[0]]);
        let others = same.iter().filter(|&&same| !same).count();
        assert!(others * 100 <= same.len(), "{step}: {others} pixels see another surface");
        for (i, kind) in LAYERS.into_iter().enumerate() {
            let error = rel_rmse(&found[i], &expected[i], |pixel| same[pixel]);
            assert!(error <= 1e-3, "{step}, {kind}: {error:e}");
        }
    }
}
