//! Turns the failures of a process into how long to wait before it is started again, and whether at all.

use std::time::Duration;

/// Pause after the first failure; doubled with each further one.
const FIRST: Duration = Duration::from_millis(100);
/// Longest pause.
const LONGEST: Duration = Duration::from_secs(5);
/// A process that ran for so long is well: what went before is forgotten.
const HEALTHY: Duration = Duration::from_secs(10);
/// A process that ended sooner never came up.
const CAME_UP: Duration = Duration::from_secs(1);
/// Failures in a row, never having come up, after which it is not started again.
const HOPELESS: u32 = 5;
/// Ends in a row with the same exit code and words after which it is not started again.
const SAME: u32 = 3;

/// What to do about a failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Start again after this time.
    Retry(Duration),
    /// Don't.
    GiveUp,
}

/// How a process has failed so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Backoff {
    failures: u32,
    never_came_up: u32,
    same: u32,
    last: Option<String>,
}

impl Backoff {
    /// Notes that the process ended after `uptime`. `complaint` is what it said, if it ended by its own exit code: a
    /// process that says the same time and again will not do better; one that was killed says nothing.
    pub(super) fn failed(&mut self, uptime: Duration, complaint: Option<String>) -> Verdict {
        if uptime >= HEALTHY {
            *self = Self::default();
        }
        self.never_came_up = if uptime >= CAME_UP { 0 } else { self.never_came_up + 1 };
        self.same = if complaint.is_some() && complaint == self.last { self.same + 1 } else { 1 };
        self.last = complaint;
        if self.never_came_up >= HOPELESS || (self.last.is_some() && self.same >= SAME) {
            return Verdict::GiveUp;
        }
        let pause = FIRST.saturating_mul(1 << self.failures.min(16)).min(LONGEST);
        self.failures += 1;
        Verdict::Retry(pause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    #[test]
    fn pauses_double_up_to_five_seconds() {
        let mut backoff = Backoff::default();
        let pauses: Vec<_> = (0..8).map(|_| backoff.failed(MS(2000), None)).collect();
        let expected = [100, 200, 400, 800, 1600, 3200, 5000, 5000].map(|ms| Verdict::Retry(MS(ms)));
        assert_eq!(pauses, expected);
    }

    #[test]
    fn ten_seconds_of_health_forget_the_past() {
        let mut backoff = Backoff::default();
        for _ in 0..4 {
            backoff.failed(MS(10), None);
        }
        assert_eq!(backoff.failed(MS(10_000), None), Verdict::Retry(MS(100)));
        assert_eq!(backoff.failed(MS(10), None), Verdict::Retry(MS(200)));
    }

    #[test]
    fn what_never_came_up_is_given_up_after_five_times() {
        let mut backoff = Backoff::default();
        for _ in 0..4 {
            assert!(matches!(backoff.failed(MS(999), None), Verdict::Retry(_)));
        }
        assert_eq!(backoff.failed(MS(999), None), Verdict::GiveUp);
        let mut backoff = Backoff::default();
        for i in 0..20 {
            let uptime = if i % 4 == 3 { 1000 } else { 1 };
            assert!(matches!(backoff.failed(MS(uptime), None), Verdict::Retry(_)), "{i}");
        }
    }

    #[test]
    fn the_same_complaint_three_times_is_enough() {
        let complain = |text: &str| Some(text.to_owned());
        let mut backoff = Backoff::default();
        assert!(matches!(backoff.failed(MS(3000), complain("disk full")), Verdict::Retry(_)));
        assert!(matches!(backoff.failed(MS(3000), complain("network down")), Verdict::Retry(_)));
        assert!(matches!(backoff.failed(MS(3000), complain("disk full")), Verdict::Retry(_)));
        assert!(matches!(backoff.failed(MS(3000), complain("disk full")), Verdict::Retry(_)));
        assert_eq!(backoff.failed(MS(3000), complain("disk full")), Verdict::GiveUp);
        let mut backoff = Backoff::default();
        for _ in 0..20 {
            assert!(matches!(backoff.failed(MS(3000), None), Verdict::Retry(_)));
        }
    }
}
