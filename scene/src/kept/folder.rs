//! Turns contents to be kept into files of a folder that is shared by processes and has an upper size.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Of files that are being written.
const UNFINISHED: &str = "unfinished";
/// After this time nobody writes to an unfinished file any more.
const ABANDONED: Duration = Duration::from_secs(3600);

static WRITTEN: AtomicU64 = AtomicU64::new(0);

/// Writes a file beside `path`, then renames it: others see the old one or the new one, whole.
pub(super) fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let unfinished = path.with_extension(format!("{}-{number}.{UNFINISHED}", std::process::id()));
    // Left behind by an earlier process of this number.
    let _ = fs::remove_file(&unfinished);
    let written = (|| {
        let mut out = BufWriter::new(File::create_new(&unfinished)?);
        write(&mut out)?;
        out.flush()?;
        fs::rename(&unfinished, path)
    })();
    if written.is_err() {
        let _ = fs::remove_file(&unfinished);
    }
    written
}

/// Makes a file the last to be removed; where that is not allowed its turn comes earlier, no more.
pub(super) fn mark_used(path: &Path) {
    let _ = File::open(path).and_then(|file| file.set_modified(SystemTime::now()));
}

/// Removes the files of an extension that were used least recently until the others have at most `limit` bytes, and abandoned ones.
pub(super) fn make_room(folder: &Path, extension: &str, limit: u64) -> io::Result<()> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        // What another process removed meanwhile is gone; what is not ours stays.
        let Ok(entry) = entry else { continue };
        let (Ok(about), path) = (entry.metadata(), entry.path()) else { continue };
        let used = about.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        match path.extension().and_then(|extension| extension.to_str()) {
            Some(other) if other == extension && about.is_file() => files.push((used, about.len(), path)),
            Some(UNFINISHED) if used.elapsed().is_ok_and(|age| age > ABANDONED) => {
                let _ = fs::remove_file(&path);
            }
            _ => {}
        }
    }
    files.sort();
    let mut bytes: u64 = files.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, size, path) in files {
        if bytes <= limit {
            break;
        }
        if fs::remove_file(path).is_ok() {
            bytes -= size;
        }
    }
    Ok(())
}
