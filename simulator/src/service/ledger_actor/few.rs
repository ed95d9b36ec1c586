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

/// How time passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passing {
    /// On the clock.
    Clock,
    /// In fixed steps of the scene's time, each of which is one frame.
    Steps,
    /// By one step alone, while it is paused.
    OneStep,
    /// Not at all: it is paused.
    Paused,
}

impl Passing {
    /// In a simulation that is paused, or makes one step of a pause, or goes in fixed steps.
    pub(super) fn of(is_paused: bool, is_stepping: bool, is_in_steps: bool) -> Self {
        match (is_paused, is_stepping) {
            (true, true) => Self::OneStep,
            (true, false) => Self::Paused,
            _ if is_in_steps => Self::Steps,
            _ => Self::Clock,
        }
    }
}

impl Few {
    pub(super) fn new(lights: FewLights) -> Self {
        Self { lights, last: None }
    }

    /// Goes on to the frame that is made at `now` and shows the instant `time_s` of `scene`. What was at rest begins to
    /// follow in this frame: the time of the rest is none in which it followed.
    pub(super) fn go_on(&mut self, scene: &Scene, now: Instant, time_s: f64, passing: Passing) {
        let (last, last_s) = self.last.replace((now, time_s)).unwrap_or((now, time_s));
        let streaming = &scene.streaming;
        let fixed_s = streaming.fixed_step_ms.map(|ms| ms / 1e3);
        let step_s = match passing {
            Passing::Steps => (time_s - last_s).min(fixed_s.unwrap_or(f64::INFINITY)),
            Passing::OneStep => fixed_s.unwrap_or(f64::from(streaming.publish_period_ms) / 1e3),
            Passing::Clock if self.lights.is_following() => {
                now.duration_since(last).min(LONGEST_STEP).as_secs_f64()
            }
            Passing::Clock | Passing::Paused => 0.0,
        };
        self.lights.update(scene, step_s.max(0.0));
    }

    /// Time goes on from now: that of a pause is not made up for.
    pub(super) fn resume(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use photonstream_scene::{Method, SceneConfig};
    use std::path::Path;

    /// A torch over a floor, whose axis meets it at (x, 0, 0).
    fn scene(streaming: &str, x: f32) -> Scene {
        let text = format!(
            "camera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
             origin_m = [0, 0, 0]\nmaterial.m.albedo = 0.5\n\
             object.floor = {{ material = \"m\", quad = {{ corner_m = [-4, 0, 4], edge_u_m = [8, 0, 0], edge_v_m = [0, 0, -8] }} }}\n\
             light.l = {{ power_w = 9, spot = {{ position_m = [0, 2, 0], target_m = [{x}, 0, 0], outer_half_angle_deg = 20 }} }}\n\
             vpl = [{{ position_m = [0, 0, 0], normal = [0, 1, 0], albedo = 0.5, weight = 1 }}]\n\
             [streaming]\nmethod = \"phantom-vpl\"\n{streaming}\n"
        );
        SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap().build().unwrap()
    }

    /// The share of the way from 0 to 2 after frames at the given times (s on the clock, and of the scene), the first of
    /// them before the axis moves.
    fn followed(streaming: &str, passing: Passing, frames: &[f64]) -> f32 {
        let (before, after) = (scene(streaming, 0.0), scene(streaming, 2.0));
        let mut few = Few::new(FewLights::new(&before, Method::PhantomVpl));
        let begun = Instant::now();
        for (index, &time_s) in frames.iter().enumerate() {
            let shown = if index == 0 { &before } else { &after };
            few.go_on(shown, begun + Duration::from_secs_f64(time_s), time_s, passing);
        }
        few.lights.lights()[0].light.position.x / 2.0
    }

    /// However long it rested, a phantom begins to follow when its axis moves: one time constant later it has gone 63 %.
    /// In fixed steps each is one of following. While it is paused nothing moves, but by single steps. Tolerance: roundings.
    #[test]
    fn a_rest_is_no_time_of_following() {
        let is = |share: f32, expected: f32| assert!((share - expected).abs() < 1e-4, "{share}, {expected}");
        let one_constant = 1.0 - (-1.0f32).exp();
        is(followed("", Passing::Clock, &[0.0, 60.0]), 0.0);
        is(followed("", Passing::Clock, &[0.0, 60.0, 60.024]), one_constant);
        is(followed("fixed_step_ms = 24", Passing::Steps, &[0.0, 60.0]), one_constant);
        is(followed("", Passing::Paused, &[0.0, 1.0, 2.0]), 0.0);
        is(followed("publish_period_ms = 24", Passing::OneStep, &[0.0, 1.0]), one_constant);
    }
}
