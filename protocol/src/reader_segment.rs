//! Turns the name of a segment into checked, read-only access to it, mapped or through reads alone.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::shm;

use crate::claim::is_segment_name;
use crate::error::ProtocolError;
use crate::layout::{Layout, state, word};
use crate::mapped_segment::MappedSegment;
use crate::mapping::ReaderMapping;
use crate::process::monotonic_ns;
use crate::runtime::{ChannelDir, Current, check_file};
use crate::words::{ReadWords, out_of_range};

/// How a subscriber reaches the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AccessMode {
    /// Through a read-only map: fastest. A segment cut short by its owner ends the process (SIGBUS).
    #[default]
    Mapped,
    /// Through `read_at` alone: slower, and a segment cut short is an error.
    Strict,
}

/// Words of a segment that is only ever read through system calls.
pub(crate) struct FileWords {
    file: File,
    words: usize,
}

impl ReadWords for FileWords {
    fn read(&self, at: usize, into: &mut [u64]) -> Result<(), ProtocolError> {
        if at.checked_add(into.len()).is_none_or(|end| end > self.words) {
            return Err(out_of_range(at, into.len(), self.words));
        }
        read_words(&self.file, at, into)
    }
}

fn read_words(file: &File, at: usize, into: &mut [u64]) -> Result<(), ProtocolError> {
    let count = into.len();
    file.read_exact_at(bytemuck::cast_slice_mut(into), at as u64 * 8).map_err(|error| {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            ProtocolError::corrupt("file length", "too short", format!("{count} words at word {at}"))
        } else {
            ProtocolError::io("read", "the segment", error)
        }
    })
}

/// Time without a heartbeat after which a segment whose process is unknown here counts as left over.
const ORPHANED_AFTER_NS: u64 = 5_000_000_000;

enum Access {
    Mapped(Arc<ReaderMapping>),
    Strict(FileWords),
}

/// A checked segment.
pub(crate) struct ReaderSegment {
    pub(crate) name: String,
    pub(crate) layout: Layout,
    access: Access,
}

impl ReaderSegment {
    /// Opens what `current` names; every property is checked before anything is mapped.
    pub(crate) fn open(dir: &ChannelDir, current: &Current, mode: AccessMode) -> Result<Self, ProtocolError> {
        let path = Path::new(&current.segment);
        let file = open_file(Some(dir), &current.segment)?;
        let metadata = file.metadata().map_err(|e| ProtocolError::io("look at", path, e))?;
        let bytes = metadata.len();
        if bytes != current.bytes {
            return Err(ProtocolError::corrupt("file length", bytes, current.bytes));
        }
        if bytes < 4096 {
            return Err(ProtocolError::corrupt("file length", bytes, "at least 4096"));
        }
        let mut found = [0];
        read_words(&file, word::STATE, &mut found)?;
        // Pairs with the release store of the state: the header is complete if the state says so.
        fence(Ordering::Acquire);
        match found[0] {
            state::LIVE | state::RETIRED | state::CLOSED => {}
            0 | state::INIT => {
                let segment = current.segment.clone();
                return Err(ProtocolError::NotInitialised { segment, found: found[0] });
            }
            other => return Err(ProtocolError::corrupt("state", other, "1 to 4")),
        }
        let mut header = [0; word::COUNT];
        read_words(&file, 0, &mut header)?;
        let layout = Layout::check(&header, bytes)?;
        if layout.epoch != current.epoch {
            return Err(ProtocolError::corrupt("epoch", layout.epoch, current.epoch));
        }
        let length = usize::try_from(bytes)
            .map_err(|_| ProtocolError::corrupt("segment length", bytes, "within the address space"))?;
        let access = match mode {
            AccessMode::Mapped => {
                let mapping = ReaderMapping::open(&file, length);
                let mapping = mapping.map_err(|error| ProtocolError::io("map", path, error))?;
                Access::Mapped(Arc::new(mapping))
            }
            AccessMode::Strict => Access::Strict(FileWords { file, words: length / 8 }),
        };
        Ok(Self { name: current.segment.clone(), layout, access })
    }

