//! Turns a file into what tells its versions apart without reading it.

use std::{
    path::Path,
    time::{Duration, SystemTime},
};

/// Size and time of a file that is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stamp(Option<(u64, Option<SystemTime>)>);

/// Times of files lag behind the clock by up to a tick of the system.
const LAG: Duration = Duration::from_millis(20);

impl Stamp {
    /// Of the file as it is now.
    pub(super) fn of(path: &Path) -> Self {
        Self(path.metadata().ok().map(|m| (m.len(), m.modified().ok())))
    }

    /// Whether there was no file.
    pub(super) fn is_of_nothing(self) -> bool {
        self.0.is_none()
    }

    /// Whether the file may have been written since `time`.
    pub(super) fn is_since(self, time: SystemTime) -> bool {
        let written = self.0.and_then(|(_, written)| written);
        written.is_none_or(|written| written + LAG >= time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_differ_by_size_and_by_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.obj");
        let nothing = Stamp::of(&path);
        assert!(nothing.is_of_nothing() && nothing.is_since(SystemTime::now()));
        std::fs::write(&path, "v").unwrap();
        let first = Stamp::of(&path);
        std::fs::write(&path, "v 1").unwrap();
        let larger = Stamp::of(&path);
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        let early = SystemTime::UNIX_EPOCH + Duration::from_secs(9);
        file.set_modified(early).unwrap();
        let older = Stamp::of(&path);
        assert!(first != larger && larger != older && older == Stamp::of(&path));
        assert!(larger.is_since(early) && older.is_since(early));
        assert!(!older.is_since(early + Duration::from_secs(1)));
    }
}
