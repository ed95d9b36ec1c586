//! Turns a shared-memory object into a slice of atomic words; the only module with `unsafe`.
#![allow(unsafe_code)]
//! Why unsafe is needed, and why it is sound:
//! - Other processes write these bytes at any time. They are therefore exposed only as `&[AtomicU64]` (and one
//!   `&AtomicU32` for the futex), whose contents may change under a shared reference, and which have no invalid
//!   values. No plain reference into a segment exists anywhere.
//! - The maps are page-aligned, as long as the slices made from them, and live as long as the borrow of the
//!   structure that owns them.
//! - The reader's map is read-only; the traits in `words` give readers nothing but relaxed loads of 8 bytes, which
//!   the standard library documents as allowed on read-only memory.
//! - What stays outside of Rust's reach is a file that shrinks under a map (SIGBUS). Only the same user can do that;
//!   strict mode reads with `read_at` and maps nothing.

use std::fs::File;
use std::sync::atomic::{AtomicU32, AtomicU64};

use memmap2::{Mmap, MmapOptions};
use shared_memory::{Shmem, ShmemConf, ShmemError};

/// A writer's map of a segment it created.
pub(crate) struct WriterMapping {
    shmem: Shmem,
}

// SAFETY: `Shmem` is a pointer, a length and a file descriptor, none bound to a thread; this structure hands out
// nothing but shared references to atomics, and the map is removed once, when the last owner drops it.
unsafe impl Send for WriterMapping {}
// SAFETY: as above; all access through `&self` is atomic.
unsafe impl Sync for WriterMapping {}

impl WriterMapping {
    /// Creates a new shared-memory object (never an existing one) and maps it.
    pub(crate) fn create(name: &str, bytes: usize) -> Result<Self, ShmemError> {
        let mut shmem = ShmemConf::new().os_id(name).size(bytes).create()?;
        // The publisher removes the name itself, after the pointer to it.
        shmem.set_owner(false);
        Ok(Self { shmem })
    }

    /// The segment's words.
    pub(crate) fn words(&self) -> &[AtomicU64] {
        let pointer = self.shmem.as_ptr().cast_const().cast::<AtomicU64>();
        // SAFETY: the map starts at a page, holds `len()` initialised bytes for as long as `self` lives, and is
        // accessed by every process through atomics only.
        unsafe { std::slice::from_raw_parts(pointer, self.shmem.len() / 8) }
    }

    /// The 32-bit wake word.
    pub(crate) fn wake_word(&self) -> &AtomicU32 {
        wake_word(self.words())
    }
}

/// A reader's read-only map of a segment.
pub(crate) struct ReaderMapping {
    map: Mmap,
}

impl ReaderMapping {
    /// Maps `bytes` of an open file, read-only.
    pub(crate) fn open(file: &File, bytes: usize) -> std::io::Result<Self> {
        // SAFETY: the bytes are only ever viewed as atomics (see `words`), so that they may change at any time.
        let map = unsafe { MmapOptions::new().len(bytes).map(file) }?;
        Ok(Self { map })
    }

    /// The segment's words, for relaxed loads only.
    pub(crate) fn words(&self) -> &[AtomicU64] {
        let pointer = self.map.as_ptr().cast::<AtomicU64>();
        // SAFETY: the map starts at a page, holds `len()` initialised bytes for as long as `self` lives, and is
        // never viewed as anything but atomics.
        unsafe { std::slice::from_raw_parts(pointer, self.map.len() / 8) }
    }

    /// The 32-bit wake word, for the kernel's futex only.
    pub(crate) fn wake_word(&self) -> &AtomicU32 {
        wake_word(self.words())
    }
}

/// The first four bytes of the wake word; no 8-byte access ever touches them.
fn wake_word(words: &[AtomicU64]) -> &AtomicU32 {
    let pointer = words[crate::layout::word::WAKE].as_ptr().cast::<AtomicU32>();
    // SAFETY: the pointer is that of an aligned word that lives as long as `words`, and all processes access these
    // four bytes as one `AtomicU32`.
    unsafe { &*pointer }
}
