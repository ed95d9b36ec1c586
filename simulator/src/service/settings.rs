//! Turns new values of the config's `[streaming]` table into the running scene with other settings.

use photonstream_scene::{Scene, SceneConfig, SceneError};
use serde_json::{Map, Value};
use std::path::Path;

/// Why settings were refused.
#[derive(Debug, thiserror::Error)]
pub(super) enum SettingsError {
    /// No such key, or not of its type.
    #[error("streaming: {0}; the keys are those of the config's [streaming] table")]
    Keys(#[from] serde_json::Error),
    /// Threads are started once.
    #[error("streaming.threads: found a new number, expected none while it runs; restart the simulation")]
    Threads,
    /// A value is not possible.
    #[error(transparent)]
    Value(#[from] SceneError),
}

/// `scene` with other settings; its lights and objects stay as edits have made them.
pub(super) fn with_settings(scene: &Scene, values: &Map<String, Value>) -> Result<Scene, SettingsError> {
    if values.contains_key("threads") {
        return Err(SettingsError::Threads);
    }
    let mut config = SceneConfig::from_text(&scene.resolved_text, Path::new(""))?;
    let mut settings = serde_json::to_value(&config.streaming)?;
    // As edits have made them.
    scene.vpls.tables.clone().write(&mut config);
    if let Value::Object(settings) = &mut settings {
        settings.extend(values.clone());
    }
    config.streaming = serde_json::from_value(settings)?;
    let built = config.build()?;
    let mut next = scene.clone();
    (next.streaming, next.vpls) = (built.streaming, built.vpls);
    (next.resolved_text, next.hash) = (built.resolved_text, built.hash);
    Ok(next)
}
