//! Turns assignments into edits of a running simulation, and tells from which frame they are seen.

use crate::{assignment, cli::Global, error::LauncherError, output, requests, signals::Listener};
use photonstream_protocol::{
    AccessMode, ChannelName, ControlClient, Liveness, Request, Subscriber, VslFrame,
};
use serde::Serialize;
use serde_json::Value;
use std::{
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

/// Arguments of `photonstream set`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
KEY is light.NAME.…, object.NAME.…, material.NAME.…, streaming.… or vpls.…, as in the config; NAME may contain / and be in quotes.
VALUE is TOML; a word needs no quotes. Several keys of one thing change together, in one frame. A config file is not written to.
--wait waits without end where the light never converges (things that move): Ctrl-C.

Examples:
  photonstream set --channel demo light.lamp.power_w=[80,60,40] object.ball.position_m=[0,1,0]
  photonstream set --channel demo light.lamp.enabled=false --wait
  photonstream set --channel demo 'object.\"door leaf\".rotation_deg=[0,30,0]' streaming.sampling=fresh
  photonstream set --channel demo material.red.albedo=[.6,.1,.1] streaming.vsls=500
  photonstream set --channel demo streaming.method=static-vpl vpls.second_bounce_distance_m=2
  photonstream set --channel demo --pause

JSON: { \"channel\", \"frame\": from which all is seen, \"requests\": [ { \"type\", \"name\", \"values\", \"frame\" } ],
  \"waited_ms\": null without --wait, \"converged\": null without --wait }")]
pub(crate) struct Args {
    /// Channel of the simulation
    #[arg(long, default_value_t)]
    channel: ChannelName,
    /// What is to change, and its new value
    #[arg(value_name = "KEY=VALUE", required_unless_present = "action")]
    assignments: Vec<String>,
    #[command(flatten)]
    action: Action,
    /// Until the frame is published and its light has converged (or the simulation is paused)
    #[arg(long)]
    wait: bool,
}

/// What is done instead of a change.
#[derive(Clone, Copy, Debug, clap::Args)]
#[group(id = "action", multiple = false, conflicts_with = "assignments")]
struct Action {
    /// Stop simulated time
    #[arg(long)]
    pause: bool,
    /// Let simulated time run
    #[arg(long)]
    resume: bool,
    /// Make one step of simulated time while paused
    #[arg(long)]
    step: bool,
    /// Load the config again
    #[arg(long)]
    reload: bool,
}

impl Action {
    fn request(self) -> Option<Request> {
        [
            (self.pause, Request::Pause),
            (self.resume, Request::Resume),
            (self.step, Request::Step),
            (self.reload, Request::Reload),
        ]
        .into_iter()
        .find_map(|(is_asked, request)| is_asked.then_some(request))
    }
}

#[derive(Serialize)]
struct Report {
    channel: String,
    frame: u64,
    requests: Vec<Done>,
    waited_ms: Option<f64>,
    converged: Option<bool>,
}

/// A request that was carried out.
#[derive(Serialize)]
struct Done {
    #[serde(skip)]
    title: String,
    #[serde(flatten)]
    request: Value,
    frame: u64,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let asked = match args.action.request() {
        Some(request) => vec![request],
        None => assignment::requests(&args.assignments)?,
    };
    let mut client = ControlClient::connect(&args.channel)?;
    let begun = Instant::now();
    let mut done = Vec::new();
    for request in &asked {
        let frame = requests::send(&mut client, &args.channel, request).inspect_err(|_| {
            for Done { title, frame, .. } in &done {
                tracing::warn!("{title} was changed before, visible from frame {frame}");
            }
        })?;
        let title = assignment::title(request);
        let request = serde_json::to_value(request).map_err(|e| LauncherError::Output(e.into()))?;
        done.push(Done { title, request, frame });
    }
    let frame = done.iter().map(|done| done.frame).max().unwrap_or_default();
    let converged = args.wait.then(|| wait(&args.channel, frame)).transpose()?;
    let report = Report {
        channel: args.channel.to_string(),
        frame,
        requests: done,
        waited_ms: args.wait.then(|| begun.elapsed().as_secs_f64() * 1e3),
        converged,
    };
    output::report(global.json, &report, text)
}

/// Waits until `frame` is published and its light has converged, or is not going to, since the simulation is paused;
/// whether it has.
fn wait(channel: &ChannelName, frame: u64) -> Result<bool, LauncherError> {
    let cancelled = Listener::flag_only()?;
    let mut subscriber = Subscriber::attach(channel, AccessMode::Mapped)?;
    loop {
        // Asked before reading: what was published before the end is then read.
        let liveness = subscriber.liveness();
        subscriber.read()?;
        let shown = subscriber.frame().filter(|shown| shown.frame >= frame);
        let converged = shown.is_some_and(|VslFrame { statistics, .. }| statistics.converged == 1);
        if converged || (shown.is_some() && liveness == Liveness::Paused) {
            return Ok(converged);
        }
        if matches!(liveness, Liveness::Gone { .. } | Liveness::Retired) {
            let what = "its light had converged";
            return Err(LauncherError::SimulatorEnded { channel: channel.to_string(), what });
        }
        if cancelled.load(Ordering::Relaxed) {
            return Err(LauncherError::Interrupted);
        }
        subscriber.wait(Duration::from_millis(50));
    }
}

fn text(report: &Report) -> String {
    let mut out: String = report
        .requests
        .iter()
        .map(|done| format!("{}: visible from frame {}\n", done.title, done.frame))
        .collect();
    if let (Some(ms), Some(converged)) = (report.waited_ms, report.converged) {
        let state = if converged { "the light has converged" } else { "published; the simulation is paused" };
        out.push_str(&format!("{state} after {ms:.0} ms\n"));
    }
    out
}
