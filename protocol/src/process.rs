//! Turns a process id into an identity that a re-used id cannot fake, and says whether it still runs.

use std::path::Path;
use std::sync::OnceLock;

use rustix::process::{Pid, test_kill_process};
use rustix::time::{ClockId, clock_gettime};

/// A process, told apart from later ones with the same id by its start time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Identity {
    pub(crate) pid: u32,
    /// Clock ticks since boot; 0 where the system does not tell.
    pub(crate) start_time: u64,
}

impl Identity {
    pub(crate) fn own() -> Self {
        let pid = std::process::id();
        Self { pid, start_time: status(pid).map_or(0, |status| status.start_time) }
    }

    /// Whether this process runs (stopped counts as running; a zombie does not).
    pub(crate) fn is_alive(&self) -> bool {
        if let Some(found) = status(self.pid) {
            return !found.ended && (self.start_time == 0 || found.start_time == self.start_time);
        }
        if Path::new("/proc/self/stat").exists() {
            return false;
        }
        let pid = i32::try_from(self.pid).ok().and_then(Pid::from_raw);
        pid.is_some_and(|pid| !matches!(test_kill_process(pid), Err(rustix::io::Errno::SRCH)))
    }
}

struct Status {
    ended: bool,
    start_time: u64,
}

/// State and start time (fields 3 and 22) of `/proc/PID/stat`; the name in field 2 may hold anything.
fn status(pid: u32) -> Option<Status> {
    let text = std::fs::read(format!("/proc/{pid}/stat")).ok()?;
    let text = String::from_utf8_lossy(&text);
    let mut fields = text[text.rfind(')')? + 1..].split_ascii_whitespace();
    let state = fields.next()?;
    let start_time = fields.nth(18)?.parse().ok()?;
    Some(Status { ended: matches!(state, "Z" | "X" | "x"), start_time })
}

/// Identifies the boot, as two words; zeros where the system does not tell.
pub(crate) fn boot_id() -> [u64; 2] {
    static BOOT: OnceLock<[u64; 2]> = OnceLock::new();
    *BOOT.get_or_init(|| {
        let text = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        let digits: String = text.chars().filter(char::is_ascii_hexdigit).take(32).collect();
        let part = |range: std::ops::Range<usize>| {
            digits.get(range).and_then(|digits| u64::from_str_radix(digits, 16).ok()).unwrap_or(0)
        };
        [part(0..16), part(16..32)]
    })
}

/// Nanoseconds of the system's monotonic clock: the time base of heartbeats, publish times and event times.
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    // The clock counts up from boot: neither part is negative.
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_itself_from_a_process_with_another_start() {
        let own = Identity::own();
        assert!(own.is_alive());
        if own.start_time != 0 {
            assert!(!Identity { start_time: own.start_time + 1, ..own }.is_alive());
        }
        assert!(!Identity { pid: i32::MAX as u32, start_time: 1 }.is_alive());
    }

    #[test]
    fn a_zombie_is_not_alive() {
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let identity = Identity { pid: child.id(), start_time: 0 };
        while identity.is_alive() {
            std::thread::yield_now();
        }
        child.wait().unwrap();
        assert!(!identity.is_alive());
    }
}
