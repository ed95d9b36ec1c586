//! Turns a segment into aligned 64-bit words: the only operations by which payload crosses processes.
//!
//! The ring algorithms are generic over these two traits, so that mapped memory, a file read in strict mode,
//! plain heap memory and loom's model checker run the very same code.

use std::sync::atomic::{AtomicU64, Ordering, fence};

use crate::error::ProtocolError;

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
    /// Like `write` for whole records, with another first word in each of them.
    fn write_stamped(&self, at: usize, from: &[u64], record_words: usize, stamp: u64);
}

impl ReadWords for [AtomicU64] {
    #[inline]
    fn read(&self, at: usize, into: &mut [u64]) -> Result<(), ProtocolError> {
        let from = at.checked_add(into.len()).and_then(|end| self.get(at..end));
        let from = from.ok_or_else(|| out_of_range(at, into.len(), self.len()))?;
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
    fn write_stamped(&self, at: usize, from: &[u64], record_words: usize, stamp: u64) {
        let to = &self[at..at + from.len()];
        if record_words == 8 {
            for (to, from) in to.as_chunks::<8>().0.iter().zip(from.as_chunks::<8>().0) {
                to[0].store(stamp, Ordering::Relaxed);
                for k in 1..8 {
                    to[k].store(from[k], Ordering::Relaxed);
                }
            }
            return;
        }
        let to = to.chunks_exact(record_words);
        for (to, from) in to.zip(from.chunks_exact(record_words)) {
            to[0].store(stamp, Ordering::Relaxed);
            for (word, value) in to[1..].iter().zip(&from[1..]) {
                word.store(*value, Ordering::Relaxed);
            }
        }
    }
}
