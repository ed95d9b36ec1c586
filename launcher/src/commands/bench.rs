//! Turns a scene into figures of speed: the simulator, its parts, publishing and reading.

use super::render::remove_channel;
use crate::{cli::Global, error::LauncherError, output, progress::Spinner};
use photonstream_scene::SceneConfig;
use photonstream_simulator::{
    bench::{self, BenchOptions},
    cli::Overrides,
};
use std::{path::PathBuf, sync::Arc};

/// Arguments of `photonstream bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each figure is the best of several rounds. The machine may be busy: compare figures of one run, not of several.

JSON: { \"scene\", \"scene_hash\", \"triangles\", \"vsls\", \"placement_s\", \"one_thread\" and \"all_threads\": { \"threads\",
  \"paths_per_s\", \"rays_per_s\", \"deposits_per_s\" }, \"scaling\", \"traversal_rays_per_s\", \"cwbvh_rays_per_s\",
  \"whole_over_cwbvh\", \"traversal_share\", \"owner_share\", \"ledger_share\", \"rest_share\", \"owner_over_traversal\",
  \"owner_table_bytes\", \"records_us\", \"publish_us\", \"read_us\", \"memcpy_us\", … }")]
pub(crate) struct Args {
    /// Scene to measure
    config: PathBuf,
    #[command(flatten)]
    overrides: Overrides,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let mut config = SceneConfig::from_file(&args.config)?;
    args.overrides.apply(&mut config);
    let scene = Arc::new(config.build()?);
    let spinner = Spinner::start("bench");
    let report = bench::run(scene, &BenchOptions::default(), &mut |what| spinner.say(what.to_owned()))?;
    drop(spinner);
    for part in ["stream", "exchange"] {
        remove_channel(&format!("bench-{part}-{}", std::process::id()).parse()?);
    }
    output::report(global.json, &report, ToString::to_string)
}
