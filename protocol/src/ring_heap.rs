//! Turns heap memory into a ring under two threads: the code that runs on maps, where Miri and any debugger can follow.

use std::sync::atomic::AtomicU64;

use crate::record::ArrayKind;
use crate::ring_read::{Outcome, RingReader};
use crate::ring_write::{ArraySource, Changed, FrameHead, RingWriter};
use crate::shape::{ArrayShape, HEAD_WORDS, Shape};
use crate::staging::{ArrayView, Staging};

const RECORDS: usize = 40;
const WORDS: usize = 8;

fn shape() -> Shape {
    let (table, data) = (HEAD_WORDS, HEAD_WORDS + 16);
    let array =
        ArrayShape { kind: ArrayKind::SceneText, record_words: WORDS, capacity: RECORDS, data, table };
    Shape {
        latest: 0,
        slots: 3,
        first_slot: 16,
        stride: data + RECORDS * WORDS,
        chunk_records: 4,
        arrays: vec![array],
    }
}

struct Copies {
    words: Vec<u64>,
    versions: Vec<u64>,
}

impl Staging for Copies {
    fn array(&mut self, _a: usize, records: usize, _table: &[u64]) -> ArrayView<'_> {
        let (words, versions) =
            (&mut self.words[..records * WORDS], &mut self.versions[..records.div_ceil(4)]);
        ArrayView { words, versions, front_words: &[], front_versions: &[], patch: None }
    }
}

/// Every word follows from frame and place; chunk c changes every 1 + c mod 3 frames.
fn content(frame: u64) -> Vec<u64> {
    let word = |i: usize| {
        let period = 1 + (i / WORDS / 4) as u64 % 3;
        (frame / period) << 16 | i as u64
    };
    (0..RECORDS * WORDS).map(word).collect()
}

/// 2 000 frames (8 under Miri) against a reader that never pauses: whole frames only, the last one among them.
#[test]
fn frames_are_whole_on_heap_memory() {
    let frames = if cfg!(miri) { 8 } else { 2000 };
    let words: Vec<AtomicU64> = (0..16 + 3 * shape().stride).map(|_| AtomicU64::new(0)).collect();
    let words = &words[..];
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut writer = RingWriter::new(shape(), 0);
            let head = FrameHead::default();
            for frame in 1..=frames {
                let content = content(frame);
                let source = ArraySource { words: &content, changed: Changed::Compare, stamp: false };
                assert_eq!(writer.publish(words, &head, &[source]).unwrap(), frame);
            }
        });
        let mut reader = RingReader::new(shape());
        let mut copies = Copies { words: vec![0; RECORDS * WORDS], versions: vec![0; RECORDS] };
        let mut head = [0; HEAD_WORDS];
        while reader.seen() < frames {
            if reader.read(words, &mut copies, &mut head, &mut || false).unwrap() == Outcome::New {
                assert_eq!(copies.words, content(reader.seen()), "frame {}", reader.seen());
            } else {
                std::thread::yield_now();
            }
        }
    });
}
