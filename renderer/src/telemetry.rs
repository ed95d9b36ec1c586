//! Turns frames into what people want to know of them: how old and how noisy the light is, and how long changes take.

use photonstream_protocol::{StatisticsRecord, VslFrame};

/// How old and how noisy a frame's light is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightAge {
    /// Mean over the lit virtual lights of the mean age of their photon paths, in s.
    pub mean_s: f64,
    /// The greatest of them, in s.
    pub greatest_s: f64,
    /// Standard error of the flux relative to it, mean over all virtual lights weighted by flux; 0 where it is unknown.
    pub relative_error: f64,
}

impl LightAge {
    /// Of the light of `frame`; the relative error is the simulator's, or that of the records where it gives none.
    pub fn of(frame: &VslFrame) -> Self {
        let (mut lit, mut sum_s, mut greatest_s, mut flux, mut error) = (0u32, 0.0, 0.0f64, 0.0, 0.0);
        for vsl in &frame.vsls {
            let mean_flux = vsl.flux.iter().map(|&f| f64::from(f)).sum::<f64>() / 3.0;
            if mean_flux > 0.0 {
                lit += 1;
                sum_s += f64::from(vsl.mean_age_s);
                greatest_s = greatest_s.max(vsl.mean_age_s.into());
                // Weighted by flux, the flux in the relative error cancels.
                flux += mean_flux;
                error += f64::from(vsl.standard_error);
            }
        }
        let share = |sum: f64, of: f64| if of > 0.0 { sum / of } else { 0.0 };
        let told = frame.statistics.relative_error;
        Self {
            mean_s: share(sum_s, lit.into()),
            greatest_s,
            relative_error: if told > 0.0 { told } else { share(error, flux) },
        }
    }
}

/// When the last change arrived, was traced and was published, as seen by somebody who reads the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChangeTimes {
    received_ns: u64,
    traced_ns: u64,
    published_ns: u64,
    settled_ns: u64,
    /// A frame has been seen.
    begun: bool,
    /// The change arrived before the first frame that was seen: when it was first published is not known.
    is_old: bool,
}

impl ChangeTimes {
    /// Takes note of a frame that has just been read.
    pub fn see(&mut self, frame: &VslFrame) {
        let StatisticsRecord { edit_received_ns, traced_ns, published_ns, stale_share, .. } =
            frame.statistics;
        if edit_received_ns != self.received_ns || !self.begun {
            *self = Self {
                received_ns: edit_received_ns,
                // Frames go on to carry the last change: the first one counts.
                published_ns,
                traced_ns: 0,
                settled_ns: 0,
                is_old: !self.begun,
                begun: true,
            };
        }
        if self.settled_ns == 0 && traced_ns >= edit_received_ns && stale_share == 0.0 {
            (self.traced_ns, self.settled_ns) = (traced_ns, published_ns);
        }
    }

    /// Whether there has been a change.
    pub fn is_known(&self) -> bool {
        self.received_ns != 0
    }

    /// From the arrival of the change until `now_ns`, in ms.
    pub fn ago_ms(&self, now_ns: u64) -> Option<f64> {
        self.is_known().then(|| ms(self.received_ns, now_ns))
    }

    /// From the arrival of the change until all its light was traced, in ms; `None` until then.
    pub fn traced_ms(&self) -> Option<f64> {
        (self.is_known() && self.traced_ns != 0).then(|| ms(self.received_ns, self.traced_ns))
    }

    /// From the arrival of the change until the first frame with it was published, in ms; `None` where that frame was
    /// not seen.
    pub fn published_ms(&self) -> Option<f64> {
        (self.is_known() && !self.is_old).then(|| ms(self.received_ns, self.published_ns))
    }

    /// From the arrival of the change until the first frame with all its light was published, in ms; `None` until then, or
    /// where that frame was not seen.
    pub fn settled_ms(&self) -> Option<f64> {
        (self.is_known() && !self.is_old && self.settled_ns != 0)
            .then(|| ms(self.received_ns, self.settled_ns))
    }
}

fn ms(from_ns: u64, to_ns: u64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_protocol::VslRecord;

    #[test]
    fn dark_lights_have_no_age_and_bright_ones_weigh_more() {
        let vsl = |flux: f32, standard_error: f32, mean_age_s: f32| VslRecord {
            flux: [flux, 0.0, 2.0 * flux],
            standard_error,
            mean_age_s,
            ..VslRecord::default()
        };
        let mut frame = VslFrame {
            vsls: vec![vsl(3.0, 0.3, 2.0), vsl(1.0, 0.5, 4.0), vsl(0.0, 9.0, 9.0)],
            ..VslFrame::default()
        };
        // (0.1 · 3 + 0.5 · 1) / (3 + 1)
        let age = LightAge::of(&frame);
        assert_eq!((age.mean_s, age.greatest_s), (3.0, 4.0));
        // Records are singles.
        assert!((age.relative_error - 0.2).abs() < 1e-7);
        frame.statistics.relative_error = 0.125;
        assert_eq!(LightAge::of(&frame).relative_error, 0.125);
        assert_eq!(LightAge::of(&VslFrame::default()), LightAge::default());
    }

    fn frame(received: u64, traced: u64, published: u64, stale_share: f64) -> VslFrame {
        let mut frame = VslFrame::default();
        let ms = |ms: u64| ms * 1_000_000;
        let statistics = &mut frame.statistics;
        (statistics.edit_received_ns, statistics.traced_ns) = (ms(received), ms(traced));
        (statistics.published_ns, statistics.stale_share) = (ms(published), stale_share);
        frame
    }

    #[test]
    fn the_first_frames_with_a_change_and_with_its_light_count() {
        let mut times = ChangeTimes::default();
        times.see(&frame(0, 0, 5, 0.0));
        assert!(!times.is_known() && times.ago_ms(9).is_none());
        let mut seen = Vec::new();
        for (traced, published, stale) in [(1, 12, 0.5), (13, 14, 0.2), (17, 20, 0.0), (17, 30, 0.0)] {
            times.see(&frame(10, traced, published, stale));
            seen.push((times.published_ms(), times.traced_ms(), times.settled_ms()));
        }
        let settled = (Some(2.0), Some(7.0), Some(10.0));
        assert_eq!(seen, [(Some(2.0), None, None), (Some(2.0), None, None), settled, settled]);
        assert_eq!(times.ago_ms(40_000_000), Some(30.0));
        // The next change needs no ray.
        times.see(&frame(50, 50, 53, 0.0));
        assert_eq!(
            (times.published_ms(), times.traced_ms(), times.settled_ms()),
            (Some(3.0), Some(0.0), Some(3.0))
        );
    }

    #[test]
    fn who_comes_late_does_not_know_when_a_change_was_published() {
        let mut times = ChangeTimes::default();
        times.see(&frame(10, 12, 500, 0.0));
        assert_eq!((times.published_ms(), times.traced_ms(), times.settled_ms()), (None, Some(2.0), None));
    }
}
