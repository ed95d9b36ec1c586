//! Turns scenes into speed against error: tables and a page.

#[cfg(feature = "wgpu")]
use crate::device::GpuDevice;
use crate::{cli::Global, error::LauncherError, output, progress::Share, signals::Listener};
use photonstream_evaluation::{Observer, Options, device::Offered, evaluate, plan::Effort};
use photonstream_renderer::cli::Size;
use photonstream_scene::kept::user_cache;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `photonstream evaluate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes results.csv, results.json and index.html, a page that needs no network, into DIR. An interrupted evaluation leaves what
was measured until then. References are kept, and found again by scene, size and paths per pixel. Accumulations of the GPU
renderer are measured where there is an adapter; the report names it, or says why there is none.

Examples:
  photonstream evaluate configs/cornell-box.toml --out out/evaluation
  photonstream evaluate configs/cornell-box.toml configs/two-rooms.toml --out out/evaluation --quick
  photonstream evaluate configs/cornell-box.toml --out again --point photon-streaming:vsls=200,visibility=none
  photonstream evaluate configs/cornell-box.toml --out again --point photon-streaming-gpu:accumulation=splat,visibility=none

JSON: { \"complete\", \"seconds\", \"points\", \"page\", \"csv\", \"json\": paths, \"cpu\", \"cores\", \"adapter\": or null, \"commit\", \"skipped\": [ { \"what\",
  \"why\" } ] }; every measured figure is in results.json, under the names of the columns of results.csv")]
pub(crate) struct Args {
    /// Scenes to evaluate
    #[arg(required = true, value_name = "CONFIG")]
    configs: Vec<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Small pictures and few points: a first look
    #[arg(long)]
    quick: bool,
    /// Size of the pictures [default: the scene's proportions with 16 384 pixels, or 4 096 with --quick]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Paths per pixel of the reference [default: 4096, or 256 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    spp: Option<u64>,
    /// Measure animated scenes at this moment, in seconds [default: as they are loaded, at 0]
    #[arg(long, value_name = "SECONDS")]
    time: Option<f64>,
    /// Threads [default: one per core]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Seed of all samples [default: the scene's]
    #[arg(long)]
    seed: Option<u64>,
    /// Measure this alone: METHOD or METHOD:KEY=VALUE,… as results.csv names it; repeat for more
    #[arg(long, value_name = "POINT")]
    point: Vec<String>,
    /// Folder where references are kept [default: the user's cache folder, else DIR/cache]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    adapter: Adapter,
}

/// Which graphics adapter is measured; none in a build without the GPU renderer.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Adapter {
    /// Measure the GPU renderer on the adapter whose name contains this [default: the most capable one]
    #[cfg(feature = "wgpu")]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Measure the GPU renderer on a software rasteriser
    #[cfg(feature = "wgpu")]
    #[arg(long)]
    software: bool,
}

#[derive(Serialize)]
struct Report {
    complete: bool,
    seconds: f64,
    points: usize,
    page: PathBuf,
    csv: PathBuf,
    json: PathBuf,
    cpu: String,
    cores: usize,
    adapter: Option<String>,
    commit: String,
    skipped: Vec<photonstream_evaluation::results::Skipped>,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let options = Options {
        configs: args.configs.clone(),
        time_s: args.time,
        out: args.out.clone(),
        cache: args.cache.clone().or_else(user_cache).unwrap_or_else(|| args.out.join("cache")),
        effort: if args.quick { Effort::Quick } else { Effort::Default },
        size: args.size.map(|size| (size.width, size.height)),
        reference_spp: args.spp,
        threads: args.threads.map(|n| n as usize),
        seed: args.seed,
        points: args.point.clone(),
    };
    let cancelled = Listener::flag_only()?;
    let bar = Share::start("evaluation");
    let progress = |share: f64, what: &str| {
        bar.set(share);
        bar.say(what.to_owned());
    };
    let observer = Observer { progress: &progress, cancelled: &cancelled };
    let measured = args.adapter.with_device(|device| Ok(evaluate(&options, device, observer)?));
    drop(bar);
    let page = args.out.join("index.html");
    let results = measured.inspect_err(|_| {
        if page.exists() {
            tracing::warn!("{} has what was measured until then", page.display());
        }
    })?;
    for skipped in results.skipped.iter().filter(|s| s.what == photonstream_evaluation::SCENE_WITHOUT_LIGHT) {
        tracing::warn!("{}", skipped.why);
    }
    let report = Report {
        complete: results.complete,
        seconds: results.seconds,
        points: results.rows.len(),
        page,
        csv: args.out.join("results.csv"),
        json: args.out.join("results.json"),
        cpu: results.machine.cpu,
        cores: results.machine.cores,
        adapter: results.adapter,
        commit: results.machine.commit,
        skipped: results.skipped,
    };
    output::report(global.json, &report, text)
}

impl Adapter {
    /// What `measure` makes with the GPU renderer, or with the reason why there is none.
    ///
    /// # Errors
    /// An adapter that was asked for and is not there; those of `measure`.
    #[cfg(feature = "wgpu")]
    pub(crate) fn with_device<T>(
        &self,
        measure: impl FnOnce(Offered<'_>) -> Result<T, LauncherError>,
    ) -> Result<T, LauncherError> {
        let (name, software) = (self.adapter.clone(), self.software);
        let was_asked_for = name.is_some() || software;
        match GpuDevice::new(photonstream_renderer_wgpu::AdapterChoice { name, software }) {
            Ok(mut device) => measure(Ok(&mut device)),
            Err(error) if was_asked_for => Err(photonstream_renderer::RenderError::from(error).into()),
            Err(error) => measure(Err(error.to_string())),
        }
    }

    /// What `measure` makes without a GPU renderer.
    ///
    /// # Errors
    /// Those of `measure`.
    #[cfg(not(feature = "wgpu"))]
    pub(crate) fn with_device<T>(
        &self,
        measure: impl FnOnce(Offered<'_>) -> Result<T, LauncherError>,
    ) -> Result<T, LauncherError> {
        measure(Err("this build has no GPU renderer: its feature wgpu is off".into()))
    }
}

fn text(report: &Report) -> String {
    format!(
        "{}\n{}\n{}\n{} points measured in {:.0} s",
        report.page.display(),
        report.csv.display(),
        report.json.display(),
        report.points,
        report.seconds
    )
}
