//! Turns scene texts into frames as a simulator publishes them, and pictures into figures of their difference.

use glam::Vec3;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{LayerKind, RenderOptions, VslSet, Watch};
use photonstream_renderer_wgpu::{Renderer, Show, View, test_gpu};
use photonstream_scene::{Scene, SceneConfig, Visibility};
use photonstream_simulator::{distance_maps, records, simulation::Simulation};
use std::{path::Path, sync::Arc};

/// A scene with its light, streamed.
pub(crate) struct Lit {
    pub(crate) scene: Scene,
    pub(crate) frame: VslFrame,
}

/// Lamps of each kind, as the config of a room 2 m wide takes them.
pub(crate) const LAMPS: [(&str, &str); 5] = [
    ("point", "power_w = [60, 50, 40]\npoint = { position_m = [0.1, 1.6, 0.2] }"),
    (
        "spot",
        "power_w = [14, 12.5, 10]\nspot = { position_m = [0.15, 1.95, 0.1], target_m = [-0.05, 0, -0.05], \
         outer_half_angle_deg = 55, inner_half_angle_deg = 30 }",
    ),
    (
        "wide spot",
        "power_w = 30\nspot = { position_m = [0.1, 1.4, 0.3], target_m = [0, 0, -0.2], outer_half_angle_deg = 85, \
         inner_half_angle_deg = 60 }",
    ),
    ("sun", "irradiance_w_m2 = [5, 4, 3]\ndirectional = { direction = [0.3, -0.6, -1.0] }"),
    (
        "area",
        "power_w = [20, 18, 15]\nrectangle = { corner_m = [-0.3, 1.98, -0.2], edge_u_m = [0.6, 0, 0], \
         edge_v_m = [0, 0, 0.5] }",
    ),
];

/// The config `name` of this repository, its text changed by `edit`.
pub(crate) fn config(name: &str, edit: impl FnOnce(String) -> String) -> Lit {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
    lit(&edit(std::fs::read_to_string(path).unwrap()))
}

/// The room of the Cornell box with `lamp` in place of its spot.
pub(crate) fn cornell(lamp: &str, streaming: &str) -> Lit {
    config("cornell-box.toml", |text| {
        let room = text.split("[light.").next().unwrap().to_owned();
        format!("{room}\n[light.lamp]\n{lamp}\n[streaming]\n{streaming}\n")
    })
}

/// The light of a scene text.
pub(crate) fn lit(text: &str) -> Lit {
    let scene = SceneConfig::from_text(text, Path::new("test.toml")).unwrap().build().unwrap();
    let scene = Arc::new(scene);
    let simulation = Simulation::new(Arc::clone(&scene));
    let ledger = simulation.fill();
    let mut vsls = records::vsl_records(&scene, &simulation.placement);
    records::write_flux(&mut vsls, ledger.readings(&scene), 0);
    for record in &mut vsls {
        record.changed_frame = 1;
    }
    let patches = records::patch_records(&simulation);
    let distances = records::distance_records(&distance_maps::all(&scene, &simulation.placement));
    drop(simulation);
    let scene_hash = scene.hash;
    let frame = VslFrame { epoch: 1, frame: 1, vsls, patches, distances, scene_hash, ..VslFrame::default() };
    Lit { scene: Arc::unwrap_or_clone(scene), frame }
}

impl Lit {
    /// What the tests here look at: no shadows of indirect light, no range.
    pub(crate) fn view(&self, width: u32, height: u32) -> View {
        View {
            width,
            height,
            visibility: Visibility::None,
            epsilon: 0.0,
            ..View::from_settings(&self.scene.render, &self.scene.camera)
        }
    }

    /// A renderer on the software device, with the scene and the frame on it.
    pub(crate) fn renderer(&self) -> Option<Renderer> {
        let mut renderer = Renderer::new(test_gpu::gpu()?).unwrap();
        renderer.set_scene(&self.scene).unwrap();
        renderer.set_frame(&self.frame).unwrap();
        Some(renderer)
    }

    /// The CPU's picture of `view`, one list of pixels for each of `layers`.
    pub(crate) fn on_cpu(&self, view: &View, layers: &[LayerKind]) -> Vec<Vec<Vec3>> {
        let options = RenderOptions {
            width: view.width,
            height: view.height,
            kernel: view.kernel,
            visibility: view.visibility,
            epsilon: view.epsilon,
            culling: view.culling,
            seed: view.seed,
            light_samples: view.light_samples,
            layers: layers.to_vec(),
            ..RenderOptions::from_settings(&self.scene.render)
        };
        let vsls = VslSet::from_frame(&self.frame).unwrap();
        let film =
            photonstream_renderer_cpu::render(&self.scene, &vsls, &options, Watch::default()).unwrap().film;
        film.layers().iter().map(|l| l.pixels.clone()).collect()
    }
}

/// The pixels of one layer of `view`.
pub(crate) fn layer(renderer: &mut Renderer, view: &View, layer: LayerKind) -> Vec<Vec3> {
    renderer.draw(&View { show: Show::Layer(layer), ..*view }).unwrap();
    renderer.pixels().unwrap()
}

/// √mean((a−b)²)/mean(b) over the pixels that `counts` keeps.
pub(crate) fn rel_rmse(a: &[Vec3], b: &[Vec3], counts: impl Fn(usize) -> bool) -> f64 {
    assert_eq!(a.len(), b.len());
    let (mut squares, mut sum, mut n) = (0.0, 0.0, 0.0);
    for i in (0..a.len()).filter(|&i| counts(i)) {
        squares += (a[i] - b[i]).as_dvec3().length_squared();
        sum += b[i].as_dvec3().element_sum();
        n += 3.0;
    }
    assert!(n > 0.0 && sum > 0.0, "nothing to compare");
    (squares / n).sqrt() / (sum / n)
}
