//! Turns a scene into figures of speed: the simulator, its parts, publishing and reading.

use super::evaluate::Adapter;
use super::render::remove_channel;
use crate::{
    cli::Global,
    error::LauncherError,
    output,
    progress::{Share, Spinner},
    signals::Listener,
};
use photonstream_evaluation::{
    Observer,
    paper_tables::{PaperOptions, PaperTables},
};
use photonstream_scene::{SceneConfig, kept::user_cache};
use photonstream_simulator::{
    bench::{self, BenchOptions, DynamicOptions},
    cli::Overrides,
};
use std::{path::PathBuf, sync::Arc};

/// Arguments of `photonstream bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each figure is the best of several rounds. The machine may be busy: compare figures of one run, not of several.
With --paper: tables 1 to 3 of the paper remade, as Markdown, with its own scenes and numbers, on the graphics adapter where
there is one; in some minutes.
With --dynamic: changes of the running scene; t95 is the time until the light has gone 95 % of its way, figures are medians.

JSON: { \"scene\", \"scene_hash\", \"triangles\", \"vsls\", \"placement_s\", \"one_thread\" and \"all_threads\": { \"threads\",
  \"paths_per_s\", \"rays_per_s\", \"deposits_per_s\" }, \"scaling\", \"traversal_rays_per_s\", \"cwbvh_rays_per_s\",
  \"whole_over_cwbvh\", \"traversal_share\", \"owner_share\", \"ledger_share\", \"rest_share\", \"owner_over_traversal\",
  \"owner_table_bytes\", \"records_us\", \"publish_us\", \"read_us\", \"memcpy_us\", … }
JSON with --dynamic: { \"scene\", \"pool_paths\", \"vsls\", \"threads\", \"events\": [ { \"event\", \"first_frame_ms\", \"t95_ms\",
  \"whole_ms\", \"rays_share\", \"frames_per_s\" } ], \"check_over_trace\", \"curve\": [ { \"pool_paths\", \"latency_target_ms\",
  \"relative_error\", \"whole_relative_error\", … as events } ] }
JSON with --paper: { \"machine\", \"adapter\", \"without_adapter\": why there is none, \"seconds\", \"error_size\", \"reference_spp\",
  \"scenes\": [ { \"scene\", \"paper_polygons\", \"paper_vertices\", \"triangles\", \"vertices\", \"differs\", \"reference_noise\" } ],
  \"pictures\": [ { \"scene\", \"width\", \"height\", \"vsls\", \"paper_deferred_per_s\", \"paper_whole_per_s\", \"per_s\": [ [way,
  pictures a second] ], \"rel_rmse_paper\", \"rel_rmse_octahedral\" } ], \"skipped\": [ { \"scene\", \"why\" } ] }")]
pub(crate) struct Args {
    /// Scene or model to measure
    #[arg(required_unless_present = "paper")]
    config: Option<PathBuf>,
    /// Remake the tables of the paper that the method comes from, with the error that it does not give
    #[arg(long, conflicts_with_all = ["config", "dynamic", "Overrides"])]
    paper: bool,
    /// With --paper: small pictures of its first scene alone
    #[arg(long, requires = "paper")]
    quick: bool,
    /// With --paper: folder where references are kept [default: the user's cache folder, else a temporary one]
    #[arg(long, value_name = "DIR", requires = "paper")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    adapter: Adapter,
    /// Measure how fast the light follows changes of the scene
    #[arg(long)]
    dynamic: bool,
    #[command(flatten)]
    overrides: Overrides,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let Some(config) = &args.config else { return paper(args, global) };
    let config = args.overrides.apply(SceneConfig::from_file(config)?)?;
    let scene = Arc::new(config.build()?);
    let spinner = Spinner::start("bench");
    if args.dynamic {
        let options = DynamicOptions::default();
        let result = bench::run_dynamic(&scene, &options, &mut |what| spinner.say(what.to_owned()));
        drop(spinner);
        remove_channel(&format!("bench-dynamic-{}", std::process::id()).parse()?);
        return output::report(global.json, &result?, ToString::to_string);
    }
    let report = bench::run(scene, &BenchOptions::default(), &mut |what| spinner.say(what.to_owned()))?;
    drop(spinner);
    for part in ["stream", "exchange"] {
        remove_channel(&format!("bench-{part}-{}", std::process::id()).parse()?);
    }
    output::report(global.json, &report, ToString::to_string)
}

/// The tables of the paper.
fn paper(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let folder =
        tempfile::tempdir().map_err(|e| LauncherError::io("create folder", std::env::temp_dir(), e))?;
    let options = PaperOptions {
        quick: args.quick,
        cache: args.cache.clone().or_else(user_cache).unwrap_or_else(|| folder.path().to_owned()),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let cancelled = Listener::flag_only()?;
    let bar = Share::start("bench --paper");
    let progress = |share: f64, what: &str| {
        bar.set(share);
        bar.say(what.to_owned());
    };
    let observer = Observer { progress: &progress, cancelled: &cancelled };
    let measured =
        args.adapter.with_device(|device| Ok(PaperTables::measure(&options, device, observer)?))?;
    drop(bar);
    output::report(global.json, &measured, |tables| tables.to_string().trim_end().to_owned())
}
