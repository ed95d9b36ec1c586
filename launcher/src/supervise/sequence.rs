//! Turns the pictures that are already in a folder into the arguments of the renderer that goes on with them.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

/// The numbered pictures of a built-in renderer, which outlive its processes.
#[derive(Clone, Debug)]
pub(crate) struct Sequence {
    /// Where they are.
    pub(crate) folder: PathBuf,
    /// Pictures older than this are of another run.
    pub(crate) begun: SystemTime,
    /// How many there shall be; `None`: one, once the light has converged.
    pub(crate) frames: Option<u32>,
}

impl Sequence {
    /// Arguments of a renderer that goes on where another one ended; `None` where nothing is left to do.
    pub(super) fn rest(&self) -> Option<Vec<OsString>> {
        let highest = self.highest();
        let left = u64::from(self.frames.unwrap_or(1)).checked_sub(highest).filter(|&left| left > 0)?;
        let mut arguments = vec![format!("--first={}", highest + 1).into()];
        arguments.extend(self.frames.map(|_| format!("--frames={left}").into()));
        Some(arguments)
    }

    /// Arguments of the first renderer.
    pub(super) fn whole(&self) -> Vec<OsString> {
        self.frames.iter().map(|frames| format!("--frames={frames}").into()).collect()
    }

    /// Whether there is a picture already.
    pub(super) fn has_begun(&self) -> bool {
        self.highest() > 0
    }

    /// The highest number of a finished picture; its PNG is written last.
    fn highest(&self) -> u64 {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let number = |path: PathBuf| {
            let number = path.file_name()?.to_str()?.strip_prefix("frame-")?.strip_suffix(".png")?.parse();
            number.ok().filter(|_| written_since(&path, self.begun))
        };
        entries.filter_map(|entry| number(entry.path())).max().unwrap_or(0)
    }
}

/// Whether a file was written after `begun`.
pub(crate) fn written_since(path: &Path, begun: SystemTime) -> bool {
    // Some file systems count time in coarse steps.
    let since = begun - Duration::from_millis(20);
    path.metadata().and_then(|m| m.modified()).is_ok_and(|time| time >= since)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_follows_the_finished_pictures_of_this_run() {
        let folder = tempfile::tempdir().unwrap();
        let begun = SystemTime::now();
        let write = |name: &str| std::fs::File::create(folder.path().join(name)).unwrap();
        let rest = |frames| {
            let sequence = Sequence { folder: folder.path().to_owned(), begun, frames };
            sequence.rest().map(|list| list.join(" ".as_ref()).into_string().unwrap())
        };
        let old = write("frame-0007.png");
        old.set_modified(begun - Duration::from_secs(1)).unwrap();
        assert_eq!(rest(Some(5)).unwrap(), "--first=1 --frames=5");
        assert_eq!(rest(None).unwrap(), "--first=1");
        // The EXR comes first, and is alone where the process died before the PNG; layers have names of their own.
        for name in
            ["frame-0001.png", "frame-0002.png", "frame-0003.exr", "frame-0004-normal.png", "frame-x.png"]
        {
            write(name);
        }
        assert_eq!(rest(Some(5)).unwrap(), "--first=3 --frames=3");
        assert_eq!((rest(Some(2)), rest(None)), (None, None));
        write("frame-12345.png");
        assert_eq!(rest(Some(12346)).unwrap(), "--first=12346 --frames=1");
    }
}
