//! Turns a segment into aligned 64-bit words: the only operations by which payload crosses processes.
//!
//! The ring algorithms are generic over these two traits, so that mapped memory, a file read in strict mode,
//! plain heap memory and loom's model checker run the very same code.

use std::sync::atomic::{AtomicU64, Ordering, fence};

use crate::error::ProtocolError;
use crate::finite;
use crate::record::ArrayKind;

/// The reader's fences, named so that a test can remove one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadFence {
    /// Between the load of `latest` and all that follows; pairs with the release store of `latest`.
    AfterLatest,
    /// Between copied words and the second load of the sequence; pairs with the writer's fence.
    BeforeRecheck,
}

/// The writer's release stores, named so that a test can weaken one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReleaseStore {
    /// A slot's sequence becomes even: the slot is complete.
    Sequence,
    /// `latest` names the slot's frame.
    Latest,
}

/// Words a reader may load; nothing else is ever done to them.
pub(crate) trait ReadWords {
    /// Copies `into.len()` words from word `at`, each by one relaxed load.
    fn read(&self, at: usize, into: &mut [u64]) -> Result<(), ProtocolError>;

    /// Like `read` for whole records of one array; says whether every float of the copy is finite.
    fn read_records(&self, kind: ArrayKind, at: usize, into: &mut [u64]) -> Result<bool, ProtocolError> {
        self.read(at, into)?;
        Ok(finite::all_finite(kind, into))
    }

    /// An acquire fence. (Acquire *loads* are not guaranteed to work on read-only maps, fences are.)
    fn fence_acquire(&self, _place: ReadFence) {
        fence(Ordering::Acquire);
    }

    /// One relaxed load.
    fn load(&self, at: usize) -> Result<u64, ProtocolError> {
        let mut word = [0];
        self.read(at, &mut word)?;
        Ok(word[0])
    }
}

/// Words the single writer may store.
pub(crate) trait WriteWords {
    /// One relaxed store.
    fn store(&self, at: usize, value: u64);
    /// One release store.
    fn store_release(&self, at: usize, value: u64, which: ReleaseStore);
    /// A release fence; pairs with the reader's `BeforeRecheck`.
    fn fence_release(&self);
    /// Stores the words from word `at` on, each by one relaxed store.
    fn write(&self, at: usize, from: &[u64]);
    /// Like `write` for whole lights, with another first word in each; says whether every float is finite.
    fn write_lights(&self, at: usize, from: &[u64], stamp: u64) -> bool;
}

impl ReadWords for [AtomicU64] {
    #[inline]
    fn read(&self, at: usize, into: &mut [u64]) -> Result<(), ProtocolError> {
        let from = range(self, at, into.len())?;
        // Eight words a step: atomic loads are not unrolled by the compiler.
        let (steps, rest) = into.as_chunks_mut::<8>();
        let (from_steps, from_rest) = from.as_chunks::<8>();
        for (to, from) in steps.iter_mut().zip(from_steps) {
            *to = from.each_ref().map(|word| word.load(Ordering::Relaxed));
        }
        for (to, word) in rest.iter_mut().zip(from_rest) {
            *to = word.load(Ordering::Relaxed);
        }
        Ok(())
    }

    #[inline]
    fn read_records(&self, kind: ArrayKind, at: usize, into: &mut [u64]) -> Result<bool, ProtocolError> {
        Ok(finite::load(kind, range(self, at, into.len())?, into))
    }
}

#[inline]
fn range(words: &[AtomicU64], at: usize, count: usize) -> Result<&[AtomicU64], ProtocolError> {
    let range = at.checked_add(count).and_then(|end| words.get(at..end));
    range.ok_or_else(|| out_of_range(at, count, words.len()))
}

#[cold]
pub(crate) fn out_of_range(at: usize, count: usize, len: usize) -> ProtocolError {
    ProtocolError::corrupt("word range", format!("{count} words from {at}"), format!("within {len}"))
}

impl WriteWords for [AtomicU64] {
    #[inline]
    fn store(&self, at: usize, value: u64) {
        self[at].store(value, Ordering::Relaxed);
    }

    #[inline]
    fn store_release(&self, at: usize, value: u64, _which: ReleaseStore) {
        self[at].store(value, Ordering::Release);
    }

    fn fence_release(&self) {
        fence(Ordering::Release);
    }

    #[inline]
    fn write(&self, at: usize, from: &[u64]) {
        for (word, value) in self[at..at + from.len()].iter().zip(from) {
            word.store(*value, Ordering::Relaxed);
        }
    }

    #[inline]
    fn write_lights(&self, at: usize, from: &[u64], stamp: u64) -> bool {
        finite::store_lights(from, &self[at..at + from.len()], stamp)
    }
}
