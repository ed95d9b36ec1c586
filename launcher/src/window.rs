//! Turns display and adapter of this machine into the word whether a window can be opened, or why not.

use crate::backend::GpuArgs;

/// The renderer's name in reports, and the subcommand that is one.
pub(crate) const WINDOW: &str = "window";

/// Whether a window can be opened, and shown pictures by a device that `gpu` chooses: an adapter that draws but cannot
/// present on this display does not do.
///
/// # Errors
/// Why not, in one sentence.
#[cfg(feature = "window")]
pub(crate) fn find(gpu: &GpuArgs) -> Result<(), String> {
    photonstream_window::probe(&gpu.adapter()).map_err(|error| error.to_string())
}

/// Why no window can be opened.
#[cfg(not(feature = "window"))]
pub(crate) fn find(_: &GpuArgs) -> Result<(), String> {
    Err("this build has no window".into())
}
