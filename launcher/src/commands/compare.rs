//! Turns two pictures into figures of how far apart they are.

use crate::{cli::Global, error::LauncherError, output};
use photonstream_evaluation::{
    Comparison,
    flip::{Exposure, Flip, flip},
    maps::{Picture, flip_picture, mean_luminance, signed_error},
};
use photonstream_film::{Film, Layer};
use photonstream_shading::tone::ToneMap;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `photonstream compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
FLIP says how different a viewer finds the pictures who swaps one for the other on a display: 0 is no difference, 1 black against
white. --maps writes signed-error.png (orange is too bright, blue too dark; full colour at the reference's mean) and flip.png
(black is no difference).

Examples:
  photonstream compare out/cornell-box.exr reference.exr
  photonstream compare out/cornell-box.exr reference.exr --maps out/errors

JSON: { \"picture\", \"reference\", \"layer\", \"rel_rmse\", \"rel_mse\", \"bias\", \"worst_1pct\", \"mean_a\", \"mean_b\",
  \"red\", \"green\", \"blue\": the same figures per channel or null, \"reference_noise_rel_rmse\": null if unknown,
  \"at_noise_floor\", \"flip\", \"maps\": [paths] }")]
pub(crate) struct Args {
    /// The picture: a linear EXR
    pub(crate) picture: PathBuf,
    /// What it should be: a linear EXR
    pub(crate) reference: PathBuf,
    /// Layer to compare, where the pictures have several [default: the first of each]
    #[arg(long)]
    pub(crate) layer: Option<String>,
    /// Write maps of the errors into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) maps: Option<PathBuf>,
    /// Exposure for FLIP in stops
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) exposure: f32,
    /// Tone map for FLIP: linear, reinhard or aces
    #[arg(long, value_name = "NAME", default_value = "aces")]
    pub(crate) tone_map: ToneMap,
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
    flip: f64,
    maps: Vec<PathBuf>,
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
    let exposure = Exposure { ev: args.exposure, tone_map: args.tone_map };
    let flip = flip(a.width(), a.height(), &layer_a.pixels, &layer_b.pixels, exposure);
    let maps = match &args.maps {
        Some(folder) => write_maps(folder, (a.width(), a.height()), (&layer_a, &layer_b), &flip)?,
        None => Vec::new(),
    };
    let report = Report {
        picture: args.picture.clone(),
        reference: args.reference.clone(),
        layer: layer_a.name,
        comparison,
        reference_noise_rel_rmse: noise,
        at_noise_floor: noise.is_some_and(|noise| comparison.whole.rel_rmse <= noise),
        flip: flip.mean,
        maps,
    };
    output::report(global.json, &report, text)
}

fn write_maps(
    folder: &Path,
    (width, height): (u32, u32),
    (a, b): (&Layer, &Layer),
    flip: &Flip,
) -> Result<Vec<PathBuf>, LauncherError> {
    std::fs::create_dir_all(folder).map_err(|e| LauncherError::io("create folder", folder, e))?;
    let scale = mean_luminance(&b.pixels).max(f32::MIN_POSITIVE);
    let write = |name: &str, picture: Picture| -> Result<PathBuf, LauncherError> {
        let path = folder.join(name);
        let png = picture.png().map_err(|e| LauncherError::Output(std::io::Error::other(e)))?;
        std::fs::write(&path, png).map_err(|e| LauncherError::io("write", &path, e))?;
        Ok(path)
    };
    Ok(vec![
        write("signed-error.png", signed_error(width, height, &a.pixels, &b.pixels, scale))?,
        write("flip.png", flip_picture(width, height, flip))?,
    ])
}

fn text(report: &Report) -> String {
    let e = &report.comparison.whole;
    let mut out = format!(
        "relative RMSE  {:.5}\nrelative MSE   {:.3e}\nbias           {:+.5}\nworst 1 %      {:.5}\nFLIP           {:.5}\nmeans          {:.6} and {:.6}\n",
        e.rel_rmse, e.rel_mse, e.bias, e.worst_1pct, report.flip, e.mean_a, e.mean_b
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
    report.maps.iter().for_each(|path| out.push_str(&format!("{}\n", path.display())));
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn maps_are_pictures_of_the_errors() {
        let folder = tempfile::tempdir().unwrap();
        let film = |name: &str, value: f32| {
            let mut film = Film::new(16, 8).unwrap();
            film.push("full", vec![[value; 3].into(); 128]).unwrap();
            let path = folder.path().join(name);
            film.write_exr(&path).unwrap();
            path
        };
        let args = Args {
            picture: film("a.exr", 2.0),
            reference: film("b.exr", 1.0),
            layer: None,
            maps: Some(folder.path().join("new/maps")),
            exposure: 0.0,
            tone_map: ToneMap::Aces,
        };
        run(&args, &Global { verbose: 0, quiet: 0, json: true }).unwrap();
        for name in ["signed-error.png", "flip.png"] {
            let png = std::fs::read(folder.path().join("new/maps").join(name)).unwrap();
            // The signature of PNG, then width and height in the header.
            assert_eq!((&png[1..4], &png[16..24]), (&b"PNG"[..], &[0, 0, 0, 16, 0, 0, 0, 8][..]), "{name}");
        }
    }
}
