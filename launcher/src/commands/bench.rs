//! Turns a scene into figures of speed: the simulator, its parts, publishing and reading.

use super::render::remove_channel;
use crate::{cli::Global, error::LauncherError, output, progress::Spinner};
use photonstream_scene::SceneConfig;
use photonstream_simulator::{
    bench::{self, BenchOptions, DynamicOptions},
    cli::Overrides,
};
use std::{path::PathBuf, sync::Arc};

/// Arguments of `photonstream bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each figure is the best of several rounds. The machine may be busy: compare figures of one run, not of several.
With --dynamic: changes of the running scene; t95 is the time until the light has gone 95 % of its way, figures are medians.

JSON: { \"scene\", \"scene_hash\", \"triangles\", \"vsls\", \"placement_s\", \"one_thread\" and \"all_threads\": { \"threads\",
  \"paths_per_s\", \"rays_per_s\", \"deposits_per_s\" }, \"scaling\", \"traversal_rays_per_s\", \"cwbvh_rays_per_s\",
  \"whole_over_cwbvh\", \"traversal_share\", \"owner_share\", \"ledger_share\", \"rest_share\", \"owner_over_traversal\",
  \"owner_table_bytes\", \"records_us\", \"publish_us\", \"read_us\", \"memcpy_us\", … }
JSON with --dynamic: { \"scene\", \"pool_paths\", \"vsls\", \"threads\", \"events\": [ { \"event\", \"first_frame_ms\", \"t95_ms\",
  \"whole_ms\", \"rays_share\", \"frames_per_s\" } ], \"check_over_trace\", \"curve\": [ { \"pool_paths\", \"latency_target_ms\",
  \"relative_error\", \"whole_relative_error\", … as events } ] }")]
pub(crate) struct Args {
    /// Scene to measure
    config: PathBuf,
    /// Measure how fast the light follows changes of the scene
    #[arg(long)]
    dynamic: bool,
    #[command(flatten)]
    overrides: Overrides,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let config = args.overrides.apply(SceneConfig::from_file(&args.config)?)?;
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
