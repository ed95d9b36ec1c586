//! Gathers what can go wrong with the GPU.

use photonstream_renderer::RenderError;

/// Why the GPU gives no picture.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter does.
    #[error(
        "no graphics adapter can be used{}; install a Vulkan driver (Debian: mesa-vulkan-drivers has one in software), \
         or use --renderer cpu",
        list(.reasons)
    )]
    NoAdapter {
        /// What was found and why it does not do.
        reasons: Vec<String>,
    },
    /// The adapter lacks what an option needs.
    #[error("{option}: {adapter} lacks {lacks}; {remedy}")]
    Unsupported {
        /// The option.
        option: String,
        /// Name of the adapter.
        adapter: String,
        /// What is missing.
        lacks: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// An option is out of its range.
    #[error("{option}: found {found}, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// What was given.
        found: String,
        /// What is possible.
        expected: &'static str,
    },
    /// A picture, a scene or a set of lights is too large for the device.
    #[error("{what}: found {found}, expected at most {limit} on {adapter}; {remedy}")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its size.
        found: u64,
        /// The device's limit.
        limit: u64,
        /// Name of the adapter.
        adapter: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// The device has too little memory.
    #[error("{what} does not fit into the device's memory ({reason}); choose a smaller --size")]
    OutOfMemory {
        /// What did not fit.
        what: String,
        /// What the driver said.
        reason: String,
    },
    /// The device reported an error: a bug of this renderer or of the driver, or memory has run out.
    #[error("the graphics device reported: {reason}; try another --adapter, --software or --renderer cpu")]
    Device {
        /// What it said.
        reason: String,
    },
    /// The device is gone: its driver crashed or was reset.
    #[error("the graphics device was lost ({reason}); start the renderer again")]
    Lost {
        /// What the driver said.
        reason: String,
    },
    /// The device does not answer.
    #[error("the graphics device did not finish within {seconds} s; choose a smaller --size or fewer rays")]
    TimedOut {
        /// How long was waited.
        seconds: u64,
    },
}

fn list(reasons: &[String]) -> String {
    match reasons {
        [] => " (none was found)".into(),
        reasons => format!(": {}", reasons.join("; ")),
    }
}

impl From<GpuError> for RenderError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Option { option, found, expected } => Self::Option { option, found, expected },
            error => Self::Device(Box::new(error)),
        }
    }
}
