//! Turns a scene into a running simulation on a channel.

use super::render::remove_channel;
use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped},
    owned,
};
use photonstream_simulator::{cli, service::Summary};

/// Arguments of `photonstream simulate`.
#[derive(Debug, clap::Args)]
#[group(skip)]
#[command(after_help = "\
Ends with Ctrl-C, SIGTERM or SIGHUP, or when a client of its control socket asks for it.

Example:
  photonstream simulate configs/cornell-box.toml --channel demo &
  photonstream render --channel demo --out now.png

JSON, at the end: { \"scene\", \"ending\": stopped | shutdown, \"seconds\", \"frames\", and the counters }")]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) simulator: cli::Args,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    owned::end_with_launcher();
    // Renderers that a launcher is just starting find the last frame: it removes the channel when they are done.
    let summary = cli::run(&cli::Args { leaves_channel: owned::is_owned(), ..args.simulator.clone() })?;
    if !owned::is_owned() || owned::launcher_is_gone() {
        remove_channel(&args.simulator.channel);
    }
    // A launcher reports for its children.
    if owned::is_owned() { Ok(()) } else { output::report(global.json, &summary, text) }
}

fn text(summary: &Summary) -> String {
    format!(
        "{}: {} frames, {} paths and {} rays in {:.1} s",
        summary.scene,
        grouped(summary.frames),
        grouped(summary.counters.paths),
        grouped(summary.counters.rays),
        summary.seconds,
    )
}
