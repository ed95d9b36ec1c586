//! Turns a running simulation into a file of its frames.

use crate::{
    cli::Global,
    error::LauncherError,
    follow,
    output::{self, grouped},
    signals::Listener,
    taking::{self, Beginning, Limits, Taken},
};
use photonstream_protocol::ChannelName;
use photonstream_recording::Recorder;
use std::{path::PathBuf, time::Duration};

/// Arguments of `photonstream record`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Records from the present frame until Ctrl-C, a limit, or the end of the simulation. `photonstream run --record FILE` records
from the first frame. What is in the file when something crashes can be replayed.

Examples:
  photonstream record --channel demo --out moving.photons --seconds 10
  photonstream replay moving.photons --channel again

JSON: { \"file\", \"frames\", \"skipped_frames\": published and gone before they could be read, \"bytes\", \"seconds\" }")]
pub(crate) struct Args {
    /// Channel of the simulation
    #[arg(long, default_value_t)]
    channel: ChannelName,
    /// File of the recording; one that is there is replaced
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// End after so many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// End after so much time
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if (0.0..1e9).contains(&seconds) { Ok(seconds) } else { Err("expected 0 or more".into()) }
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let stop = Listener::flag_only()?;
    let mut subscriber = follow::present_frame(&args.channel)?;
    let recorder = Recorder::create(&args.out)?;
    let limits = Limits { frames: args.frames, time: args.seconds.map(Duration::from_secs_f64) };
    let taken = taking::take(&args.out, recorder, &mut subscriber, Beginning::Present, limits, &stop)?;
    output::report(global.json, &taken, text)
}

/// One line on a recording.
pub(crate) fn text(taken: &Taken) -> String {
    let skipped = match taken.skipped_frames {
        0 => String::new(),
        n => format!(", {} too fast to be read", grouped(n)),
    };
    format!(
        "{}: {} frames{skipped}, {} bytes in {:.1} s",
        taken.file.display(),
        grouped(taken.frames),
        grouped(taken.bytes),
        taken.seconds
    )
}
