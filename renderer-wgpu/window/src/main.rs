//! Turns a simulator's channel into a window: the window as a program of its own.
//!
//! Messages go to stderr. Exit codes: 0 closed, all frames shown or stopped by SIGINT or SIGTERM, 1 an error, 2 wrong
//! arguments.
#![forbid(unsafe_code)]

use clap::Parser;
use photonstream_window::Args;
use std::sync::{Arc, atomic::AtomicBool};
use tracing_subscriber::EnvFilter;

/// Shows what a photonstream simulator publishes in a window.
#[derive(Parser)]
#[command(name = "photonstream-window", version)]
struct Command {
    #[command(flatten)]
    args: Args,
}

fn main() -> anyhow::Result<()> {
    let filter = EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| EnvFilter::new("info,wgpu_core=warn,wgpu_hal=warn,naga=warn,winit=warn"));
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_target(false).with_env_filter(filter).init();
    photonstream_scene::kept::use_user_cache();
    let Command { args } = Command::parse();
    let cancelled = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&cancelled))?;
    }
    let report = photonstream_window::run(&args, &cancelled)?;
    tracing::info!("{} published frames shown in {} pictures", report.frames, report.presented);
    Ok(())
}