    /// Whether a shared-memory object is a segment of ours that a crashed writer left some seconds ago.
    pub(crate) fn is_orphan(name: &str) -> bool {
        let Ok(file) = open_file(None, name) else { return false };
        let mut header = [0; word::COUNT];
        let mut heartbeat = [0];
        if read_words(&file, 0, &mut header).is_err()
            || read_words(&file, word::HEARTBEAT, &mut heartbeat).is_err()
        {
            return false;
        }
        let bytes = file.metadata().map_or(0, |metadata| metadata.len());
        Layout::check(&header, bytes).is_ok_and(|layout| {
            !layout.writer.is_alive() && monotonic_ns().saturating_sub(heartbeat[0]) > ORPHANED_AFTER_NS
        })
    }

    /// One live word.
    pub(crate) fn load(&self, at: usize) -> Result<u64, ProtocolError> {
        match &self.access {
            Access::Mapped(mapping) => mapping.words().load(at),
            Access::Strict(file) => file.load(at),
        }
    }

    /// The mapped words, or the file's.
    pub(crate) fn words(&self) -> Words<'_> {
        match &self.access {
            Access::Mapped(mapping) => Words::Mapped(mapping.words()),
            Access::Strict(file) => Words::Strict(file),
        }
    }

    /// The map itself, for devices; `None` where the segment is read without one.
    pub(crate) fn mapped(&self) -> Option<MappedSegment> {
        match &self.access {
            Access::Mapped(mapping) => Some(MappedSegment::new(Arc::clone(mapping), self.layout.clone())),
            Access::Strict(_) => None,
        }
    }

    /// Sleeps until the writer says something new, at most `slice`.
    #[cfg(target_os = "linux")]
    pub(crate) fn sleep(&self, seen: u32, slice: std::time::Duration) {
        use rustix::thread::futex;
        let Access::Mapped(mapping) = &self.access else {
            std::thread::sleep(slice.min(STRICT_SLICE));
            return;
        };
        let slice =
            futex::Timespec { tv_sec: slice.as_secs() as i64, tv_nsec: i64::from(slice.subsec_nanos()) };
        // Woken, changed, interrupted or timed out: the caller looks again in each case.
        let _ = futex::wait(mapping.wake_word(), futex::Flags::empty(), seen, Some(&slice));
    }

    /// Sleeps for a moment: only Linux has a futex across processes here.
    #[cfg(not(target_os = "linux"))]
    pub(crate) fn sleep(&self, _seen: u32, slice: std::time::Duration) {
        std::thread::sleep(slice.min(STRICT_SLICE));
    }

    /// The wake word, to be loaded before looking for news and handed to `sleep` after.
    pub(crate) fn wake_count(&self) -> u32 {
        match &self.access {
            Access::Mapped(mapping) => {
                let count = mapping.wake_word().load(Ordering::Relaxed);
                // Pairs with the writer's release increment: what it woke readers for is visible from here.
                fence(Ordering::Acquire);
                count
            }
            Access::Strict(_) => 0,
        }
    }
}

/// Opens a shared-memory object of ours for reading: a regular file, our own, private, and no link.
fn open_file(dir: Option<&ChannelDir>, name: &str) -> Result<File, ProtocolError> {
    if !is_segment_name(name) {
        return Err(ProtocolError::corrupt("segment name", name, "/ps- and 24 hexadecimal digits"));
    }
    let path = Path::new(name);
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits();
    let flags = shm::OFlags::RDONLY | shm::OFlags::from_bits_retain(flags);
    let file = match shm::open(name, flags, Mode::empty()) {
        Ok(fd) => File::from(fd),
        Err(Errno::NOENT) => {
            let channel = dir.map(|dir| dir.channel.to_string()).unwrap_or_default();
            return Err(ProtocolError::NotCreated { channel, path: path.to_owned() });
        }
        Err(Errno::LOOP) => {
            let (found, expected) = ("a symbolic link".to_owned(), "a regular file".to_owned());
            return Err(ProtocolError::Insecure { path: path.to_owned(), field: "type", found, expected });
        }
        Err(error) => return Err(ProtocolError::io("open shared memory", path, error)),
    };
    let metadata = file.metadata().map_err(|e| ProtocolError::io("look at", path, e))?;
    check_file(path, &metadata, metadata.is_file(), "a regular file", 0o077)?;
    Ok(file)
}

/// Longest sleep where nothing wakes a reader.
const STRICT_SLICE: std::time::Duration = std::time::Duration::from_millis(1);

/// The two kinds of words, told apart once per call and not once per word.
pub(crate) enum Words<'a> {
    Mapped(&'a [AtomicU64]),
    Strict(&'a FileWords),
}
