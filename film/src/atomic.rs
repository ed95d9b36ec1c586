//! Turns bytes into a file that appears whole: written beside its target, then renamed.

use crate::FilmError;
use std::{io::Write, path::Path};

/// Replaces the file at `path` by `bytes`; its folder is made where it is missing.
///
/// # Errors
/// [`FilmError::Write`]; then `path` is as it was.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), FilmError> {
    let failed = |source| FilmError::Write { path: path.into(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".photonstream-");
    // Temporary files are private by default; pictures are as readable as the user's umask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}
