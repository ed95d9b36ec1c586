//! Turns a model file into the scene file that it is shown with.

use crate::{cli::Global, error::LauncherError, output};
use photonstream_scene::{ModelOptions, ModelScene, config::UpAxis, is_model};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `photonstream config`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Commands that take a scene take a model, too: .glb, .gltf, .obj or .ply. What this command writes is then chosen: camera, \
light where there is none, a floor below what lies on nothing, exposure, lights and paths of the simulation; of OBJ and PLY \
also the axis that points up, the unit and the sides that reflect.

Examples:
  photonstream config model.glb > scene.toml
  photonstream config church.obj --up-axis z --unit-m 0.0434 > church.toml

JSON: { \"model\", \"text\", \"choices\": [texts] }")]
pub(crate) struct Args {
    /// Model: glTF, GLB, OBJ or PLY
    model: PathBuf,
    /// Axis of the file that points up: y or z [default: y for glTF, else chosen]
    #[arg(long, value_name = "AXIS")]
    up_axis: Option<UpAxis>,
    /// Metres in a unit of the file [default: 1 for glTF, else chosen]
    #[arg(long, value_name = "METRES", value_parser = metres)]
    unit_m: Option<f64>,
}

#[derive(Serialize)]
struct Report {
    model: PathBuf,
    text: String,
    choices: Vec<String>,
}

fn metres(text: &str) -> Result<f64, String> {
    let metres = text.parse().ok().filter(|metres: &f64| metres.is_finite() && *metres > 0.0);
    metres.ok_or_else(|| "expected a number of metres above 0".into())
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    if !is_model(&args.model) {
        return Err(LauncherError::Usage(format!(
            "{} is no model: expected a file called .glb, .gltf, .obj or .ply",
            args.model.display()
        )));
    }
    let options = ModelOptions { up_axis: args.up_axis, unit_m: args.unit_m };
    let ModelScene { text, choices } = ModelScene::of(&args.model, &options)?;
    let report = Report { model: args.model.clone(), text, choices };
    output::report(global.json, &report, |report| report.text.trim_end().to_owned())
}
