//! Turns the newest complete slot of a ring into a private, coherent frame, in bounded time.

use crate::error::ProtocolError;
use crate::finite;
use crate::shape::{HEAD_WORDS, Shape, change_term, head};
use crate::staging::Staging;
use crate::words::{ReadFence, ReadWords};

/// Frames one call tries before it reports `Busy`.
pub(crate) const ATTEMPTS: usize = 8;

/// How one call ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// A newer frame is complete in the staging buffer.
    New,
    /// The newest frame is the one read last.
    Unchanged,
    /// The writer was faster, or time ran out; verified chunks stay for the next call.
    Busy,
    /// Nothing has been published yet.
    Empty,
}

/// One reader of a ring.
pub(crate) struct RingReader {
    shape: Shape,
    seen: u64,
    table: Vec<u64>,
}

/// The verified head of a frame.
pub(crate) type Head = [u64; HEAD_WORDS];

impl RingReader {
    pub(crate) fn new(shape: Shape) -> Self {
        Self { shape, seen: 0, table: Vec::new() }
    }

    /// The frame read last, 0 before the first.
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }

    /// Makes the reader forget that it read the newest frame.
    pub(crate) fn set_seen(&mut self, frame: u64) {
        self.seen = frame;
    }

    /// Whether a frame newer than the last one read is announced.
    pub(crate) fn has_new<W: ReadWords + ?Sized>(&self, words: &W) -> Result<bool, ProtocolError> {
        Ok(words.load(self.shape.latest)? != self.seen)
    }

    /// Brings the staging buffer to the newest frame; `spent` says when to give up.
    pub(crate) fn read<W: ReadWords + ?Sized, S: Staging>(
        &mut self,
        words: &W,
        staging: &mut S,
        head: &mut Head,
        spent: &mut dyn FnMut() -> bool,
    ) -> Result<Outcome, ProtocolError> {
        for _ in 0..ATTEMPTS {
            let frame = words.load(self.shape.latest)?;
            // Pairs with the release store of `latest`: all words of `frame`, or newer ones, are visible from here.
            words.fence_acquire(ReadFence::AfterLatest);
            if frame == self.seen {
                return Ok(if frame == 0 { Outcome::Empty } else { Outcome::Unchanged });
            }
            if frame < self.seen {
                return Err(ProtocolError::corrupt("latest", frame, format!("at least {}", self.seen)));
            }
            if frame > u64::MAX / 2 {
                return Err(ProtocolError::corrupt("latest", frame, "a frame number below 2^63"));
            }
            match self.read_slot(words, frame, staging, head, spent)? {
                Slot::Complete => {
                    self.seen = frame;
                    return Ok(Outcome::New);
                }
                Slot::Overwritten => {}
                Slot::OutOfTime => return Ok(Outcome::Busy),
            }
        }
        Ok(Outcome::Busy)
    }

    /// Copies what the staging buffer lacks of one frame, verifying each piece before it counts.
    ///
    /// Every piece is followed by a fence and a second look at the sequence, so nothing is left to check at the
    /// end but the change sum.
    fn read_slot<W: ReadWords + ?Sized, S: Staging>(
        &mut self,
        words: &W,
        frame: u64,
        staging: &mut S,
        head: &mut Head,
        spent: &mut dyn FnMut() -> bool,
    ) -> Result<Slot, ProtocolError> {
        let slot = self.shape.slot_of(frame);
        let unmoved = || -> Result<bool, ProtocolError> {
            // Pairs with the writer's release fence after the odd sequence.
            words.fence_acquire(ReadFence::BeforeRecheck);
            Ok(words.load(slot + head::SEQUENCE)? == 2 * frame)
        };
        words.read(slot, head)?;
        if head[head::SEQUENCE] < 2 * frame {
            let found = head[head::SEQUENCE];
            return Err(ProtocolError::corrupt("slot sequence", found, format!("at least {}", 2 * frame)));
        }
        if head[head::SEQUENCE] != 2 * frame || !unmoved()? {
            return Ok(Slot::Overwritten);
        }
        if head[head::FRAME] != frame {
            return Err(ProtocolError::corrupt("slot frame", head[head::FRAME], frame));
        }
        let mut running_index = 0;
        let mut change_sum = 0u64;
        for (a, shape) in self.shape.arrays.iter().enumerate() {
            let records = usize::try_from(head[head::COUNTS + a]).unwrap_or(usize::MAX);
            if records > shape.capacity {
                let field = format!("{} count", shape.kind.name());
                return Err(ProtocolError::corrupt(field, records, format!("at most {}", shape.capacity)));
            }
            self.table.resize(records.div_ceil(self.shape.chunk_records), 0);
            words.read(slot + shape.table, &mut self.table)?;
            if !unmoved()? {
                return Ok(Slot::Overwritten);
            }
            let mut view = staging.array(a, records, &self.table);
            let (chunk_words, array_words) =
                (self.shape.chunk_records * shape.record_words, records * shape.record_words);
            for (c, version) in self.table.iter().copied().enumerate() {
                change_sum = change_sum.wrapping_add(change_term(running_index, version));
                running_index += 1;
                if version == 0 || version > frame {
                    let field = format!("version of {} chunk {c}", shape.kind.name());
                    return Err(ProtocolError::corrupt(field, version, format!("1 to {frame}")));
                }
                let range = c * chunk_words..((c + 1) * chunk_words).min(array_words);
                if view.holds(c, &range, version) {
                    continue;
                }
                let copy = view.place(c, &range);
                let finite = words.read_records(shape.kind, slot + shape.data + range.start, copy)?;
                if !unmoved()? {
                    return Ok(Slot::Overwritten);
                }
                if !finite {
                    return Err(hostile(finite::find(shape.kind, c * self.shape.chunk_records, copy)));
                }
                view.verified(c, version);
                if spent() {
                    return Ok(Slot::OutOfTime);
                }
            }
        }
        if change_sum != head[head::CHANGE_SUM] {
            return Err(ProtocolError::corrupt("change sum", head[head::CHANGE_SUM], change_sum));
        }
        Ok(Slot::Complete)
    }
}

enum Slot {
    Complete,
    Overwritten,
    OutOfTime,
}

/// A record that no publisher of ours lets through says that the segment is not one of ours.
#[cold]
fn hostile(error: ProtocolError) -> ProtocolError {
    match error {
        ProtocolError::NonFinite { record, index, field, value } => {
            ProtocolError::corrupt(format!("{field} of {record} record {index}"), value, "a finite number")
        }
        other => other,
    }
}
