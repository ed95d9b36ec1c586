//! Turns this process into a renderer that `run` has started.

use crate::{cli::Global, error::LauncherError, owned, signals::Listener};
use photonstream_renderer::{
    attach::{self, Ended},
    cli,
};
use photonstream_renderer_cpu::CpuRenderer;
use std::ffi::OsString;

/// Arguments of the hidden `photonstream renderer`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    renderer: BuiltIn,
}

/// The renderers of this build.
#[derive(Debug, clap::Subcommand)]
enum BuiltIn {
    /// On the CPU
    Cpu(cli::Args),
}

/// Arguments of the hidden `photonstream exec`.
#[derive(Debug, clap::Args)]
pub(crate) struct ExecArgs {
    /// Process that has to be alive
    #[arg(long)]
    parent: u32,
    /// The program and its arguments
    #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    command: Vec<OsString>,
}

pub(crate) fn run(args: &Args, _: &Global) -> Result<(), LauncherError> {
    owned::end_with_launcher();
    let BuiltIn::Cpu(args) = &args.renderer;
    let cancelled = Listener::flag_only()?;
    let report = attach::run(args, &mut CpuRenderer, &cancelled, &mut |picture| {
        let files: Vec<_> = picture.files.iter().map(|file| file.display().to_string()).collect();
        let ms = picture.stats.render_ms;
        tracing::info!("frame {} in {ms:.0} ms: {}", picture.frame, files.join(", "));
    })?;
    if report.pictures == 0 && report.ended == Ended::ChannelClosed {
        let what = "its first frame";
        return Err(LauncherError::SimulatorEnded { channel: args.channel.to_string(), what });
    }
    Ok(())
}

pub(crate) fn exec(args: &ExecArgs) -> Result<(), LauncherError> {
    owned::exec_plug_in(args.parent, &args.command)
}
