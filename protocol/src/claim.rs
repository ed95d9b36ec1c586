//! Turns a channel's folder into sole ownership of it: the lock, the journal of segments, and what a crash left.

use std::fs::{File, TryLockError};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::time::{Duration, Instant};

use rustix::shm;
use serde::{Deserialize, Serialize};

use crate::error::ProtocolError;
use crate::process::{Identity, monotonic_ns};
use crate::runtime::{ChannelDir, create_private};

/// How long a lock is tried for whose holder is just ending.
const HOLDER_ENDING: Duration = Duration::from_millis(200);
/// What every segment's name starts with; 24 hexadecimal digits follow (28 bytes; macOS allows 31).
const NAME_PREFIX: &str = "/ps-";

/// Content of the lock file, for messages to those who find it locked.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Holder {
    pub(crate) pid: u32,
    pub(crate) start_time: u64,
    /// Greatest epoch this channel has had.
    pub(crate) epoch: u64,
}

/// Sole ownership of a channel, for as long as this value or its process lives.
pub(crate) struct Claim {
    pub(crate) dir: ChannelDir,
    lock: File,
    epoch: u64,
}

impl Claim {
    /// Takes the lock, or says who holds it.
    pub(crate) fn take(dir: ChannelDir) -> Result<Self, ProtocolError> {
        let path = dir.file("lock");
        let deadline = Instant::now() + HOLDER_ENDING;
        loop {
            let lock = create_private(&path).map_err(|e| ProtocolError::io("open", &path, e))?;
            match lock.try_lock() {
                Ok(()) => {
                    // Someone may have removed the file between our opening and locking it.
                    let ours = lock.metadata().map_err(|e| ProtocolError::io("look at", &path, e))?;
                    if std::fs::symlink_metadata(&path)
                        .is_ok_and(|m| (m.dev(), m.ino()) == (ours.dev(), ours.ino()))
                    {
                        let last = holder(&dir).map_or(0, |holder| holder.epoch);
                        let epoch = last.max(dir.current().map_or(0, |current| current.epoch));
                        return Ok(Self { dir, lock, epoch });
                    }
                }
                Err(TryLockError::WouldBlock) => {
                    let holder = holder(&dir);
                    let running = holder.is_some_and(|holder| holder.identity().is_alive());
                    if running || Instant::now() >= deadline {
                        let channel = dir.channel.to_string();
                        return Err(ProtocolError::ChannelBusy {
                            channel,
                            pid: holder.map(|holder| holder.pid),
                        });
                    }
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(TryLockError::Error(error)) => return Err(ProtocolError::io("lock", path, error)),
            }
        }
    }

    /// Writes this process and the next epoch into the lock file.
    pub(crate) fn next_epoch(&mut self) -> Result<u64, ProtocolError> {
        self.epoch += 1;
        let own = Identity::own();
        let holder = Holder { pid: own.pid, start_time: own.start_time, epoch: self.epoch };
        let text = toml::to_string(&holder).expect("invariant: three integers are TOML");
        let path = self.dir.file("lock");
        self.lock
            .write_all_at(text.as_bytes(), 0)
            .and_then(|()| self.lock.set_len(text.len() as u64))
            .map_err(|e| ProtocolError::io("write", path, e))?;
        Ok(self.epoch)
    }

    /// Whether the folder still holds the file that is locked.
    pub(crate) fn is_intact(&self) -> bool {
        let path = self.dir.file("lock");
        match (self.lock.metadata(), std::fs::symlink_metadata(path)) {
            (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
            _ => false,
        }
    }

    /// Removes all that a crashed predecessor left; returns the names of its segments that were still there.
    pub(crate) fn recover(&self) -> Result<Vec<String>, ProtocolError> {
        let mut names = journal(&self.dir)?;
        names.extend(self.dir.current().map(|current| current.segment));
        let mut removed = Vec::new();
        for name in names {
            if is_segment_name(&name) && shm::unlink(&name).is_ok() {
                removed.push(name);
            }
        }
        for file in ["current", "current.new", "control.sock", "journal.new", "journal"] {
            self.dir.remove(file)?;
        }
        Ok(removed)
    }

    /// Notes, before they exist, the segments that would have to be removed after a crash.
    pub(crate) fn write_journal(&self, names: &[&str]) -> Result<(), ProtocolError> {
        self.dir.replace_small("journal", &names.join("\n"))
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Closing is not enough: a child process that is just being started holds a copy until it runs its program.
        // Where unlocking fails, closing still unlocks.
        let _ = self.lock.unlock();
    }
}

/// Who holds or last held a channel's lock.
pub(crate) fn holder(dir: &ChannelDir) -> Option<Holder> {
    toml::from_str(&dir.read_small("lock").ok()??).ok()
}

impl Holder {
    pub(crate) fn identity(&self) -> Identity {
        Identity { pid: self.pid, start_time: self.start_time }
    }
}

/// Names in a channel's journal.
pub(crate) fn journal(dir: &ChannelDir) -> Result<Vec<String>, ProtocolError> {
    Ok(dir.read_small("journal")?.unwrap_or_default().lines().map(str::to_owned).collect())
}

/// Whether a name is one that `new_segment_name` makes; others are never opened nor removed.
pub(crate) fn is_segment_name(name: &str) -> bool {
    name.strip_prefix(NAME_PREFIX).is_some_and(|digits| {
        digits.len() == 24 && digits.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
    })
}

/// A name that no segment has had: 96 bits from the system's generator, or from time and process without one.
pub(crate) fn new_segment_name() -> String {
    let mut bytes = [0; 12];
    let random =
        File::open("/dev/urandom").and_then(|file| std::io::Read::read_exact(&mut &file, &mut bytes));
    if random.is_err() {
        bytes[..8].copy_from_slice(&monotonic_ns().to_ne_bytes());
        bytes[8..].copy_from_slice(&std::process::id().to_ne_bytes());
    }
    let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{NAME_PREFIX}{digits}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segment_names_are_new_short_and_recognised() {
        let name = new_segment_name();
        assert!(is_segment_name(&name) && name.len() <= 31);
        assert_ne!(name, new_segment_name());
        for bad in [
            "/ps-../../etc/passwd12345678",
            "/ps-",
            "ps-0123456789abcdef01234567",
            "/ps-0123456789ABCDEF01234567",
        ] {
            assert!(!is_segment_name(bad), "{bad}");
        }
    }
}
