//! Turns a scene into its path-traced picture, and says how noisy that picture is.

use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped, si},
    pictures::{self, Format},
    progress::Share,
    signals::Listener,
};
use photonstream_renderer::{LayerKind, Watch, cli::Size};
use photonstream_renderer_cpu::{
    ReferenceOptions, reference,
    reference::{PixelFilter, ReferenceStats, Stop},
};
use photonstream_scene::SceneConfig;
use serde::Serialize;
use std::{path::PathBuf, time::Duration};

/// Arguments of `photonstream reference`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Every pixel is sampled at its centre, as `render` does, unless --filter says otherwise. The noise is measured from two
independent halves of the samples.

Examples:
  photonstream reference configs/cornell-box.toml --out ref.exr --spp 256
  photonstream reference configs/cornell-box.toml --out ref.exr --error 0.01 --show indirect
  photonstream compare box.exr ref.exr

JSON: { \"scene\", \"scene_hash\", \"pictures\": [paths], \"samples_per_pixel\", \"noise_rel_rmse\", \"noise_direct_rel_rmse\",
  \"noise_indirect_rel_rmse\", \"rays\", \"render_ms\", \"width_px\", \"height_px\" }")]
pub(crate) struct Args {
    /// Scene to trace
    config: PathBuf,
    /// Picture file: .exr (linear) or .png (tone mapped)
    #[arg(long, value_name = "REF")]
    out: PathBuf,
    /// Paths per pixel [default: 64]
    #[arg(long, value_name = "N", group = "stop", value_parser = clap::value_parser!(u64).range(1..))]
    spp: Option<u64>,
    /// Stop at this relative RMSE from noise
    #[arg(long, value_name = "E", group = "stop")]
    error: Option<f64>,
    /// Stop after so many seconds
    #[arg(long, value_name = "S", group = "stop")]
    time: Option<f64>,
    /// What to show: full, direct, indirect; several make REF-LAYER files; --error looks at the first
    #[arg(long, value_name = "LAYER", value_delimiter = ',', default_value = "full")]
    show: Vec<LayerKind>,
    /// Size in pixels [default: as the scene says]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Where in a pixel its samples lie
    #[arg(long, value_enum, default_value_t = Filter::Centre)]
    filter: Filter,
    /// Seed of all samples
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads [default: one per core]; the picture does not depend on it
    #[arg(long)]
    threads: Option<usize>,
}

/// `--filter`.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Filter {
    /// At its centre, as `render` does: edges are not smoothed
    Centre,
    /// Anywhere in it with equal weight, as other renderers do
    Box,
}

impl From<Filter> for PixelFilter {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Centre => Self::Centre,
            Filter::Box => Self::Box,
        }
    }
}

/// Most paths per pixel for `--error`: more than a picture is ever worth.
const MOST_SAMPLES: u64 = 1 << 20;

#[derive(Serialize)]
struct Report {
    scene: String,
    scene_hash: String,
    pictures: Vec<PathBuf>,
    #[serde(flatten)]
    stats: ReferenceStats,
    width_px: u32,
    height_px: u32,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    Format::of(&args.out)?;
    let stop = stop(args)?;
    // Loading has threads of its own, and is interrupted in words, too.
    let cancelled = Listener::flag_only()?;
    let scene = SceneConfig::from_file(&args.config)?.build()?;
    let mut options = ReferenceOptions::from_settings(&scene.render, stop);
    if let Some(size) = args.size {
        (options.width, options.height) = (size.width, size.height);
    }
    options.layers.clone_from(&args.show);
    options.seed = args.seed;
    options.pixel_filter = args.filter.into();
    options.threads = args.threads;
    let bar = Share::start("reference");
    let progress = |share: f64| bar.set(share);
    let watch = Watch { progress: Some(&progress), cancelled: Some(&cancelled) };
    let traced = reference(&scene, &options, watch)?;
    drop(bar);
    let pictures = pictures::write(&traced.film, &args.out, &args.show, &scene.render)?;
    let report = Report {
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", scene.hash),
        pictures,
        stats: traced.stats,
        width_px: traced.film.width(),
        height_px: traced.film.height(),
    };
    output::report(global.json, &report, text)
}

fn stop(args: &Args) -> Result<Stop, LauncherError> {
    let positive = |name: &str, value: f64| {
        if value > 0.0 && value.is_finite() {
            Ok(value)
        } else {
            Err(LauncherError::Usage(format!("--{name} {value}: expected a number above 0")))
        }
    };
    Ok(match (args.spp, args.error, args.time) {
        (Some(samples), ..) => Stop::Samples(samples),
        (_, Some(error), _) => Stop::Error { rel_rmse: positive("error", error)?, max_samples: MOST_SAMPLES },
        (.., Some(seconds)) => {
            let limit = Duration::try_from_secs_f64(positive("time", seconds)?);
            Stop::Time(limit.map_err(|e| LauncherError::Usage(format!("--time {seconds}: {e}")))?)
        }
        _ => Stop::Samples(64),
    })
}

fn text(report: &Report) -> String {
    let mut out: String = report.pictures.iter().map(|path| format!("{}\n", path.display())).collect();
    let stats = &report.stats;
    out.push_str(&format!(
        "{} paths per pixel, {}rays/s, traced in {:.1} s; relative RMSE from noise: full {:.4}, direct {:.4}, indirect {:.4}",
        grouped(stats.samples_per_pixel),
        si(stats.rays as f64 / (stats.render_ms * 1e-3).max(1e-9)),
        stats.render_ms * 1e-3,
        stats.noise_rel_rmse,
        stats.noise_direct_rel_rmse,
        stats.noise_indirect_rel_rmse,
    ));
    out
}
