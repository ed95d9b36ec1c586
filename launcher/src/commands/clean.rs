//! Turns what crashed simulators left behind into free memory, and says what that was.

use crate::{cli::Global, error::LauncherError, output};
use serde::Serialize;

/// Arguments of `photonstream clean`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
JSON: { \"removed\": [ { \"channel\", \"segments\": [names], \"folder\" } ] }; channel is null for segments whose runtime
folder is gone.")]
pub(crate) struct Args {}

#[derive(Serialize)]
struct Report {
    removed: Vec<Removed>,
}

#[derive(Serialize)]
struct Removed {
    channel: Option<String>,
    segments: Vec<String>,
    folder: Option<String>,
}

pub(crate) fn run(_: &Args, global: &Global) -> Result<(), LauncherError> {
    let cleaned = photonstream_protocol::clean()?;
    let removed = cleaned
        .into_iter()
        .filter(|c| !c.segments.is_empty() || c.folder.is_some())
        .map(|c| Removed {
            channel: c.channel.map(|name| name.to_string()),
            segments: c.segments,
            folder: c.folder.map(|folder| folder.display().to_string()),
        })
        .collect();
    output::report(global.json, &Report { removed }, text)
}

fn text(report: &Report) -> String {
    if report.removed.is_empty() {
        return "nothing to clean".to_owned();
    }
    let line = |r: &Removed| {
        let what =
            r.channel.as_ref().map_or_else(|| "lost segments".into(), |name| format!("channel {name}"));
        let parts: Vec<_> = r.segments.iter().chain(&r.folder).map(String::as_str).collect();
        format!("{what}: removed {}\n", parts.join(", "))
    };
    report.removed.iter().map(line).collect()
}
