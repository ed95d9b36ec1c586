//! Turns what edits have made of VPLs, blockers and proxies into the file that the scene comes from.

use super::Director;
use crate::service::{ConfigSource, placements::Wanted};
use photonstream_protocol::{Reply, monotonic_ns};
use photonstream_scene::{Scene, SceneError, VplSet, is_model};
use std::{
    io,
    path::{Path, PathBuf},
    sync::{Arc, atomic::Ordering},
};

/// Why nothing was saved.
#[derive(Debug, thiserror::Error)]
enum SaveError {
    #[error("{}: {source}; look at its permissions and the space that is left", file.display())]
    File { file: PathBuf, source: io::Error },
    #[error("{0}; the file is left as it is")]
    Scene(#[from] SceneError),
}

/// The file that edits are saved into.
pub(super) struct ConfigFile {
    path: PathBuf,
    /// Whether the scene is held at a moment, where what moves with objects is not where its file has it.
    is_held: bool,
}

/// The file of `source`, if scenes are written there: a model has no text.
pub(super) fn writable(source: &ConfigSource) -> Option<ConfigFile> {
    let path = source.path.clone();
    (!is_model(&path)).then(|| ConfigFile { path, is_held: source.overrides.time.is_some() })
}

/// Whether anything moves with an object.
fn has_attached(set: &VplSet) -> bool {
    set.vpls.iter().any(|vpl| vpl.object.is_some())
        || set.blockers.iter().any(|blocker| blocker.object.is_some())
        || set.proxies.iter().any(|proxy| proxy.object.is_some())
}

impl Director {
    /// Writes the present tables into the config. The watcher finds them there, and [`Director::take_saved`] follows.
    pub(super) fn save_vpls(&mut self) -> Reply {
        let Some(file) = &self.config_file else {
            let remedy = "write one by `photonstream config MODEL > scene.toml`, and simulate that";
            return Reply::error(
                "unsupported",
                format!("this simulation comes from no scene file; {remedy}"),
            );
        };
        if file.is_held && has_attached(&self.simulation.scene.vpls) {
            let reason = "with --time, what moves with objects is not where its file has it; simulate without it to save";
            return Reply::error("unsupported", reason);
        }
        match self.save_into(&file.path) {
            Ok(text) => {
                self.saved = Some(text);
                Reply::Ok { frame: self.latest_frame.load(Ordering::Acquire) }
            }
            Err(error @ SaveError::File { .. }) => Reply::error("not-saved", error.to_string()),
            Err(error @ SaveError::Scene(_)) => Reply::error("invalid-value", error.to_string()),
        }
    }

    /// Whether `text`, found in the config, is what was saved there, and nothing else has changed or is to come.
    pub(super) fn is_saved(&self, text: &str) -> bool {
        self.saved.as_deref() == Some(text) && self.still.notice.is_empty() && !self.placements.are_awaited()
    }

    /// Goes on with what was saved as the config: `loaded` from there, it differs from the config before by its VPLs,
    /// blockers and proxies alone, and all other edits stay as they are.
    pub(super) fn take_saved(&mut self, loaded: &Scene) {
        self.saved = None;
        self.loaded_hash = loaded.hash;
        let mut scene = Scene::clone(&self.simulation.scene);
        (scene.resolved_text, scene.hash) = (loaded.resolved_text.clone(), loaded.hash);
        scene.vpls = Arc::clone(&loaded.vpls);
        if !self.simulation.has_lights_of(&scene) {
            // What was edited since leaves `auto` another choice.
            self.placements.append(Wanted::version(scene, monotonic_ns(), Some(self.animated_s)));
            return self.place();
        }
        let mut still = self.still.next(&scene);
        still.config_generation += 1;
        let simulation = self.simulation.with_scene(Arc::new(scene));
        self.go_on(simulation, still, monotonic_ns());
    }

    /// Writes the file, and returns what it says now.
    fn save_into(&self, file: &Path) -> Result<String, SaveError> {
        let failed = |source| SaveError::File { file: file.to_owned(), source };
        // A link stays one: what it leads to is replaced.
        let target = file.canonicalize().map_err(failed)?;
        let text = std::fs::read_to_string(&target).map_err(failed)?;
        let written = self.simulation.scene.vpls.written_into(&text, file)?;
        if written == text {
            return Ok(written);
        }
        let permissions = std::fs::metadata(&target).map_err(failed)?.permissions();
        // Whole or not at all: whoever reads it meanwhile reads the old one.
        let beside = target.with_extension(format!("saving-{}", std::process::id()));
        let replaced = std::fs::write(&beside, &written)
            .and_then(|()| std::fs::set_permissions(&beside, permissions))
            .and_then(|()| std::fs::rename(&beside, &target));
        replaced.map_err(|source| {
            // Nothing is left where it can be helped.
            let _ = std::fs::remove_file(&beside);
            failed(source)
        })?;
        Ok(written)
    }
}
