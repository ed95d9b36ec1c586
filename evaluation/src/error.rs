//! Gathers what can end an evaluation early.

use crate::MetricsError;
use photonstream_film::FilmError;
use photonstream_renderer::RenderError;
use photonstream_scene::SceneError;
use photonstream_simulator::error::SimulatorError;
use std::{io, path::PathBuf};

/// Why an evaluation ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// Open Image Denoise failed.
    #[error("Open Image Denoise: {reason}; evaluate with a build without the feature oidn")]
    Denoise {
        /// What it says.
        reason: String,
    },
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A renderer, the path tracer among them; cancelled is [`RenderError::Cancelled`].
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The simulator.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// A picture file.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// Two pictures cannot be compared.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// A scene without light: nothing can be told of errors relative to it.
    #[error(
        "scene {scene}: found a black reference, expected light in the picture, without which relative errors do not exist; {remedy}"
    )]
    Black {
        /// Its name.
        scene: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A point to measure cannot be understood.
    #[error("--point {text}: {reason}")]
    Point {
        /// What was given.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A chart or a picture of the report cannot be drawn.
    #[error("cannot draw {what}: {reason}")]
    Draw {
        /// What was to be drawn.
        what: String,
        /// Why not.
        reason: String,
    },
    /// The system gives no threads.
    #[error("cannot start {threads} threads: {reason}; ask for fewer")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// The system's answer.
        reason: String,
    },
}

impl EvaluateError {
    /// Whether somebody wanted it to end.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Render(RenderError::Cancelled))
    }

    pub(crate) fn write(path: impl Into<PathBuf>, source: impl Into<io::Error>) -> Self {
        Self::Write { path: path.into(), source: source.into() }
    }

    pub(crate) fn draw(what: &str, reason: impl ToString) -> Self {
        Self::Draw { what: what.into(), reason: reason.to_string() }
    }
}
