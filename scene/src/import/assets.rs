//! Turns the path of an asset as written in a scene file into the path of a file.

use std::path::{Path, PathBuf};

/// Folders in which assets of relative path are looked for, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AssetRoots {
    /// The folders.
    pub folders: Vec<PathBuf>,
}

impl AssetRoots {
    /// The environment variable that names the folder of scene assets.
    pub const VARIABLE: &str = "PHOTONSTREAM_SCENES";

    /// `$PHOTONSTREAM_SCENES` if set, `assets/` in the working directory, `assets/` beside the scene file, and the
    /// scene file's own folder.
    pub fn from_environment(scene_file: &Path) -> Self {
        let variable = std::env::var_os(Self::VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
        let beside = scene_file.parent().unwrap_or(Path::new(""));
        let own = [PathBuf::from("assets"), beside.join("assets"), beside.to_owned()];
        let mut folders: Vec<PathBuf> = variable.into_iter().chain(own).collect();
        folders.dedup();
        Self { folders }
    }

    /// The absolute path of `asset`, or where it was looked for in vain.
    pub(crate) fn find(&self, asset: &Path) -> Result<PathBuf, Vec<PathBuf>> {
        let candidates: Vec<PathBuf> = if asset.is_absolute() {
            vec![asset.to_owned()]
        } else {
            self.folders.iter().map(|folder| folder.join(asset)).collect()
        };
        let found = candidates.iter().find(|path| path.is_file());
        found.map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone())).ok_or(candidates)
    }
}
