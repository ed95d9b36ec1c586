//! Turns a config file and the settings that override it into scenes, as often as the file changes.

use crate::cli::Overrides;
use photonstream_scene::{Scene, SceneConfig, SceneError, is_model};
use std::{
    io,
    path::{Path, PathBuf},
    time::SystemTime,
};

/// The text of a model, which has none: the scene is made anew when the file changes.
const MODEL: &str = "model";

/// Where the scene of a simulation comes from.
#[derive(Clone, Debug)]
pub struct ConfigSource {
    /// The scene file.
    pub path: PathBuf,
    /// What replaces its settings, whatever it says.
    pub overrides: Overrides,
    /// The text that was loaded last.
    text: Option<String>,
    /// When loading it began.
    since: SystemTime,
}

impl ConfigSource {
    /// The config at `path`, or that of the model there.
    pub fn new(path: impl Into<PathBuf>, overrides: Overrides) -> Self {
        Self { path: path.into(), overrides, text: None, since: SystemTime::UNIX_EPOCH }
    }

    /// The scene as the file is now.
    ///
    /// # Errors
    /// If it cannot be read, or is not valid.
    pub fn load(&mut self) -> Result<Scene, SceneError> {
        self.since = SystemTime::now();
        let text = self.read().map_err(|source| SceneError::Read { file: self.path.clone(), source })?;
        let scene = self.load_text(&text)?;
        self.text = Some(text);
        Ok(scene)
    }

    /// The text that was loaded last.
    pub(super) fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// When it was begun to be loaded last: files that were written since may not be what was read.
    pub(super) fn since(&self) -> SystemTime {
        self.since
    }

    /// The text of the file; of a model, whose own content is an asset, what stands for it.
    pub(super) fn read(&self) -> io::Result<String> {
        if is_model(&self.path) {
            std::fs::metadata(&self.path)?;
            return Ok(MODEL.into());
        }
        let bytes = std::fs::read(&self.path)?;
        String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }

    /// The scene that `text` would be in the place of the file; that of a model as it is now.
    ///
    /// # Errors
    /// If it is not valid.
    pub(super) fn load_text(&self, text: &str) -> Result<Scene, SceneError> {
        let config = if is_model(&self.path) {
            SceneConfig::from_file(&self.path)?
        } else {
            SceneConfig::from_text(text, &self.path)?
        };
        self.overrides.apply(config)?.build()
    }

    /// The folder in which the file lies.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }
}

/// The files that a scene which cannot be loaded waits for.
pub(super) fn missing(error: &SceneError) -> Vec<PathBuf> {
    match error {
        SceneError::AssetMissing { looked, .. } => looked.clone(),
        SceneError::Asset { asset, .. } => vec![asset.clone()],
        _ => Vec::new(),
    }
}
