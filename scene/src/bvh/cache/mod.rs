//! Turns the triangles of a large part into their tree by reading it from a folder, where it was built before.
//!
//! A tree is found by a hash of all that it was built from: see `key.rs`. What a file says is believed only where it is a
//! tree that passes [`super::SceneBvh::validate`] over exactly these triangles: see `checked.rs`. Hits do not depend on the shape of
//! a tree, so no file can change one, whoever wrote it. Whatever is wrong with a file or the folder, the tree is built.

mod checked;
mod file;
mod folder;
mod key;

#[cfg(test)]
mod tests;

use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use super::part::Bvh;

/// Parts of fewer triangles are built; for twice as many, reading saves half a second.
const FROM_TRIANGLES: usize = 50_000;
/// Bytes that the files of a folder may have together.
const LIMIT_BYTES: u64 = 4 << 30;

static OF_THIS_PROCESS: OnceLock<TreeCache> = OnceLock::new();

/// A folder that keeps the trees of large parts from one start to the next; it may be deleted at any time.
///
/// Several processes may use one folder at once.
#[derive(Debug)]
pub struct TreeCache {
    folder: PathBuf,
    from_triangles: usize,
    limit_bytes: u64,
    /// Whether it was told that nothing can be written.
    told: AtomicBool,
}

impl TreeCache {
    /// Trees of parts from 50 000 triangles in `folder`, which is made when the first is written; up to 4 GiB, of
    /// which those that were used least recently are removed.
    pub fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            from_triangles: FROM_TRIANGLES,
            limit_bytes: LIMIT_BYTES,
            told: AtomicBool::new(false),
        }
    }

    /// From now on scenes that this process loads use this cache; without it they use none, so that libraries and
    /// tests leave no files behind. Says whether it was the first: a process has one.
    pub fn use_in_this_process(self) -> bool {
        OF_THIS_PROCESS.set(self).is_ok()
    }

    /// What [`Self::use_in_this_process`] was called with.
    pub(crate) fn of_this_process() -> Option<&'static Self> {
        OF_THIS_PROCESS.get()
    }

    /// The tree of a part, the same bits whether it is read or built.
    pub(super) fn tree(&self, vertices: &[Vec3], triangles: &[[u32; 3]], range: Range<u32>) -> Bvh {
        let build = || Bvh::build(vertices, triangles, range.clone());
        if range.len() < self.from_triangles {
            return build();
        }
        let key = key::key(vertices, triangles, &range);
        let path = self.path(&key);
        let found = file::read(&path, &key, range.len())
            .and_then(|found| checked::checked(found, vertices, triangles, &range));
        if let Some(tree) = found {
            folder::mark_used(&path);
            tracing::debug!("tree of {} triangles read from {}", range.len(), path.display());
            return tree;
        }
        let tree = build();
        if let Err(error) = self.keep(&key, &tree, range.start)
            && !self.told.swap(true, Ordering::Relaxed)
        {
            tracing::debug!("{}: trees are not kept: {error}", self.folder.display());
        }
        tree
    }

    fn path(&self, key: &[u8; 32]) -> PathBuf {
        self.folder.join(format!("{}.{}", blake3::Hash::from_bytes(*key).to_hex(), folder::EXTENSION))
    }

    /// Writes a tree in one step, and makes room.
    fn keep(&self, key: &[u8; 32], tree: &Bvh, first: u32) -> std::io::Result<()> {
        if file::length(tree.nodes.len(), tree.packets.len()) > self.limit_bytes {
            return Ok(());
        }
        folder::replace(&self.path(key), |out| file::write(out, key, tree, first))?;
        folder::make_room(&self.folder, self.limit_bytes)
    }
}
