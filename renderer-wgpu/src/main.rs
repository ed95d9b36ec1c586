//! Turns a simulator's channel into picture files: the GPU renderer as a program of its own, without a window.
//!
//! Paths of the pictures go to stdout, messages to stderr. Exit codes: 0 pictures written or stopped by SIGINT or
//! SIGTERM, 1 an error, 2 wrong arguments.
#![forbid(unsafe_code)]

use clap::Parser;
use photonstream_renderer::{cli::Args, program};
use photonstream_renderer_wgpu::cli::GpuArgs;

/// Renders what a photonstream simulator publishes, on the GPU.
#[derive(Parser)]
#[command(name = "photonstream-renderer-wgpu", version)]
struct Command {
    #[command(flatten)]
    args: Args,
    #[command(flatten)]
    gpu: GpuArgs,
}

fn main() -> anyhow::Result<()> {
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_target(false).init();
    photonstream_scene::kept::use_user_cache();
    let Command { args, gpu } = Command::parse();
    Ok(program::run(&args, &mut gpu.renderer()?)?)
}
