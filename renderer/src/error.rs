//! Gathers what can go wrong while a picture is rendered.

use photonstream_film::FilmError;
use photonstream_protocol::ProtocolError;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The picture's size, a layer's name, or writing the file.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// The channel.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
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
    /// Visibility `octahedral` needs distance maps, and the simulation publishes none.
    #[error(
        "visibility: found octahedral, but the simulation publishes no distance maps; set streaming.distance_map_px = 32 in \
         the config, or start the simulator with --distance-map-px auto"
    )]
    NoDistanceMaps,
    /// A virtual surface light is unusable.
    #[error(
        "virtual surface light {index}: {field}: found {found}, expected {expected}; simulator and renderer differ, \
         restart both"
    )]
    Vsl {
        /// Its index.
        index: usize,
        /// The field.
        field: &'static str,
        /// What was found.
        found: String,
        /// What is possible.
        expected: &'static str,
    },
    /// A published light is unusable.
    #[error(
        "light {index}: {field}: found {found}, expected {expected}; simulator and renderer differ, restart both"
    )]
    Light {
        /// Its index.
        index: usize,
        /// The field.
        field: &'static str,
        /// What was found.
        found: String,
        /// What is possible.
        expected: &'static str,
    },
    /// A published motion of an object is unusable.
    #[error("{reason}; simulator and renderer differ, restart both")]
    Object {
        /// What is wrong with it.
        reason: String,
    },
    /// The published scene text could not be loaded.
    #[error("the published scene cannot be loaded: {reason}")]
    Scene {
        /// What the scene loader said.
        reason: String,
    },
    /// Somebody asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// The channel was closed before there was anything to show.
    #[error("channel '{channel}' was closed before a frame was published; start the simulator again")]
    NoFrame {
        /// The channel.
        channel: String,
    },
    /// What renders has failed: a device is missing or lost, a picture does not fit.
    #[error(transparent)]
    Device(Box<dyn std::error::Error + Send + Sync>),
    /// The threads could not be started.
    #[error("{threads} render threads cannot be started: {reason}; choose fewer with --threads")]
    Threads {
        /// Number asked for.
        threads: usize,
        /// What the system said.
        reason: String,
    },
}
