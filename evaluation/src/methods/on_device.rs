//! Turns streamed light into the picture of a graphics device: traced by the processor's cores, drawn by the device.

use super::{Bench, MOST_RUNS, SHORT_MS, Shot, Times, photon_streaming};
use crate::{
    EvaluateError,
    device::{Device, Way},
    point::Point,
};
use photonstream_protocol::VslFrame;
use photonstream_renderer::Watch;

impl Bench {
    /// Measures one point on `device`: the median of several frames.
    ///
    /// # Errors
    /// As [`Bench::shoot`], and what the device cannot do.
    pub fn shoot_on(
        &mut self,
        device: &mut dyn Device,
        point: &Point,
        watch: Watch<'_>,
    ) -> Result<Shot, EvaluateError> {
        let (frame, place_ms, light) = self.light_for(point)?;
        watch.check()?;
        let drawn = device.draw(&self.scene, &frame, &self.options(point), &way(point), watch)?;
        let runs = drawn.frames_ms.len();
        let times = Times { place_ms, light_ms: median(light), picture_ms: median(drawn.frames_ms) };
        Ok(Shot { film: drawn.film, times, runs, vsls_placed: Some(frame.vsls.len()) })
    }

    /// The time of a picture of one point on `device`, ms: the median of several frames, or of one that takes long.
    ///
    /// # Errors
    /// As [`Bench::shoot_on`].
    pub fn time_on(
        &mut self,
        device: &mut dyn Device,
        point: &Point,
        watch: Watch<'_>,
    ) -> Result<f64, EvaluateError> {
        let (frame, ..) = self.light_for(point)?;
        watch.check()?;
        Ok(median(device.time(&self.scene, &frame, &self.options(point), &way(point), watch)?))
    }

    /// The light of a point, the time of placing it, and those of tracing it, ms.
    fn light_for(&mut self, point: &Point) -> Result<(VslFrame, f64, Vec<f64>), EvaluateError> {
        let (simulation, place_ms) = self.placed_for(point);
        let pool = self.threads(point.threads)?;
        let mut light: Vec<f64> = Vec::new();
        let frame = loop {
            let (frame, ms) = pool.install(|| photon_streaming::frame_of(&simulation))?;
            light.push(ms);
            if light.len() >= MOST_RUNS || light.iter().sum::<f64>() > SHORT_MS {
                break frame;
            }
        };
        Ok((VslFrame { scene_hash: self.scene.hash, ..frame }, place_ms, light))
    }
}

fn way(point: &Point) -> Way {
    Way { accumulation: point.accumulation.clone(), interleave: point.interleave }
}

/// The middle one; of an even number the slower of both.
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
