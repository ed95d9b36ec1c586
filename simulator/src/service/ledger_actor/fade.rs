//! Turns the flux of lights before and after a move into what is shown in between: each frame a little more of the latter.
//!
//! A picture is linear in the flux of its lights: what is shown is a mean of the picture before and the one after. A light
//! whose patch has become another one by the move of its neighbours is two lights as long.

use super::Progress;
use crate::{flux::FluxReading, ledger::Ledger};
use photonstream_scene::Scene;
use std::time::{Duration, Instant};

/// How long lights take to fade in and out.
const FADE: Duration = Duration::from_secs(1);

/// A frame that comes late goes on as if it came after this time.
const LONGEST_STEP: Duration = Duration::from_millis(100);

/// Lights that fade from where they were to where they are.
pub(super) struct Fade {
    /// The number that each light had before has now.
    numbers: Vec<u32>,
    /// The share of what is now that is shown.
    share: f64,
    /// When that was, and what instant of the scene, s.
    last: Option<(Instant, f64)>,
}

impl Fade {
    /// `numbers`: which of the present lights each of those before is.
    pub(super) fn new(numbers: Vec<u32>) -> Self {
        Self { numbers, share: 0.0, last: None }
    }

    /// Goes on to the frame that is made at `now` and shows the instant `time_s` of the scene: by as much as has passed on
    /// the clock, or of the scene's time where that goes in fixed steps.
    pub(super) fn go_on(&mut self, now: Instant, time_s: f64, is_in_steps: bool) {
        let (last, last_s) = self.last.replace((now, time_s)).unwrap_or((now, time_s));
        let step_s = if is_in_steps { time_s - last_s } else { (now - last).min(LONGEST_STEP).as_secs_f64() };
        self.share = (self.share + step_s.max(0.0) / FADE.as_secs_f64()).min(1.0);
    }

    /// What is shown of the light that `ledger` has.
    pub(super) fn readings(&self, ledger: &Ledger, scene: &Scene) -> impl Iterator<Item = FluxReading> {
        let mut shown: Vec<FluxReading> =
            ledger.readings(scene).map(|after| faded(after, self.share as f32)).collect();
        let before = ledger.readings_before(scene).into_iter().flatten();
        for (before, &number) in before.zip(&self.numbers) {
            let before = faded(before, 1.0 - self.share as f32);
            let reading = &mut shown[number as usize];
            reading.flux += before.flux;
            reading.standard_error += before.standard_error;
            reading.mean_birth_ms = reading.mean_birth_ms.or(before.mean_birth_ms);
        }
        shown.into_iter()
    }
}

fn faded(reading: FluxReading, share: f32) -> FluxReading {
    let FluxReading { flux, standard_error, mean_birth_ms } = reading;
    FluxReading { flux: flux * share, standard_error: standard_error * share, mean_birth_ms }
}

impl Progress {
    /// Whether the scene's time goes in fixed steps, each of which is one frame.
    pub(super) fn is_in_steps(&self) -> bool {
        let scene = &self.simulation.scene;
        let is_over = |end_s: f64| self.time_s >= end_s;
        let is_moving = !scene.animation.is_empty() && !scene.animation.end_s().is_some_and(is_over);
        is_moving && scene.streaming.fixed_step_ms.is_some()
    }

    /// Ends the fade once all of what is now was shown. Whether it has.
    pub(super) fn end_fade_if_over(&mut self) -> bool {
        let is_over = self.fade.as_ref().is_some_and(|fade| fade.share >= 1.0);
        if is_over {
            self.fade = None;
            self.ledger.end_fade();
            self.moves.are_due();
        }
        is_over
    }
}
