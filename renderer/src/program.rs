//! Turns a renderer into a program of its own: signals, messages on stderr, paths of the pictures on stdout.

use crate::{FrameRenderer, RenderError, attach, cli::Args};
use std::{
    io::Write,
    sync::{Arc, atomic::AtomicBool},
};

/// Follows the channel of `args` until the pictures are written, the channel is closed, or SIGINT or SIGTERM arrives.
///
/// # Errors
/// Those of [`attach::run`]; [`RenderError::NoFrame`] if the channel was closed before there was a frame.
pub fn run(args: &Args, renderer: &mut dyn FrameRenderer) -> Result<(), RenderError> {
    let cancelled = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        let registered = signal_hook::flag::register(signal, Arc::clone(&cancelled));
        registered.map_err(|error| RenderError::Device(Box::new(error)))?;
    }
    let report = attach::run(args, renderer, &cancelled, &mut |picture| {
        tracing::info!("frame {} in {:.0} ms", picture.frame, picture.stats.render_ms);
        for file in picture.files {
            // A reader of stdout that has gone away does not stop the pictures.
            let _ = writeln!(std::io::stdout(), "{}", file.display());
        }
    })?;
    if report.pictures == 0 && report.ended == attach::Ended::ChannelClosed {
        return Err(RenderError::NoFrame { channel: args.channel.to_string() });
    }
    Ok(())
}
