//! Turns what edits have made of VPLs, blockers and proxies into the file that the scene comes from.

use super::Director;
use photonstream_protocol::Reply;
use photonstream_scene::{SceneError, is_model};
use std::{
    io,
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

/// Why nothing was saved.
#[derive(Debug, thiserror::Error)]
enum SaveError {
    #[error("{}: {source}; look at its permissions and the space that is left", file.display())]
    File { file: PathBuf, source: io::Error },
    #[error("{0}; the file is left as it is")]
    Scene(#[from] SceneError),
}

/// The file at `path`, if scenes are written there: a model has no text.
pub(super) fn writable(path: &Path) -> Option<PathBuf> {
    (!is_model(path)).then(|| path.to_owned())
}

impl Director {
    /// Writes the present tables into the config. The watcher finds the same scene there, as a config that has changed.
    pub(super) fn save_vpls(&self) -> Reply {
        let Some(file) = &self.config_file else {
            let remedy = "write one by `photonstream config MODEL > scene.toml`, and simulate that";
            return Reply::error(
                "unsupported",
                format!("this simulation comes from no scene file; {remedy}"),
            );
        };
        match self.save_into(file) {
            Ok(()) => Reply::Ok { frame: self.latest_frame.load(Ordering::Acquire) },
            Err(error @ SaveError::File { .. }) => Reply::error("not-saved", error.to_string()),
            Err(error @ SaveError::Scene(_)) => Reply::error("invalid-value", error.to_string()),
        }
    }

    fn save_into(&self, file: &Path) -> Result<(), SaveError> {
        let failed = |source| SaveError::File { file: file.to_owned(), source };
        // A link stays one: what it leads to is replaced.
        let target = file.canonicalize().map_err(failed)?;
        let text = std::fs::read_to_string(&target).map_err(failed)?;
        let written = self.simulation.scene.vpls.written_into(&text, file)?;
        if written == text {
            return Ok(());
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
        })
    }
}
