//! Gathers what ends a window before its time.

use photonstream_protocol::ProtocolError;
use photonstream_renderer_wgpu::GpuError;

/// Why there is no window, or no longer one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WindowError {
    /// There is no display to open a window on.
    #[error(
        "no display to open a window on ({reason}); set DISPLAY or WAYLAND_DISPLAY, or write pictures with --headless"
    )]
    NoDisplay {
        /// What the window system said.
        reason: String,
    },
    /// The window system refused the window, or its loop has failed.
    #[error("the window system failed ({reason}); try again, or write pictures with --headless")]
    System {
        /// What it said.
        reason: String,
    },
    /// Nothing can be shown in this window.
    #[error(
        "the window takes no pictures of {adapter} ({reason}); choose another with --adapter, or use --headless"
    )]
    Surface {
        /// Name of the adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// The graphics device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The device was lost again and again.
    #[error("the graphics device was opened {times} times within {seconds} s and failed each time: {last}")]
    KeepsFailing {
        /// How often it was opened.
        times: usize,
        /// Within which time.
        seconds: u64,
        /// The last failure.
        last: GpuError,
    },
    /// The channel: insecure, of another release.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// A thread could not be started.
    #[error(
        "a thread of the window cannot be started: {reason}; end other programs or raise the limit of processes"
    )]
    Thread {
        /// What the system said.
        reason: String,
    },
}
