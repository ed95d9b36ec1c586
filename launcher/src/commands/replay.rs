//! Turns a recording into a channel that any renderer attaches to.

use super::render::remove_channel;
use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped},
    player::{Ending, Manner, Player},
    signals::Listener,
    span::Span,
};
use photonstream_protocol::{ChannelName, ControlServer};
use photonstream_recording::{Playback, Recording};
use serde::Serialize;
use std::{path::PathBuf, time::Instant};

/// Arguments of `photonstream replay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The frames are published as they were recorded; `photonstream set --pause | --resume | --step` and the keys of the window
work as with a simulation, edits are refused. The replay ends with the last frame (--hold: Ctrl-C or a shutdown request).
What is whole in a damaged file is played, and the damage told at the end, with exit code 1.

Examples:
  photonstream replay moving.photons --channel again & photonstream view --channel again
  photonstream replay moving.photons --speed 0.25 --loop
  photonstream replay moving.photons --frames 17 --hold      one frame, to look at
  photonstream replay moving.photons --step                  Enter, or `photonstream set --step`, shows the next one

JSON, at the end: { \"file\", \"channel\", \"ending\": end | stopped | shutdown, \"shown_frames\", \"rounds\": how often it began again,
  \"total_s\", \"damage\": null, or what ended the recording before its end }")]
pub(crate) struct Args {
    /// Recording
    file: PathBuf,
    /// Channel to publish on
    #[arg(long, default_value_t)]
    channel: ChannelName,
    /// Times the recorded speed
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// One frame for each step request or press of Enter
    #[arg(long)]
    step: bool,
    /// From the first frame again after the last one
    #[arg(long = "loop")]
    repeats: bool,
    /// Only these frames, counted from 1: A..B, A.., ..B or A
    #[arg(long, value_name = "A..B", default_value = "..")]
    frames: Span,
    /// Keep the last frame until asked to end; so does --step
    #[arg(long)]
    hold: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if speed > 0.0 && speed.is_finite() { Ok(speed) } else { Err("expected a number above 0".into()) }
}

#[derive(Serialize)]
struct Report {
    file: PathBuf,
    channel: String,
    ending: &'static str,
    shown_frames: u64,
    rounds: u64,
    total_s: f64,
    damage: Option<String>,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let begun = Instant::now();
    let stop = Listener::flag_only()?;
    let mut recording = Recording::open(&args.file)?;
    recording.seek(args.frames.first)?;
    if recording.next_frame()?.is_none() {
        let file = args.file.display();
        return Err(LauncherError::Usage(format!("{file} holds no frame {}", args.frames.first)));
    }
    let playback = Playback::start(&args.channel, recording.frame())?;
    let server = ControlServer::start(playback.publisher())?;
    // Kept here, so that an end of the input is no press of Enter.
    let (pressed, enter) = flume::unbounded();
    if args.step {
        listen(pressed.clone())?;
    }
    let manner =
        Manner { speed: args.speed, repeats: args.repeats, holds: args.hold || args.step, span: args.frames };
    let (file, is_paused) = (args.file.as_path(), args.step);
    let mut player = Player {
        file,
        manner,
        recording,
        playback,
        server,
        enter,
        stop: &stop,
        is_paused,
        shown: 0,
        at: 0,
        rounds: 0,
        damage: None,
    };
    let ending = player.play();
    let Player { shown, rounds, damage, server, playback, .. } = player;
    drop(server);
    drop(playback);
    remove_channel(&args.channel);
    let report = Report {
        file: args.file.clone(),
        channel: args.channel.to_string(),
        ending: match ending? {
            Ending::End => "end",
            Ending::Stopped => "stopped",
            Ending::Shutdown => "shutdown",
        },
        shown_frames: shown,
        rounds,
        total_s: begun.elapsed().as_secs_f64(),
        damage: damage.as_ref().map(ToString::to_string),
    };
    output::report(global.json, &report, text)?;
    damage.map_or(Ok(()), |damage| Err(damage.into()))
}

/// Sends a message for each line of standard input.
fn listen(pressed: flume::Sender<()>) -> Result<(), LauncherError> {
    let lines = move || {
        for line in std::io::stdin().lines() {
            if line.is_err() || pressed.send(()).is_err() {
                return;
            }
        }
    };
    let thread = std::thread::Builder::new().name("enter".into()).spawn(lines);
    thread.map(drop).map_err(|e| LauncherError::io("listen to", "standard input", e))
}

fn text(report: &Report) -> String {
    let rounds = if report.rounds > 0 { format!(" in {} rounds", report.rounds + 1) } else { String::new() };
    format!(
        "{}: {} frames shown{rounds} in {:.1} s",
        report.file.display(),
        grouped(report.shown_frames),
        report.total_s
    )
}
