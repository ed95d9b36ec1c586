//! Turns the times that a frame carries into how long an edit takes until it is seen.

use photonstream_protocol::VslFrame;

/// How long the last edit took.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Latency {
    edit_received_ns: u64,
    /// From the edit's arrival at the simulator to the first frame with its light, in ms.
    pub(crate) published_ms: f64,
    /// From then until the window had handed the picture to the display, in ms.
    pub(crate) shown_ms: f64,
}

impl Latency {
    /// Takes note of a frame that has just been shown, at `now_ns` of the clock that the frame uses.
    pub(crate) fn shown(&mut self, frame: &VslFrame, now_ns: u64) {
        let statistics = &frame.statistics;
        let received = statistics.edit_received_ns;
        // Frames go on to carry the last edit: the first one counts.
        if received == 0 || received == self.edit_received_ns || statistics.published_ns < received {
            return;
        }
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-6;
        *self = Self {
            edit_received_ns: received,
            published_ms: ms(received, statistics.published_ns),
            shown_ms: ms(statistics.published_ns, now_ns),
        };
    }

    /// Whether there has been an edit.
    pub(crate) fn is_known(&self) -> bool {
        self.edit_received_ns != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_frame_with_an_edit_counts() {
        let mut frame = VslFrame::default();
        let mut latency = Latency::default();
        latency.shown(&frame, 5);
        assert!(!latency.is_known());
        frame.statistics.edit_received_ns = 1_000_000;
        frame.statistics.published_ns = 4_000_000;
        latency.shown(&frame, 10_000_000);
        assert_eq!((latency.published_ms, latency.shown_ms), (3.0, 6.0));
        frame.statistics.published_ns = 9_000_000;
        latency.shown(&frame, 20_000_000);
        assert_eq!((latency.published_ms, latency.shown_ms), (3.0, 6.0));
        assert!(latency.is_known());
    }
}
