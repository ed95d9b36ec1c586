//! Turns requests to load the config again into its scene, while the present one goes on.

use super::config_source::ConfigSource;
use photonstream_protocol::Replier;
use photonstream_scene::{Scene, SceneError};

/// What a request to load the config has come to.
pub(super) struct Loaded {
    pub(super) scene: Result<Scene, SceneError>,
    /// Who asked.
    pub(super) replier: Replier,
}

/// Loads as often as it is asked to, until nobody asks or listens.
pub(super) fn run(
    mut source: ConfigSource,
    asked: &flume::Receiver<Replier>,
    loaded: &flume::Sender<Loaded>,
) {
    while let Ok(replier) = asked.recv() {
        if loaded.send(Loaded { scene: source.load(), replier }).is_err() {
            return;
        }
    }
}
