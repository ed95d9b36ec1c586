//! Turns what took long to compute into files of a folder, from which the next start reads it again.
//!
//! A file is found by the hash of all that its content was computed from, and believed where it is whole and of the present
//! version; what it says is then judged by whoever reads it. Whatever is wrong with a file or the folder, everything is
//! computed as without.

mod file;
mod folder;
mod user;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use bytemuck::Pod;

pub use crate::bvh::pages::Pages;
pub use file::Found;
pub use user::user_cache;

static OF_THIS_PROCESS: OnceLock<PathBuf> = OnceLock::new();

/// From now on this process keeps in `folder` what takes long to compute; without it it keeps nothing, so that libraries and
/// tests leave no files behind. Says whether it was the first: a process has one.
pub fn use_in_this_process(folder: PathBuf) -> bool {
    OF_THIS_PROCESS.set(folder).is_ok()
}

/// [`use_in_this_process`] with the user's folder, if there is one: for programs as they start.
pub fn use_user_cache() {
    if let Some(folder) = user_cache() {
        use_in_this_process(folder);
    }
}

/// What [`use_in_this_process`] was called with.
pub fn of_this_process() -> Option<&'static Path> {
    OF_THIS_PROCESS.get().map(PathBuf::as_path)
}

/// Of everything that a content was computed from, and of how.
pub type Key = [u8; 32];

/// What a folder's files hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// First bytes of a file.
    pub magic: [u8; 16],
    /// To be raised with every change of what is in a file, or of how it is computed.
    pub version: u32,
    /// Of whole files.
    pub extension: &'static str,
}

/// A folder of files of one kind; it may be deleted at any time, and several processes may use it at once.
#[derive(Debug)]
pub struct KeptFiles {
    folder: PathBuf,
    kind: Kind,
    /// Bytes that the files may have together.
    pub(crate) limit_bytes: u64,
    /// Whether it was told that nothing can be written.
    told: AtomicBool,
}

impl KeptFiles {
    /// Files of a kind in `folder`, which is made when the first is written; up to `limit_bytes`, of which those that were
    /// used least recently are removed.
    pub fn new(folder: PathBuf, kind: Kind, limit_bytes: u64) -> Self {
        Self { folder, kind, limit_bytes, told: AtomicBool::new(false) }
    }

    /// Where they lie.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a key.
    pub fn path(&self, key: &Key) -> PathBuf {
        self.folder.join(format!("{}.{}", blake3::Hash::from_bytes(*key).to_hex(), self.kind.extension))
    }

    /// What the file of `key` holds, if it is whole and neither list has more items than `most` says, so that no file asks
    /// for more memory.
    pub fn find<A: Pod + Sync, B: Pod + Sync>(&self, key: &Key, most: [usize; 2]) -> Option<Found<A, B>> {
        file::read(&self.path(key), &self.kind, key, most)
    }

    /// Makes the file of `key` the last to be removed.
    pub fn mark_used(&self, key: &Key) {
        folder::mark_used(&self.path(key));
    }

    /// Writes a file of a number and two lists in one step, and makes room. That it cannot be written is told once, at the
    /// level `debug`.
    pub fn keep<A: Pod + Sync, B: Pod + Sync>(&self, key: &Key, number: u32, lists: (&[A], &[B])) {
        if let Err(error) = self.write(key, number, lists)
            && !self.told.swap(true, Ordering::Relaxed)
        {
            tracing::debug!("{}: no file is kept: {error}", self.folder.display());
        }
    }

    fn write<A: Pod + Sync, B: Pod + Sync>(
        &self,
        key: &Key,
        number: u32,
        lists: (&[A], &[B]),
    ) -> std::io::Result<()> {
        if file::length::<A, B>([lists.0.len(), lists.1.len()]) > self.limit_bytes {
            return Ok(());
        }
        folder::replace(&self.path(key), |out| file::write(out, &self.kind, key, number, lists))?;
        folder::make_room(&self.folder, self.kind.extension, self.limit_bytes)
    }
}
