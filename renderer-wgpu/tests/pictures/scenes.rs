//! Turns scene texts into frames as a simulator publishes them.

use photonstream_protocol::VslFrame;
use photonstream_renderer_wgpu::{AdapterChoice, Gpu, Renderer, test_gpu};
use photonstream_scene::{Scene, SceneConfig};
use photonstream_simulator::{records, simulation::Simulation};
use std::{path::Path, sync::Arc};

/// A scene with its light, streamed.
pub(crate) struct Lit {
    pub(crate) scene: Scene,
    pub(crate) frame: VslFrame,
}

/// The config `name` of this repository, its text changed by `edit`.
pub(crate) fn config(name: &str, edit: impl FnOnce(String) -> String) -> Lit {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
    lit(&edit(std::fs::read_to_string(path).unwrap()))
}

/// The room of the Cornell box with `light` in place of its spot.
pub(crate) fn cornell(light: &str, streaming: &str) -> Lit {
    config("cornell-box.toml", |text| {
        let room = text.split("[light.").next().unwrap().to_owned();
        format!("{room}\n[light.lamp]\n{light}\n[streaming]\n{streaming}\n")
    })
}

pub(crate) fn lit(text: &str) -> Lit {
    let scene = SceneConfig::from_text(text, Path::new("test.toml")).unwrap().build().unwrap();
    let scene = Arc::new(scene);
    let simulation = Simulation::new(Arc::clone(&scene));
    let ledger = simulation.fill();
    let mut vsls = records::vsl_records(&scene, &simulation.placement);
    records::write_flux(&mut vsls, ledger.readings(&scene), 0);
    let frame = VslFrame { epoch: 1, frame: 1, vsls, scene_hash: scene.hash, ..VslFrame::default() };
    Lit { scene: Arc::unwrap_or_clone(scene), frame }
}

/// A renderer on the software device, with the scene and the frame on it.
pub(crate) fn renderer(lit: &Lit) -> Option<Renderer> {
    let gpu: Gpu = test_gpu::gpu()?;
    let _ = AdapterChoice::default();
    let mut renderer = Renderer::new(gpu).unwrap();
    renderer.set_scene(&lit.scene).unwrap();
    renderer.set_frame(&lit.frame).unwrap();
    Some(renderer)
}
