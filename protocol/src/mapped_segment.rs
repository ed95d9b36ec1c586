//! Turns a subscriber's map into a place that a device can copy records from, and tells whether a copy was in time.
//!
//! For readers that are no CPU: a GPU that imports the map's address copies an array's bytes by itself, and asks
//! afterwards whether the slot still held the frame: the reader's protocol, with the copy done elsewhere. Values are
//! not checked here: what copied them has to, as it would check any bytes of a stranger.

use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};

use crate::error::ProtocolError;
use crate::layout::Layout;
use crate::mapping::ReaderMapping;
use crate::record::{ArrayKind, VslRecord};
use crate::shape::{HEAD_WORDS, head};
use crate::words::{ReadFence, ReadWords};

/// A segment's map, alive for as long as any clone of this: the address stays good after the subscriber has gone on.
#[derive(Clone)]
pub struct MappedSegment {
    mapping: Arc<ReaderMapping>,
    layout: Layout,
}

impl std::fmt::Debug for MappedSegment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MappedSegment").field("epoch", &self.layout.epoch).finish_non_exhaustive()
    }
}

/// Where a frame's virtual surface lights lie in a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappedFrame {
    /// Number of the frame.
    pub frame: u64,
    /// First byte of the [`VslRecord`]s, from the segment's first; a multiple of 64.
    pub vsl_offset: u64,
    /// Number of records.
    pub vsl_count: u32,
    /// First word of the slot.
    slot: usize,
}

impl MappedSegment {
    pub(crate) fn new(mapping: Arc<ReaderMapping>, layout: Layout) -> Self {
        Self { mapping, layout }
    }

    /// First byte of the map: page-aligned, read-only for the CPU, and changed by the publisher at any moment, so that
    /// no reference may ever be made of it.
    pub fn address(&self) -> *const u8 {
        self.mapping.words().as_ptr().cast()
    }

    /// Bytes of the map, a multiple of 4096.
    pub fn bytes(&self) -> u64 {
        self.layout.bytes
    }

    /// Number of the segment.
    pub fn epoch(&self) -> u64 {
        self.layout.epoch
    }

    /// Greatest number of virtual surface lights.
    pub fn vsl_capacity(&self) -> u32 {
        let vsls = self.layout.shape.arrays.iter().find(|a| a.kind == ArrayKind::Vsl);
        vsls.map_or(0, |a| u32::try_from(a.capacity).unwrap_or(u32::MAX))
    }

    /// The newest complete frame; `None` before the first, and while it is being overwritten.
    ///
    /// # Errors
    /// `Corrupt` for words that no publisher writes.
    pub fn newest(&self) -> Result<Option<MappedFrame>, ProtocolError> {
        let (words, shape) = (self.mapping.words(), &self.layout.shape);
        let frame = words.load(shape.latest)?;
        // Pairs with the release store of `latest`: all words of `frame`, or newer ones, are visible from here.
        words.fence_acquire(ReadFence::AfterLatest);
        if frame == 0 {
            return Ok(None);
        }
        if frame > u64::MAX / 2 {
            return Err(ProtocolError::corrupt("latest", frame, "a frame number below 2^63"));
        }
        let slot = shape.slot_of(frame);
        let mut found = [0; HEAD_WORDS];
        words.read(slot, &mut found)?;
        let vsls = shape.arrays.iter().enumerate().find(|(_, a)| a.kind == ArrayKind::Vsl);
        let Some((index, array)) = vsls else { return Ok(None) };
        let count = found[head::COUNTS + index];
        let mapped = MappedFrame {
            frame,
            vsl_offset: (slot + array.data) as u64 * 8,
            vsl_count: u32::try_from(count).unwrap_or(u32::MAX),
            slot,
        };
        if found[head::SEQUENCE] != 2 * frame || !self.holds(&mapped)? {
            return Ok(None);
        }
        if usize::try_from(count).map_or(true, |count| count > array.capacity) {
            let expected = format!("at most {}", array.capacity);
            return Err(ProtocolError::corrupt("vsl count", count, expected));
        }
        Ok(Some(mapped))
    }

    /// Whether the slot still holds `frame`, so that everything copied from it before this call is of that frame.
    ///
    /// The copy must have ended, and its end must happen before this call: for a device, it has told the CPU so.
    ///
    /// # Errors
    /// `Corrupt` for a `frame` of another segment.
    pub fn holds(&self, frame: &MappedFrame) -> Result<bool, ProtocolError> {
        // Pairs with the writer's release fence after the odd sequence.
        fence(Ordering::Acquire);
        Ok(self.mapping.words().load(frame.slot + head::SEQUENCE)? == 2 * frame.frame)
    }
}

const _: () = assert!(size_of::<VslRecord>() == 64, "records are copied by 64 bytes");
