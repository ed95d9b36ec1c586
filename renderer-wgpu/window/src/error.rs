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
        "the window takes no pictures of {adapter} ({reason}); choose another with --adapter, or write pictures with \
         photonstream run --headless or --renderer cpu"
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
    #[error(
        "the graphics device was opened {times} times within {seconds} s and failed each time: {last}; choose another \
         --adapter, --software or a smaller --size, or write pictures with photonstream run --renderer cpu"
    )]
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

impl WindowError {
    /// Whether the graphics device is to blame, and something else could make the picture.
    pub fn is_of_device(&self) -> bool {
        matches!(self, Self::Surface { .. } | Self::Gpu(_) | Self::KeepsFailing { .. })
    }
}

/// Whether a device that reports `error` is of no use any more; otherwise it only refuses what was asked of it.
pub(crate) fn is_failure(error: &GpuError) -> bool {
    !matches!(
        error,
        GpuError::Option { .. }
            | GpuError::Unsupported { .. }
            | GpuError::TooLarge { .. }
            | GpuError::OutOfMemory { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_leaves_the_device_alive() {
        let text = String::new;
        let too_large =
            GpuError::TooLarge { what: "", found: 2, limit: 1, adapter: text(), remedy: "ask for less" };
        for error in [
            too_large,
            GpuError::OutOfMemory { what: text(), reason: text() },
            GpuError::Option { option: "", found: text(), expected: "" },
        ] {
            assert!(!is_failure(&error), "{error}");
        }
        for error in [
            GpuError::Lost { reason: text() },
            GpuError::Device { reason: text() },
            GpuError::TimedOut { seconds: 1 },
        ] {
            assert!(is_failure(&error), "{error}");
        }
    }

    #[test]
    fn who_fails_for_good_names_a_way_out() {
        let last = GpuError::Lost { reason: "test".into() };
        let error = WindowError::KeepsFailing { times: 4, seconds: 20, last }.to_string();
        for remedy in ["--adapter", "--software", "--size", "--renderer cpu"] {
            assert!(error.contains(remedy), "{error}");
        }
    }
}
