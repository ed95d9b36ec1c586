//! Turns time that passes between frames into updates of few lights.

use crate::few_lights::FewLights;
use photonstream_scene::Scene;
use std::time::{Duration, Instant};

/// Time that passed while nobody looked, as after a suspension of the machine, is not made up for beyond this.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Few lights, and when they were updated last.
pub(super) struct Few {
    pub(super) lights: FewLights,
    /// On the clock, and in the scene's time, s.
    last: Option<(Instant, f64)>,
}

impl Few {
    pub(super) fn new(lights: FewLights) -> Self {
        Self { lights, last: None }
    }

    /// Goes on to the frame that is made at `now` and shows the instant `time_s` of `scene`: by as much as has passed on the
    /// clock, or of the scene's time where that goes in fixed steps.
    pub(super) fn go_on(&mut self, scene: &Scene, now: Instant, time_s: f64, is_in_steps: bool) {
        let (last, last_s) = self.last.replace((now, time_s)).unwrap_or((now, time_s));
        let step_s = if is_in_steps {
            time_s - last_s
        } else {
            now.duration_since(last).min(LONGEST_STEP).as_secs_f64()
        };
        self.lights.update(scene, step_s.max(0.0));
    }
}
