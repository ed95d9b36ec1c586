//! Turns a few lines of TOML into scenes for tests.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{Scene, SceneConfig};
use photonstream_simulator::{ledger::Ledger, simulation::Simulation};
use std::{path::Path, sync::Arc};

/// The scene that `text` describes; a camera is added.
pub(crate) fn scene(text: &str) -> Scene {
    let camera = "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n";
    SceneConfig::from_text(&format!("{text}\n{camera}"), Path::new("test.toml")).unwrap().build().unwrap()
}

/// A config of the repository, with settings of `[streaming]` replaced.
pub(crate) fn config(name: &str, change: impl FnOnce(&mut SceneConfig)) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
    let mut config = SceneConfig::from_file(&path).unwrap();
    change(&mut config);
    config.build().unwrap()
}

/// A closed box of 2 × 1 × 3 m seen from within, of albedo `rho`, with a point light off its centre.
pub(crate) fn closed_box(rho: f32, power: f32, streaming: &str) -> Scene {
    scene(&format!(
        "[material.wall]\nalbedo = {rho}\n\
         [object.room]\nmaterial = \"wall\"\nsides = \"back\"\nbox = {{ size_m = [2, 1, 3] }}\n\
         [light.bulb]\npower_w = {power}\npoint = {{ position_m = [0.3, 0.2, -0.7] }}\n\
         [streaming]\n{streaming}\n"
    ))
}

/// A closed sphere of radius 1 m seen from within, of albedo `rho`, with a point light at `x` m from its centre.
pub(crate) fn closed_sphere(rho: f32, power: f32, x: f32, streaming: &str) -> Scene {
    scene(&format!(
        "[material.wall]\nalbedo = {rho}\n\
         [object.shell]\nmaterial = \"wall\"\nsides = \"back\"\nsphere = {{ radius_m = 1, segments = 96 }}\n\
         [light.bulb]\npower_w = {power}\npoint = {{ position_m = [{x}, 0.1, 0] }}\n\
         [streaming]\n{streaming}\n"
    ))
}

/// The scene made ready, and its pool filled.
pub(crate) fn filled(scene: Scene) -> (Simulation, Ledger) {
    let simulation = Simulation::new(Arc::new(scene));
    let ledger = simulation.fill();
    (simulation, ledger)
}
