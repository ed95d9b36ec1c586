//! Turns the name that an asset gives of another file into that file's content, if it lies in the asset's folder.

use std::{
    fs,
    path::{Component, Path, PathBuf},
};

/// The files of one folder that an asset names: each that was asked for, and the hash of what was read.
#[derive(Debug)]
pub(super) struct Beside<'p> {
    folder: &'p Path,
    /// All that were asked for, there or not.
    pub(super) files: Vec<PathBuf>,
    pub(super) hasher: blake3::Hasher,
}

impl<'p> Beside<'p> {
    /// The folder of `asset`, whose own content is `bytes`.
    pub(super) fn new(asset: &'p Path, bytes: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hash_file(&mut hasher, bytes);
        Self { folder: asset.parent().unwrap_or(Path::new("")), files: vec![asset.to_owned()], hasher }
    }

    /// The content of the ordinary file called `name` in the folder or below it.
    ///
    /// # Errors
    /// If the name leads out of the folder, or the file cannot be read.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let path = path_of(self.folder, name)?;
        let content = read(&path);
        self.files.push(path);
        let content = content?;
        hash_file(&mut self.hasher, &content);
        Ok(content)
    }
}

/// The path of the file called `name` in `folder` or below it.
fn path_of(folder: &Path, name: &str) -> Result<PathBuf, String> {
    // Written on Windows, read anywhere.
    let relative = PathBuf::from(name.replace('\\', "/"));
    let mut depth = 0usize;
    for component in relative.components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir if depth > 0 => depth -= 1,
            _ => return Err(format!("\"{name}\" leads out of the folder of the file that names it")),
        }
    }
    Ok(folder.join(relative))
}

/// The content of an ordinary file.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, String> {
    let cannot = |e: &dyn std::fmt::Display| format!("{} cannot be read ({e})", path.display());
    let metadata = fs::metadata(path).map_err(|e| cannot(&e))?;
    if !metadata.is_file() {
        return Err(cannot(&"no ordinary file"));
    }
    fs::read(path).map_err(|e| cannot(&e))
}

/// Adds a file to a content hash, told from its neighbours.
fn hash_file(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn names_that_lead_out_are_refused() {
        let folder = Path::new("/models/car");
        for (name, path) in [
            ("a.bin", "/models/car/a.bin"),
            ("textures\\b.png", "/models/car/textures/b.png"),
            ("./x/../y.bin", "/models/car/./x/../y.bin"),
        ] {
            assert_eq!(path_of(folder, name).unwrap(), Path::new(path));
        }
        for name in ["../a.bin", "/etc/passwd", "x/../../a.bin", "..\\a.bin", "\\etc\\passwd"] {
            assert!(path_of(folder, name).unwrap_err().contains("leads out of the folder"), "{name}");
        }
    }
}
