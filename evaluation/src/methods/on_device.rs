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
        watch.check()?;
        let way = Way { accumulation: point.accumulation.clone(), interleave: point.interleave };
        let frame = VslFrame { scene_hash: self.scene.hash, ..frame };
        let drawn = device.draw(&self.scene, &frame, &self.options(point), &way, watch)?;
        let runs = drawn.frames_ms.len();
        let times = Times { place_ms, light_ms: median(light), picture_ms: median(drawn.frames_ms) };
        Ok(Shot { film: drawn.film, times, runs, vsls_placed: Some(frame.vsls.len()) })
    }
}

/// The middle one; of an even number the slower of both.
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
