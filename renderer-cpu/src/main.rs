//! Turns a simulator's channel into picture files: the CPU renderer as a program of its own.
//!
//! Paths of the pictures go to stdout, messages to stderr. Exit codes: 0 pictures written or stopped by SIGINT or
//! SIGTERM, 1 an error, 2 wrong arguments.
#![forbid(unsafe_code)]

use clap::Parser;
use photonstream_renderer::{attach, cli::Args};
use photonstream_renderer_cpu::CpuRenderer;
use std::{
    io::Write,
    sync::{Arc, atomic::AtomicBool},
};

/// Renders what a photonstream simulator publishes, on the CPU.
#[derive(Parser)]
#[command(name = "photonstream-renderer-cpu", version)]
struct Command {
    #[command(flatten)]
    args: Args,
}

fn main() -> anyhow::Result<()> {
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_target(false).init();
    let Command { args } = Command::parse();
    let cancelled = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&cancelled))?;
    }
    let report = attach::run(&args, &mut CpuRenderer, &cancelled, &mut |picture| {
        tracing::info!("frame {} in {:.0} ms", picture.frame, picture.stats.render_ms);
        for file in picture.files {
            // A reader of stdout that has gone away does not stop the pictures.
            let _ = writeln!(std::io::stdout(), "{}", file.display());
        }
    })?;
    anyhow::ensure!(
        report.pictures > 0 || report.ended != attach::Ended::ChannelClosed,
        "the channel was closed before a frame was published"
    );
    Ok(())
}
