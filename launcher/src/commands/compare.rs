//! Turns two pictures into figures of how far apart they are.

use crate::{cli::Global, error::LauncherError, output};
use photonstream_evaluation::Comparison;
use photonstream_film::Film;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `photonstream compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  photonstream compare out/cornell-box.exr reference.exr

JSON: { \"picture\", \"reference\", \"layer\", \"rel_rmse\", \"rel_mse\", \"bias\", \"worst_1pct\", \"mean_a\", \"mean_b\",
  \"red\", \"green\", \"blue\": the same figures per channel or null, \"reference_noise_rel_rmse\": null if unknown,
  \"at_noise_floor\" }")]
pub(crate) struct Args {
    /// The picture: a linear EXR
    pub(crate) picture: PathBuf,
    /// What it should be: a linear EXR
    pub(crate) reference: PathBuf,
    /// Layer to compare, where the pictures have several [default: the first of each]
    #[arg(long)]
    pub(crate) layer: Option<String>,
}

#[derive(Serialize)]
struct Report {
    picture: PathBuf,
    reference: PathBuf,
    layer: String,
    #[serde(flatten)]
    comparison: Comparison,
    reference_noise_rel_rmse: Option<f64>,
    at_noise_floor: bool,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let (a, b) = (Film::read_exr(&args.picture)?, Film::read_exr(&args.reference)?);
    let pick = |film: &Film| match &args.layer {
        Some(name) => film.layer(name).cloned(),
        // A film that was read has at least one.
        None => Ok(film.layers()[0].clone()),
    };
    let (layer_a, layer_b) = (pick(&a)?, pick(&b)?);
    if layer_a.name != layer_b.name {
        tracing::warn!(
            "comparing the layer {} with the layer {}; choose with --layer",
            layer_a.name,
            layer_b.name
        );
    }
    if let (Some(x), Some(y)) = (a.metadata.scene_hash, b.metadata.scene_hash)
        && x != y
    {
        tracing::warn!("the pictures show different scenes (hashes {x:016x} and {y:016x})");
    }
    let comparison = photonstream_evaluation::metrics::compare_pixels(
        (a.width(), a.height(), &layer_a.pixels),
        (b.width(), b.height(), &layer_b.pixels),
    )?;
    let noise = b.metadata.noise_rel_rmse;
    let report = Report {
        picture: args.picture.clone(),
        reference: args.reference.clone(),
        layer: layer_a.name,
        comparison,
        reference_noise_rel_rmse: noise,
        at_noise_floor: noise.is_some_and(|noise| comparison.whole.rel_rmse <= noise),
    };
    output::report(global.json, &report, text)
}

fn text(report: &Report) -> String {
    let e = &report.comparison.whole;
    let mut out = format!(
        "relative RMSE  {:.5}\nrelative MSE   {:.3e}\nbias           {:+.5}\nworst 1 %      {:.5}\nmeans          {:.6} and {:.6}\n",
        e.rel_rmse, e.rel_mse, e.bias, e.worst_1pct, e.mean_a, e.mean_b
    );
    match (report.reference_noise_rel_rmse, report.at_noise_floor) {
        (Some(noise), true) => {
            out.push_str(&format!(
                "at the noise floor: the reference itself has a relative RMSE of {noise:.5}\n"
            ));
        }
        (Some(noise), false) => out.push_str(&format!("the reference's own noise is {noise:.5}\n")),
        (None, _) => {}
    }
    out
}
