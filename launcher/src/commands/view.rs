//! Turns a running simulation into a window on it.

use crate::{cli::Global, error::LauncherError, output, owned, signals::Listener};
use photonstream_window::Ended;
use serde::Serialize;

/// Arguments of `photonstream view`.
#[derive(Debug, clap::Args)]
#[group(skip)]
#[command(after_help = "\
The camera circles with the left mouse button and flies with W A S D Q E; lights and objects are dragged, and the light
follows; H shows all keys. The window waits for a simulation, keeps the last light of one that has ended, and follows the
next. Closing it leaves the simulation alone.

Examples:
  photonstream simulate configs/cornell-box.toml --channel demo &
  photonstream view --channel demo
  photonstream view --channel demo --visibility none --interleave 4      faster, for software rendering

JSON, at the end: { \"ended\": closed | done | cancelled, \"frames\": published frames that were shown, \"presented\": pictures
  handed to the display, \"reopened\": times that the graphics device was opened again }")]
pub(crate) struct Args {
    #[command(flatten)]
    window: photonstream_window::Args,
}

#[derive(Serialize)]
struct Report {
    ended: &'static str,
    frames: u64,
    presented: u64,
    reopened: u64,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    owned::end_with_launcher();
    let cancelled = Listener::flag_only()?;
    let report = photonstream_window::run(&args.window, &cancelled)?;
    let ended = match report.ended {
        Ended::Closed => "closed",
        Ended::Done => "done",
        Ended::Cancelled => "cancelled",
    };
    let photonstream_window::Report { frames, presented, reopened, .. } = report;
    // A launcher reports for its children.
    if owned::is_owned() {
        return Ok(());
    }
    output::report(global.json, &Report { ended, frames, presented, reopened }, |r| {
        format!("{} published frames shown in {} pictures", r.frames, r.presented)
    })
}
