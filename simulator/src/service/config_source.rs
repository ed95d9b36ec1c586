//! Turns a config file and the settings that override it into scenes, as often as the file changes.

use crate::cli::Overrides;
use photonstream_scene::{Scene, SceneConfig, SceneError};
use std::path::{Path, PathBuf};

/// Where the scene of a simulation comes from.
#[derive(Clone, Debug)]
pub struct ConfigSource {
    /// The scene file.
    pub path: PathBuf,
    /// What replaces its settings, whatever it says.
    pub overrides: Overrides,
}

impl ConfigSource {
    /// The scene as the file is now.
    ///
    /// # Errors
    /// If it cannot be read, or is not valid.
    pub fn load(&self) -> Result<Scene, SceneError> {
        self.finish(SceneConfig::from_file(&self.path)?)
    }

    /// The scene that `text` would be in the place of the file.
    ///
    /// # Errors
    /// If it is not valid.
    pub fn load_text(&self, text: &str) -> Result<Scene, SceneError> {
        self.finish(SceneConfig::from_text(text, &self.path)?)
    }

    fn finish(&self, mut config: SceneConfig) -> Result<Scene, SceneError> {
        self.overrides.apply(&mut config);
        config.build()
    }

    /// The folder in which the file lies.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }
}

/// The files that a loaded scene was read from, beside its config.
pub(super) fn assets(scene: &Scene) -> Vec<PathBuf> {
    // The resolved text has their full paths.
    let config = SceneConfig::from_text(&scene.resolved_text, Path::new(""));
    let objects = config.map(|config| config.object).unwrap_or_default();
    objects.into_values().filter_map(|object| Some(PathBuf::from(object.obj?.path))).collect()
}
