//! Turns the content of a frame into stores into the slot that is its turn, chunk by changed chunk.

use crate::chunks::ChunkSet;
use crate::error::ProtocolError;
use crate::finite;
use crate::shape::{Shape, change_term, head};
use crate::words::{ReleaseStore, WriteWords};

/// How the writer knows which chunks of an array changed.
pub(crate) enum Changed<'a> {
    /// By comparing with what it published last.
    Compare,
    /// The caller says so.
    Chunks(&'a ChunkSet),
}

/// The new content of one array.
pub(crate) struct ArraySource<'a> {
    pub(crate) words: &'a [u64],
    pub(crate) changed: Changed<'a>,
    /// Whether these are lights, the first word of which becomes the frame of their chunk's last change.
    pub(crate) stamp: bool,
}

/// The head of the frame; the writer adds sequence, frame, counts and change sum.
#[derive(Default)]
pub(crate) struct FrameHead {
    pub(crate) publish_time_ns: u64,
    pub(crate) simulation_time_s: f64,
    pub(crate) config_generation: u64,
    pub(crate) text_bytes: u64,
    pub(crate) notice_bytes: u64,
}

/// What the writer remembers of one array.
#[derive(Default)]
struct ArrayState {
    /// Frame in which each chunk last changed, 0 for "not published yet".
    versions: Vec<u64>,
    /// Content published last; empty where the caller names the changed chunks.
    mirror: Vec<u64>,
    records: usize,
}

/// The single writer of a ring.
pub(crate) struct RingWriter {
    shape: Shape,
    frame: u64,
    slot_frames: Vec<u64>,
    arrays: Vec<ArrayState>,
}

impl RingWriter {
    /// A writer whose first frame is the one after `frame`.
    pub(crate) fn new(shape: Shape, frame: u64) -> Self {
        let slot_frames = vec![0; shape.slots];
        let arrays = shape.arrays.iter().map(|_| ArrayState::default()).collect();
        Self { shape, frame, slot_frames, arrays }
    }

    /// Frame published last, 0 before the first.
    pub(crate) fn frame(&self) -> u64 {
        self.frame
    }

