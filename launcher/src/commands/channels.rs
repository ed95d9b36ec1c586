//! Turns the runtime folder into a list of simulations that run, and of what a crash left.

use crate::{cli::Global, error::LauncherError, output};
use photonstream_protocol::{ChannelStatus, Runtime};
use serde::Serialize;

/// Arguments of `photonstream channels`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
JSON: { \"runtime_dir\", \"channels\": [ { \"name\", \"state\": running | paused | left_over, \"pid\", \"epoch\", \"frame\",
  \"heartbeat_age_ms\", \"segment_bytes\", \"problem\" } ] }; what is not known is null.")]
pub(crate) struct Args {}

#[derive(Serialize)]
struct Report {
    runtime_dir: String,
    channels: Vec<Channel>,
}

#[derive(Serialize)]
struct Channel {
    name: String,
    state: &'static str,
    pid: Option<u32>,
    epoch: Option<u64>,
    frame: Option<u64>,
    heartbeat_age_ms: Option<f64>,
    segment_bytes: Option<u64>,
    problem: Option<String>,
}

pub(crate) fn run(_: &Args, global: &Global) -> Result<(), LauncherError> {
    let runtime = Runtime::from_env();
    let channels = photonstream_protocol::channels_in(&runtime)?.into_iter().map(channel).collect();
    let report = Report { runtime_dir: runtime.root().display().to_string(), channels };
    output::report(global.json, &report, text)
}

fn channel(status: ChannelStatus) -> Channel {
    let state = match (status.alive, status.paused) {
        (true, true) => "paused",
        (true, false) => "running",
        (false, _) => "left_over",
    };
    Channel {
        name: status.name.to_string(),
        state,
        pid: status.pid,
        epoch: status.epoch,
        frame: status.frame,
        heartbeat_age_ms: status.age.map(|age| age.as_secs_f64() * 1e3),
        segment_bytes: status.segment_bytes,
        problem: status.problem,
    }
}

fn text(report: &Report) -> String {
    if report.channels.is_empty() {
        return format!("no channels in {}", report.runtime_dir);
    }
    let mut out = format!("{:<20} {:<10} {:>8} {:>8} {:>10}\n", "channel", "state", "pid", "frame", "bytes");
    let number = |n: Option<u64>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
    for c in &report.channels {
        let state = c.state.replace('_', " ");
        let (pid, frame, bytes) = (number(c.pid.map(u64::from)), number(c.frame), number(c.segment_bytes));
        out.push_str(&format!("{:<20} {state:<10} {pid:>8} {frame:>8} {bytes:>10}", c.name));
        if let Some(problem) = &c.problem {
            out.push_str(&format!("  {problem}"));
        }
        out.push('\n');
    }
    if report.channels.iter().any(|c| c.state == "left_over") {
        out.push_str("remove what was left over with `photonstream clean`\n");
    }
    out
}
