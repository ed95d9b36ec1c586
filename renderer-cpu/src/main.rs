//! Turns a simulator's channel into picture files: the CPU renderer as a program of its own.
//!
//! Paths of the pictures go to stdout, messages to stderr. Exit codes: 0 pictures written or stopped by SIGINT or
//! SIGTERM, 1 an error, 2 wrong arguments.
#![forbid(unsafe_code)]

use clap::Parser;
use photonstream_renderer::{cli::Args, program};
use photonstream_renderer_cpu::CpuRenderer;

/// Renders what a photonstream simulator publishes, on the CPU.
#[derive(Parser)]
#[command(name = "photonstream-renderer-cpu", version)]
struct Command {
    #[command(flatten)]
    args: Args,
}

fn main() -> anyhow::Result<()> {
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_target(false).init();
    photonstream_scene::kept::use_user_cache();
    Ok(program::run(&Command::parse().args, &mut CpuRenderer)?)
}