    /// Publishes one frame and returns its number.
    ///
    /// Records are checked on the way into the slot. If one is not finite the slot stays odd, `latest` keeps its
    /// value, readers notice nothing, and the next frame starts from scratch.
    pub(crate) fn publish<W: WriteWords + ?Sized>(
        &mut self,
        words: &W,
        frame_head: &FrameHead,
        sources: &[ArraySource<'_>],
    ) -> Result<u64, ProtocolError> {
        for (shape, source) in self.shape.arrays.iter().zip(sources) {
            let records = source.words.len() / shape.record_words;
            if records > shape.capacity {
                let field = shape.kind.name();
                return Err(ProtocolError::TooMany { field, found: records, capacity: shape.capacity });
            }
        }
        let frame = self.frame + 1;
        let slot = self.shape.slot_of(frame);
        words.store(slot + head::SEQUENCE, 2 * frame - 1);
        // Orders the odd sequence before every word of the frame: a reader that saw one of those words and then
        // fences (`BeforeRecheck`) sees a sequence that moved.
        words.fence_release();

        let slot_frame = self.slot_frames[(frame % self.shape.slots as u64) as usize];
        let mut running_index = 0;
        let mut change_sum = 0u64;
        for (a, source) in sources.iter().enumerate() {
            if let Err(error) = self.write_array(words, slot, slot_frame, frame, a, source) {
                self.forget();
                return Err(error);
            }
            let state = &self.arrays[a];
            for version in &state.versions {
                change_sum = change_sum.wrapping_add(change_term(running_index, *version));
                running_index += 1;
            }
            words.store(slot + head::COUNTS + a, state.records as u64);
        }
        words.store(slot + head::FRAME, frame);
        words.store(slot + head::PUBLISH_TIME_NS, frame_head.publish_time_ns);
        words.store(slot + head::SIMULATION_TIME_S, frame_head.simulation_time_s.to_bits());
        words.store(slot + head::CONFIG_GENERATION, frame_head.config_generation);
        words.store(slot + head::CHANGE_SUM, change_sum);
        words.store(slot + head::TEXT_BYTES, frame_head.text_bytes);
        words.store(slot + head::NOTICE_BYTES, frame_head.notice_bytes);

        // Release for a reader that finds the slot by scanning sequences; ours goes through `latest`.
        words.store_release(slot + head::SEQUENCE, 2 * frame, ReleaseStore::Sequence);
        // Pairs with the reader's fence `AfterLatest`.
        words.store_release(self.shape.latest, frame, ReleaseStore::Latest);
        self.slot_frames[(frame % self.shape.slots as u64) as usize] = frame;
        self.frame = frame;
        Ok(frame)
    }

    /// Writes the chunks of one array that the slot lacks.
    fn write_array<W: WriteWords + ?Sized>(
        &mut self,
        words: &W,
        slot: usize,
        slot_frame: u64,
        frame: u64,
        a: usize,
        source: &ArraySource<'_>,
    ) -> Result<(), ProtocolError> {
        let shape = &self.shape.arrays[a];
        let state = &mut self.arrays[a];
        let records = source.words.len() / shape.record_words;
        if records == 0 && state.records == 0 {
            return Ok(());
        }
        let chunk_words = self.shape.chunk_records * shape.record_words;
        // A chunk whose extent changes counts as changed, so that one version always means one content.
        let same_extent = if records == state.records {
            usize::MAX
        } else {
            records.min(state.records) / self.shape.chunk_records
        };
        state.versions.resize(records.div_ceil(self.shape.chunk_records), 0);
        state.records = records;
        if matches!(source.changed, Changed::Chunks(_)) {
            state.mirror.clear();
        } else {
            let known = state.mirror.len();
            state.mirror.resize(source.words.len(), 0);
            if known == 0 {
                state.versions.fill(0);
            }
        }
        for (c, content) in source.words.chunks(chunk_words).enumerate() {
            let at = c * chunk_words;
            let changed = c >= same_extent
                || state.versions[c] == 0
                || match source.changed {
                    Changed::Chunks(set) => set.contains(c),
                    Changed::Compare if source.stamp => lights_differ(content, &state.mirror[at..]),
                    Changed::Compare => content != &state.mirror[at..at + content.len()],
                };
            if changed {
                state.versions[c] = frame;
                if let Some(mirror) = state.mirror.get_mut(at..at + content.len()) {
                    mirror.copy_from_slice(content);
                }
            }
            let version = state.versions[c];
            if version > slot_frame {
                words.store(slot + shape.table + c, version);
                let finite = if source.stamp {
                    words.write_lights(slot + shape.data + at, content, version)
                } else {
                    words.write(slot + shape.data + at, content);
                    finite::all_finite(shape.kind, content)
                };
                if !finite {
                    return Err(finite::find(shape.kind, c * self.shape.chunk_records, content));
                }
            }
        }
        Ok(())
    }

    /// Makes everything count as changed, after a frame that was given up half written.
    fn forget(&mut self) {
        self.slot_frames.fill(0);
        for state in &mut self.arrays {
            state.versions.fill(0);
            state.mirror.clear();
        }
    }
}

/// Whether lights differ in more than their first word; looks at sixteen of them between two branches.
fn lights_differ(new: &[u64], old: &[u64]) -> bool {
    new.chunks(128).zip(old.chunks(128)).any(|(new, old)| difference(new, old).1 != 0)
}

/// Bits in which the first words of lights differ, and bits in which the others do.
///
/// Not inlined, so that all eight words stay in vectors although nobody asks for the first.
#[inline(never)]
fn difference(new: &[u64], old: &[u64]) -> (u64, u64) {
    let mut difference = [0; 8];
    for (new, old) in new.as_chunks::<8>().0.iter().zip(old.as_chunks::<8>().0) {
        for k in 0..8 {
            difference[k] |= new[k] ^ old[k];
        }
    }
    (difference[0], difference[1..].iter().fold(0, |all, word| all | word))
}
