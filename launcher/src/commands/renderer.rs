//! Turns this process into a renderer that `run` has started.

use crate::{
    backend::{self, GpuArgs},
    cli::Global,
    error::LauncherError,
    owned,
    signals::Listener,
};
use photonstream_renderer::{
    attach::{self, Ended},
    cli,
};
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
    /// On the GPU
    #[cfg(feature = "wgpu")]
    Wgpu {
        #[command(flatten)]
        args: cli::Args,
        #[command(flatten)]
        gpu: GpuArgs,
    },
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
    let cancelled = Listener::flag_only()?;
    let (args, mut renderer) = match &args.renderer {
        BuiltIn::Cpu(args) => (args, backend::renderer("cpu", &GpuArgs::default())?),
        #[cfg(feature = "wgpu")]
        BuiltIn::Wgpu { args, gpu } => (args, backend::renderer("wgpu", gpu)?),
    };
    let report = attach::run(args, renderer.as_mut(), &cancelled, &mut |picture| {
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
