//! Turns paths that were traced together into one another: what is asked for, what comes back, and each path of it.

use crate::{counters::Counters, flux::Deposit, trail::Vertex};

/// Which sample of its light a path takes: that of its slot, and which time round the slots of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Draw {
    /// The slot; all slots of a batch belong to one light.
    pub slot: u32,
    /// Slot i of a light with n slots takes sample i + `generation` · n: 0 always replays the same samples, counting it
    /// up streams through the sequence.
    pub generation: u32,
}

/// Finished paths, in the order in which they were asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathBatch {
    /// The slot of each path.
    pub slots: Vec<u32>,
    /// Number of deposits of each path.
    pub lengths: Vec<u16>,
    /// The deposits of all paths, one after another.
    pub deposits: Vec<Deposit>,
    /// Number of points of each path.
    pub point_counts: Vec<u16>,
    /// The points of all paths, one after another.
    pub vertices: Vec<Vertex>,
    /// Barycentric coordinates of each point that is a hit.
    pub uvs: Vec<[f32; 2]>,
    /// What happened on the way.
    pub counters: Counters,
}

impl PathBatch {
    /// Empties the batch, keeping its memory.
    pub fn clear(&mut self) {
        self.slots.clear();
        self.lengths.clear();
        self.deposits.clear();
        self.point_counts.clear();
        self.vertices.clear();
        self.uvs.clear();
        self.counters = Counters::default();
    }

    /// Each path.
    pub fn paths(&self) -> impl Iterator<Item = Path<'_>> {
        let (mut deposits, mut vertices, mut uvs) = (&self.deposits[..], &self.vertices[..], &self.uvs[..]);
        self.slots.iter().zip(&self.lengths).zip(&self.point_counts).map(
            move |((&slot, &length), &points)| Path {
                slot,
                deposits: take(&mut deposits, length),
                vertices: take(&mut vertices, points),
                uvs: take(&mut uvs, points),
            },
        )
    }
}

fn take<'a, T>(rest: &mut &'a [T], count: u16) -> &'a [T] {
    let (first, tail) = rest.split_at(usize::from(count));
    *rest = tail;
    first
}

/// A finished path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path<'a> {
    /// Its slot.
    pub slot: u32,
    /// What it left on its way.
    pub deposits: &'a [Deposit],
    /// The points it passed; none where its light sent nothing.
    pub vertices: &'a [Vertex],
    /// Barycentric coordinates of each point that is a hit.
    pub uvs: &'a [[f32; 2]],
}
