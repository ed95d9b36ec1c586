//! Turns the triangles of a large part into their tree by reading it from a folder, where it was built before.
//!
//! A tree is found by a hash of all that it was built from: see `key.rs`. What a file says is believed only where it is a
//! tree that passes [`super::SceneBvh::validate`] over exactly these triangles: see `checked.rs`. Hits do not depend on the shape of
//! a tree, so no file can change one, whoever wrote it. Whatever is wrong with a file or the folder, the tree is built.
//!
//! Files are those of [`crate::kept`]: their number is the reference of the root, their lists are nodes (256 bytes each) and
//! packets (320 bytes each, triangle numbers counted from the part's first).

mod checked;
mod key;

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;

use glam::Vec3;

use super::node::Node;
use super::part::Bvh;
use super::triangle::Packet;
use crate::kept::{self, Found, KeptFiles, Key, Kind};

/// Parts of fewer triangles are built; for twice as many, reading saves half a second.
const FROM_TRIANGLES: usize = 50_000;
/// Bytes that the files of a folder may have together.
const LIMIT_BYTES: u64 = 4 << 30;

const KIND: Kind = Kind { magic: *b"photonstreamtree", version: key::VERSION, extension: "tree" };

static OF_THIS_PROCESS: OnceLock<TreeCache> = OnceLock::new();

/// A folder that keeps the trees of large parts from one start to the next.
#[derive(Debug)]
pub(crate) struct TreeCache {
    files: KeptFiles,
    from_triangles: usize,
}

impl TreeCache {
    /// Trees of parts from 50 000 triangles in `folder`; up to 4 GiB.
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { files: KeptFiles::new(folder, KIND, LIMIT_BYTES), from_triangles: FROM_TRIANGLES }
    }

    /// That of the folder that this process keeps things in, if it does.
    pub(crate) fn of_this_process() -> Option<&'static Self> {
        let folder = kept::of_this_process()?;
        Some(OF_THIS_PROCESS.get_or_init(|| Self::new(folder.join("trees"))))
    }

    /// The tree of a part, the same bits whether it is read or built.
    pub(super) fn tree(&self, vertices: &[Vec3], triangles: &[[u32; 3]], range: Range<u32>) -> Bvh {
        let build = || Bvh::build(vertices, triangles, range.clone());
        if range.len() < self.from_triangles {
            return build();
        }
        let key = key::key(vertices, triangles, &range);
        if let Some(tree) = self
            .find(&key, range.len())
            .and_then(|found| checked::checked(found, vertices, triangles, &range))
        {
            self.files.mark_used(&key);
            tracing::debug!("tree of {} triangles read", range.len());
            return tree;
        }
        let tree = build();
        self.keep(&key, &tree, range.start);
        tree
    }

    /// What the file of a tree of `triangles` triangles holds: no such tree has more nodes or packets than these.
    fn find(&self, key: &Key, triangles: usize) -> Option<Found<Node, Packet>> {
        self.files.find(key, [triangles; 2])
    }

    /// Writes `tree`, whose triangle numbers begin with `first`.
    fn keep(&self, key: &Key, tree: &Bvh, first: u32) {
        let mut packets = Cow::Borrowed(&*tree.packets);
        if first != 0 {
            renumber(packets.to_mut(), first.wrapping_neg());
        }
        self.files.keep(key, tree.root, (&tree.nodes, &packets));
    }
}

/// Adds `offset` to the number of every triangle.
fn renumber(packets: &mut [Packet], offset: u32) {
    for packet in packets {
        for id in packet.ids.0.iter_mut().filter(|id| **id != u32::MAX) {
            *id = id.wrapping_add(offset);
        }
    }
}
