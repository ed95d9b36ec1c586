//! Turns time that passes into the time of the simulated scene.

use std::time::{Duration, Instant};

/// The time of an animated scene: that of the clock on the wall, or steps of one length.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    time_s: f64,
    fixed_step: Option<Duration>,
    /// Shortest time between two ticks.
    period: Duration,
    last: Instant,
    paused: bool,
    /// With steps: the last one is not shown yet.
    waits: bool,
}

/// Time that passed while nobody looked, as after a suspension of the machine, is not made up for beyond this.
const LONGEST_STEP: Duration = Duration::from_millis(250);

impl Clock {
    pub(super) fn new(fixed_step_ms: Option<f64>, period: Duration) -> Self {
        let fixed_step = fixed_step_ms.map(|ms| Duration::from_secs_f64(ms / 1e3));
        Self { time_s: 0.0, fixed_step, period, last: Instant::now(), paused: false, waits: true }
    }

    /// The same time, going on in another way.
    pub(super) fn set(&mut self, fixed_step_ms: Option<f64>, period: Duration) {
        *self = Self { time_s: self.time_s, paused: self.paused, ..Self::new(fixed_step_ms, period) };
    }

    /// When the scene is to be looked at again; `None` while time stands still.
    pub(super) fn next(&self) -> Option<Instant> {
        let is_still = self.paused || (self.fixed_step.is_some() && self.waits);
        (!is_still).then(|| self.last + self.fixed_step.unwrap_or(self.period))
    }

    /// Goes on to `now`.
    pub(super) fn tick(&mut self, now: Instant) {
        let passed = self.fixed_step.unwrap_or_else(|| (now - self.last).min(LONGEST_STEP));
        self.time_s += passed.as_secs_f64();
        self.last = now;
        self.waits = true;
    }

    /// One step while time stands still.
    pub(super) fn step(&mut self) {
        self.time_s += self.fixed_step.unwrap_or(self.period).as_secs_f64();
        self.last = Instant::now();
        self.waits = true;
    }

    /// The last step has been shown whole.
    pub(super) fn settled(&mut self) {
        self.waits = false;
    }

    /// There is something else to be shown whole first.
    pub(super) fn wait(&mut self) {
        self.waits = true;
    }

    pub(super) fn pause(&mut self, paused: bool) {
        if self.paused != paused {
            (self.paused, self.last) = (paused, Instant::now());
        }
    }

    pub(super) fn is_paused(&self) -> bool {
        self.paused
    }

    pub(super) fn is_fixed(&self) -> bool {
        self.fixed_step.is_some()
    }

    /// Seconds since the scene's beginning.
    pub(super) fn time_s(&self) -> f64 {
        self.time_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_of_one_length_and_wait_to_be_shown() {
        let mut clock = Clock::new(Some(20.0), Duration::from_millis(5));
        assert_eq!(clock.next(), None, "the beginning is shown first");
        clock.settled();
        let due = clock.next().unwrap();
        clock.tick(due + Duration::from_secs(9));
        assert!((clock.time_s() - 0.02).abs() < 1e-12 && clock.next().is_none());
        clock.settled();
        clock.pause(true);
        assert_eq!(clock.next(), None);
        clock.step();
        assert!((clock.time_s() - 0.04).abs() < 1e-12);
    }

    #[test]
    fn wall_time_passes_but_for_pauses_and_long_sleeps() {
        let mut clock = Clock::new(None, Duration::from_millis(5));
        let start = clock.last;
        assert_eq!(clock.next(), Some(start + Duration::from_millis(5)));
        clock.tick(start + Duration::from_millis(30));
        assert!((clock.time_s() - 0.03).abs() < 1e-9);
        clock.tick(start + Duration::from_secs(100));
        assert!((clock.time_s() - 0.28).abs() < 1e-9, "{}", clock.time_s());
    }
}
