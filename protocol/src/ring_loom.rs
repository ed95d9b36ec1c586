//! Turns the ring into a model that loom runs in every order and with every stale value the memory model allows.
//!
//! Each mutant lacks one fence or one release; each must be caught, which shows that the model can see the fault.

use std::panic::{AssertUnwindSafe, catch_unwind};

use loom::sync::Arc;
use loom::sync::atomic::{AtomicU64, Ordering, fence};

use crate::error::ProtocolError;
use crate::record::ArrayKind;
use crate::ring_read::{Outcome, RingReader};
use crate::ring_write::{ArraySource, Changed, FrameHead, RingWriter};
use crate::shape::{ArrayShape, HEAD_WORDS, Shape};
use crate::staging::{ArrayView, Staging};
use crate::words::{ReadFence, ReadWords, ReleaseStore, WriteWords};

/// What a mutant lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mutant {
    None,
    NoWriterFence,
    NoReaderFence(ReadFence),
    RelaxedLatest,
}

struct LoomWords {
    words: Vec<AtomicU64>,
    mutant: Mutant,
}

impl ReadWords for LoomWords {
    fn read(&self, at: usize, into: &mut [u64]) -> Result<(), ProtocolError> {
        for (i, to) in into.iter_mut().enumerate() {
            // The head's unused words are never written: leaving them out keeps the model small.
            *to = if is_used(at + i) { self.words[at + i].load(Ordering::Relaxed) } else { 0 };
        }
        Ok(())
    }

    fn fence_acquire(&self, place: ReadFence) {
        if self.mutant != Mutant::NoReaderFence(place) {
            fence(Ordering::Acquire);
        }
    }
}

impl WriteWords for LoomWords {
    fn store(&self, at: usize, value: u64) {
        if is_used(at) {
            self.words[at].store(value, Ordering::Relaxed);
        }
    }

    fn store_release(&self, at: usize, value: u64, which: ReleaseStore) {
        let relaxed = which == ReleaseStore::Latest && self.mutant == Mutant::RelaxedLatest;
        self.words[at].store(value, if relaxed { Ordering::Relaxed } else { Ordering::Release });
    }

    fn fence_release(&self) {
        if self.mutant != Mutant::NoWriterFence {
            fence(Ordering::Release);
        }
    }

    fn write(&self, at: usize, from: &[u64]) {
        for (i, value) in from.iter().enumerate() {
            self.words[at + i].store(*value, Ordering::Relaxed);
        }
    }

    fn write_lights(&self, at: usize, from: &[u64], _stamp: u64) -> bool {
        self.write(at, from);
        true
    }
}

const SLOTS: usize = 2;
const CHUNKS: usize = 2;
const TABLE: usize = HEAD_WORDS;
const DATA: usize = TABLE + CHUNKS;
const STRIDE: usize = DATA + CHUNKS;

/// `latest`, sequences, frames, the count, the change sum, tables and data: what the algorithm depends on.
fn is_used(at: usize) -> bool {
    at == 0 || matches!((at - 1) % STRIDE, 0 | 1 | 5 | 8 | HEAD_WORDS..)
}

/// One array of two records of one word, in chunks of one record.
fn shape() -> Shape {
    let array = ArrayShape {
        kind: ArrayKind::SceneText,
        record_words: 1,
        capacity: CHUNKS,
        data: DATA,
        table: TABLE,
    };
    Shape { latest: 0, slots: SLOTS, first_slot: 1, stride: STRIDE, chunk_records: 1, arrays: vec![array] }
}

#[derive(Default)]
struct Copies {
    words: [u64; CHUNKS],
    versions: [u64; CHUNKS],
}

impl Staging for Copies {
    fn array(&mut self, _a: usize, records: usize, _table: &[u64]) -> ArrayView<'_> {
        ArrayView {
            words: &mut self.words[..records],
            versions: &mut self.versions[..records],
            front_words: &[],
            front_versions: &[],
            patch: None,
        }
    }
}

/// Content of a frame: chunk 0 changes in every frame, chunk 1 in odd ones.
fn content(frame: u64) -> [u64; CHUNKS] {
    [100 + frame, 200 + (frame - 1) / 2 * 2 + 1]
}

fn publish(writer: &mut RingWriter, words: &LoomWords, frame: u64) {
    let head = FrameHead::default();
    let sources = [ArraySource { words: &content(frame), changed: Changed::Compare, stamp: false }];
    assert_eq!(writer.publish(words, &head, &sources).unwrap(), frame);
}

/// A writer publishes up to `frames` while a reader reads twice; a frame it gets must be whole.
///
/// `hurried` readers run out of time after each copied chunk, and go on in the next call.
fn model(mutant: Mutant, before: u64, frames: u64, reads: usize, hurried: bool) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(2);
    builder.max_branches = 10_000;
    builder.check(move || {
        let words = (0..1 + SLOTS * STRIDE).map(|_| AtomicU64::new(0)).collect();
        let words = Arc::new(LoomWords { words, mutant });
        let mut writer = RingWriter::new(shape(), 0);
        for frame in 1..=before {
            publish(&mut writer, &words, frame);
        }
        let shared = Arc::clone(&words);
        let thread = loom::thread::spawn(move || {
            for frame in before + 1..=frames {
                publish(&mut writer, &shared, frame);
            }
        });
        let mut reader = RingReader::new(shape());
        let mut copies = Copies::default();
        let mut head = [0; HEAD_WORDS];
        for _ in 0..reads {
            let outcome =
                reader.read(&*words, &mut copies, &mut head, &mut || hurried).expect("no corruption");
            if outcome == Outcome::New {
                assert_eq!(copies.words, content(reader.seen()), "torn frame {}", reader.seen());
            }
        }
        thread.join().unwrap();
        reader.read(&*words, &mut copies, &mut head, &mut || false).expect("no corruption");
        assert_eq!((reader.seen(), copies.words), (frames, content(frames)));
    });
}

fn is_caught(mutant: Mutant, before: u64, frames: u64) -> bool {
    catch_unwind(AssertUnwindSafe(|| model(mutant, before, frames, 1, false))).is_err()
}

#[test]
fn the_first_frame_arrives_whole() {
    model(Mutant::None, 0, 1, 1, false);
}

#[test]
fn a_reader_never_sees_a_torn_frame_while_its_slot_is_overwritten() {
    model(Mutant::None, 1, 3, 1, false);
}

#[test]
fn verified_chunks_survive_between_reads() {
    model(Mutant::None, 1, 2, 2, true);
}

#[test]
fn the_writer_needs_its_fence() {
    assert!(is_caught(Mutant::NoWriterFence, 1, 3));
}

#[test]
fn the_reader_needs_its_fence_before_the_second_look() {
    assert!(is_caught(Mutant::NoReaderFence(ReadFence::BeforeRecheck), 1, 3));
}

#[test]
fn the_reader_needs_its_fence_after_latest() {
    assert!(is_caught(Mutant::NoReaderFence(ReadFence::AfterLatest), 0, 1));
}

#[test]
fn latest_must_be_released() {
    assert!(is_caught(Mutant::RelaxedLatest, 0, 1));
}
