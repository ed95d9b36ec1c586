//! Turns the layout of a segment into word indices for the ring algorithms.

use crate::record::ArrayKind;

/// Words of a slot's head.
pub(crate) const HEAD_WORDS: usize = 24;

/// Places within a slot's head, in words.
pub(crate) mod head {
    /// 2f − 1 while frame f is written, 2f once it is complete.
    pub(crate) const SEQUENCE: usize = 0;
    /// Frame the slot holds.
    pub(crate) const FRAME: usize = 1;
    /// Monotonic ns at which the frame was published.
    pub(crate) const PUBLISH_TIME_NS: usize = 2;
    /// Simulated time, bits of an f64, in s.
    pub(crate) const SIMULATION_TIME_S: usize = 3;
    /// Configuration the frame belongs to.
    pub(crate) const CONFIG_GENERATION: usize = 4;
    /// Sum over the chunk tables, see `change_term`.
    pub(crate) const CHANGE_SUM: usize = 5;
    /// Bytes of the scene text.
    pub(crate) const TEXT_BYTES: usize = 6;
    /// Bytes of the notice.
    pub(crate) const NOTICE_BYTES: usize = 7;
    /// Records of the first array; those of the others follow.
    pub(crate) const COUNTS: usize = 8;
}

/// What one chunk adds to the change sum: its version times an odd number made of its running index.
pub(crate) fn change_term(running_index: usize, version: u64) -> u64 {
    version.wrapping_mul(2 * running_index as u64 + 1)
}

/// One array within a slot; places are words from the slot's first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ArrayShape {
    pub(crate) kind: ArrayKind,
    pub(crate) record_words: usize,
    pub(crate) capacity: usize,
    pub(crate) data: usize,
    pub(crate) table: usize,
}

/// The ring of slots; places are words from the segment's first.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub(crate) latest: usize,
    pub(crate) slots: usize,
    pub(crate) first_slot: usize,
    pub(crate) stride: usize,
    pub(crate) chunk_records: usize,
    pub(crate) arrays: Vec<ArrayShape>,
}

impl Shape {
    /// First word of the slot that holds a frame.
    pub(crate) fn slot_of(&self, frame: u64) -> usize {
        // The remainder is below the slot count, which is at most 8.
        self.first_slot + (frame % self.slots as u64) as usize * self.stride
    }
}
