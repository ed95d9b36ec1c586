//! Turns everything that can end a command early into one message and one exit code.

use crate::{assignment::AssignmentError, exit};
use photonstream_evaluation::{EvaluateError, MetricsError};
use photonstream_film::FilmError;
use photonstream_mitsuba::ExportError;
use photonstream_protocol::ProtocolError;
use photonstream_recording::RecordingError;
use photonstream_renderer::RenderError;
use photonstream_scene::{SceneError, vpl_placement::VplPlacementError};
use photonstream_simulator::error::SimulatorError;
use std::{io, path::PathBuf};

/// Why a command did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LauncherError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Placement of virtual point lights.
    #[error(transparent)]
    Placement(#[from] VplPlacementError),
    /// The channel.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// The simulator.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// The renderer.
    #[error(transparent)]
    Render(RenderError),
    /// The window.
    #[cfg(feature = "window")]
    #[error(transparent)]
    Window(#[from] photonstream_window::WindowError),
    /// A recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A picture.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A comparison.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// A scene for another renderer.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// An evaluation.
    #[error(transparent)]
    Evaluate(EvaluateError),
    /// Arguments that contradict each other.
    #[error("{0}")]
    Usage(String),
    /// A change that cannot be understood.
    #[error(transparent)]
    Assignment(#[from] AssignmentError),
    /// A change that the simulator refused.
    #[error("{what} was refused on channel '{channel}' ({code}): {message}")]
    Refused {
        /// What was to change.
        what: String,
        /// The channel.
        channel: String,
        /// One word for programs.
        code: String,
        /// One sentence for people.
        message: String,
    },
    /// A renderer that is neither built in nor found.
    #[error(
        "no renderer is called \"{name}\": built in is {built_in}; looked for the plug-in {file} in {looked}; \
         install it there or choose another --renderer"
    )]
    UnknownRenderer {
        /// The name given.
        name: String,
        /// Names of the renderers of this build.
        built_in: String,
        /// File name of the plug-in.
        file: String,
        /// Folders, in order.
        looked: String,
    },
    /// A child process that failed for good.
    #[error("{name} {how}{}", tail(.said))]
    Child {
        /// What it is called.
        name: String,
        /// How it ended, and how often it was tried.
        how: String,
        /// Its last words.
        said: Vec<String>,
        /// The exit code to pass on.
        code: u8,
    },
    /// The simulation ended before it was of any use.
    #[error("the simulator of channel '{channel}' ended before {what}; start it again")]
    SimulatorEnded {
        /// The channel.
        channel: String,
        /// What was waited for.
        what: &'static str,
    },
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// Results could not be written.
    #[error("cannot write results: {0}")]
    Output(io::Error),
    /// A signal.
    #[error("interrupted")]
    Interrupted,
}

impl From<RenderError> for LauncherError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Cancelled => Self::Interrupted,
            error => Self::Render(error),
        }
    }
}

impl From<EvaluateError> for LauncherError {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Scene(error) => Self::Scene(error),
            EvaluateError::Render(error) => error.into(),
            error @ EvaluateError::Point { .. } => Self::Usage(error.to_string()),
            error => Self::Evaluate(error),
        }
    }
}

fn tail(said: &[String]) -> String {
    match said {
        [] => "; it said nothing on stderr".into(),
        [line] => format!(": {line}"),
        lines => format!("; its last lines:\n    {}", lines.join("\n    ")),
    }
}

impl LauncherError {
    pub(crate) fn io(action: &'static str, path: impl Into<PathBuf>, source: io::Error) -> Self {
        Self::Io { action, path: path.into(), source }
    }

    /// The exit code that goes with it.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Simulator(SimulatorError::Scene(_)) => exit::CONFIG,
            Self::Render(RenderError::Scene { .. }) => exit::CONFIG,
            Self::Protocol(error)
            | Self::Simulator(SimulatorError::Protocol(error))
            | Self::Render(RenderError::Protocol(error)) => of_protocol(error),
            Self::Render(RenderError::Device(_)) => exit::DEVICE,
            #[cfg(feature = "window")]
            Self::Window(error) if error.is_of_device() => exit::DEVICE,
            Self::Interrupted => exit::INTERRUPTED,
            Self::Usage(_) | Self::Assignment(_) | Self::UnknownRenderer { .. } => exit::USAGE,
            Self::Placement(VplPlacementError::Setting { .. }) => exit::USAGE,
            Self::Child { code, .. } => *code,
            Self::SimulatorEnded { .. } => exit::CHILD,
            _ => exit::FAILED,
        }
    }
}

fn of_protocol(error: &ProtocolError) -> u8 {
    match error {
        ProtocolError::NotCreated { .. }
        | ProtocolError::NotInitialised { .. }
        | ProtocolError::ChannelBusy { .. }
        | ProtocolError::PublisherGone { .. }
        | ProtocolError::TimedOut { .. } => exit::CHANNEL,
        ProtocolError::InvalidName { .. } => exit::USAGE,
        ProtocolError::Cancelled { .. } => exit::INTERRUPTED,
        _ => exit::FAILED,
    }
}
