//! Names what can go wrong in the simulator, with the remedy.

use photonstream_protocol::ProtocolError;
use photonstream_scene::SceneError;

/// Why a simulator did not start, or ended.
#[derive(Debug, thiserror::Error)]
pub enum SimulatorError {
    /// The scene could not be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The channel could not be taken or written.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// A thread could not be started.
    #[error("cannot start the {actor} thread: {source}; lower `threads` or the load on this machine")]
    Spawn {
        /// Which one.
        actor: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A thread panicked: a bug. The launcher restarts the process; renderers keep the last frame.
    #[error("the {actor} stopped unexpectedly; this is a bug: please report it with the log above")]
    ActorStopped {
        /// Which one.
        actor: &'static str,
    },
    /// A scene without light has nothing to measure.
    #[error("the scene sends out no photon: nothing to measure; add a light with power")]
    NothingToMeasure,
    /// Signal handlers could not be installed.
    #[error("cannot handle signals: {0}")]
    Signals(std::io::Error),
}
