//! Turns a layout into a live segment of shared memory, fully allocated before a byte of it is used.

use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::{Mode, fchmod};
use rustix::io::Errno;
use rustix::shm;
use shared_memory::ShmemError;

use crate::error::ProtocolError;
use crate::layout::{Layout, state, word};
use crate::mapping::WriterMapping;
use crate::process::monotonic_ns;

/// A segment this process created.
pub(crate) struct WriterSegment {
    pub(crate) name: String,
    pub(crate) layout: Layout,
    mapping: WriterMapping,
    file_id: (u64, u64),
}

impl WriterSegment {
    /// Creates, allocates and fills in a segment of a name that is already in the journal.
    pub(crate) fn create(name: String, layout: Layout, paused: bool) -> Result<Self, ProtocolError> {
        let path = PathBuf::from(&name);
        let bytes = usize::try_from(layout.bytes).map_err(|_| no_space(&layout, 0))?;
        let mapping = WriterMapping::create(&name, bytes).map_err(|error| match error {
            ShmemError::MapCreateFailed(code) | ShmemError::UnknownOsError(code) => {
                match Errno::from_raw_os_error(code as i32) {
                    Errno::NOSPC | Errno::NOMEM | Errno::FBIG => no_space(&layout, 0),
                    error => ProtocolError::io("create shared memory", &path, error),
                }
            }
            other => {
                ProtocolError::io("create shared memory", &path, std::io::Error::other(other.to_string()))
            }
        })?;
        let file_id = allocate(&name, &layout).inspect_err(|_| unlink(&name))?;
        let segment = Self { name, layout, mapping, file_id };
        let words = segment.words();
        words[word::STATE].store(state::INIT, Ordering::Relaxed);
        for (to, value) in words.iter().zip(segment.layout.header()) {
            to.store(value, Ordering::Relaxed);
        }
        words[word::PAUSED].store(u64::from(paused), Ordering::Relaxed);
        segment.beat();
        // Pairs with a reader's fence after its load of the state: the header is complete.
        words[word::STATE].store(state::LIVE, Ordering::Release);
        Ok(segment)
    }

    pub(crate) fn words(&self) -> &[AtomicU64] {
        self.mapping.words()
    }

    /// Tells readers that the writer runs.
    pub(crate) fn beat(&self) {
        self.words()[word::HEARTBEAT].store(monotonic_ns(), Ordering::Relaxed);
    }

    pub(crate) fn set_paused(&self, paused: bool) {
        self.words()[word::PAUSED].store(u64::from(paused), Ordering::Relaxed);
        self.wake();
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.words()[word::PAUSED].load(Ordering::Relaxed) == 1
    }

    /// Says that no further frame comes from here, and wakes all readers.
    pub(crate) fn end(&self, state: u64) {
        self.words()[word::STATE].store(state, Ordering::Release);
        self.wake();
    }

    /// Wakes all readers that wait.
    pub(crate) fn wake(&self) {
        let wake_word = self.mapping.wake_word();
        // Release, so that a reader that saw the new value and fences sees what it was woken for.
        wake_word.fetch_add(1, Ordering::Release);
        #[cfg(target_os = "linux")]
        {
            use rustix::thread::futex;
            // A failed wake costs readers a few milliseconds: they wait in slices.
            let _ = futex::wake(wake_word, futex::Flags::empty(), i32::MAX as u32);
        }
    }

    /// Whether the segment's name still leads to it (a logout may remove names of running programs).
    pub(crate) fn is_named(&self) -> bool {
        shm::open(&self.name, shm::OFlags::RDONLY, Mode::empty())
            .ok()
            .and_then(|fd| File::from(fd).metadata().ok())
            .is_some_and(|metadata| (metadata.dev(), metadata.ino()) == self.file_id)
    }

    /// Removes the name, which no other segment has ever had.
    pub(crate) fn unlink(&self) {
        unlink(&self.name);
    }
}

fn unlink(name: &str) {
    // A name that is gone already is what was wanted.
    let _ = shm::unlink(name);
}

/// Reserves every byte, so that a full file system is an error here and not a signal at a later store.
fn allocate(name: &str, layout: &Layout) -> Result<(u64, u64), ProtocolError> {
    let failed = |error: Errno| ProtocolError::io("allocate shared memory", name, error);
    let fd = shm::open(name, shm::OFlags::RDWR, Mode::empty()).map_err(failed)?;
    fchmod(&fd, Mode::RUSR | Mode::WUSR).map_err(failed)?;
    #[cfg(target_os = "linux")]
    loop {
        use rustix::fs::{FallocateFlags, fallocate, fstatvfs};
        match fallocate(&fd, FallocateFlags::empty(), 0, layout.bytes) {
            Ok(()) => break,
            Err(Errno::INTR) => {}
            Err(Errno::NOSPC | Errno::NOMEM | Errno::FBIG) => {
                let available = fstatvfs(&fd).map_or(0, |fs| fs.f_bavail * fs.f_frsize);
                return Err(no_space(layout, available));
            }
            Err(error) => return Err(failed(error)),
        }
    }
    let metadata = File::from(fd).metadata().map_err(|e| ProtocolError::io("look at", name, e))?;
    Ok((metadata.dev(), metadata.ino()))
}

fn no_space(layout: &Layout, available: u64) -> ProtocolError {
    ProtocolError::NoSpace { bytes: layout.bytes, available }
}
