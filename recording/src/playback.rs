//! Turns recorded frames into published ones, for any renderer.

use photonstream_protocol::{
    ChannelName, FrameSource, NOTICE_CAPACITY, ProtocolError, Publisher, Runtime, SegmentSpec,
    StatisticsRecord, VslFrame, monotonic_ns,
};

/// Publishes recorded frames on a channel. Numbers of frames and times of publication are new; everything else is as it
/// was recorded, times of changes as long before the publication as then.
#[derive(Debug)]
pub struct Playback {
    publisher: Publisher,
    /// Segment that the frame shown last was recorded from.
    epoch: u64,
}

impl Playback {
    /// Takes a channel for frames like `first`, which is not published yet.
    ///
    /// # Errors
    /// Those of [`Publisher::create`].
    pub fn start(channel: &ChannelName, first: &VslFrame) -> Result<Self, ProtocolError> {
        Self::start_in(&Runtime::from_env(), channel, first)
    }

    /// The same, in a runtime folder of the caller's choice.
    ///
    /// # Errors
    /// As `start`.
    pub fn start_in(
        runtime: &Runtime,
        channel: &ChannelName,
        first: &VslFrame,
    ) -> Result<Self, ProtocolError> {
        let publisher = Publisher::create_in(runtime, channel, &spec(first))?;
        Ok(Self { publisher, epoch: first.epoch })
    }

    /// Publishes a frame and returns its new number. Where the recorded simulator replaced its segment this one is
    /// replaced, too.
    ///
    /// # Errors
    /// Those of [`Publisher::publish`] and [`Publisher::replace_segment`].
    pub fn show(&mut self, frame: &VslFrame) -> Result<u64, ProtocolError> {
        let needed = spec(frame);
        let present = self.publisher.spec();
        let fits = needed.scene_hash == present.scene_hash
            && needed.vsl_capacity <= present.vsl_capacity
            && needed.distance_capacity <= present.distance_capacity
            && needed.object_capacity <= present.object_capacity
            && needed.light_capacity <= present.light_capacity
            && needed.scene_text_capacity <= present.scene_text_capacity
            && needed.notice_capacity <= present.notice_capacity;
        if frame.epoch != self.epoch || !fits {
            self.publisher.replace_segment(&needed)?;
            self.epoch = frame.epoch;
        }
        let now = monotonic_ns();
        // Zero stands for never.
        let then = |ns: u64| match ns {
            0 => 0,
            ns => now.saturating_add(ns).saturating_sub(frame.publish_time_ns),
        };
        let s = &frame.statistics;
        let (edit_received_ns, traced_ns) = (then(s.edit_received_ns), then(s.traced_ns));
        self.publisher.publish(&FrameSource {
            vsls: &frame.vsls,
            changed: None,
            patches: &frame.patches,
            patches_changed: None,
            distances: &frame.distances,
            distances_changed: None,
            objects: &frame.objects,
            lights: &frame.lights,
            statistics: &StatisticsRecord { edit_received_ns, traced_ns, ..*s },
            scene_text: &frame.scene_text,
            notice: &frame.notice,
            config_generation: frame.config_generation,
            simulation_time_s: frame.simulation_time_s,
        })
    }

    /// The publisher, for its control server and for pausing.
    pub fn publisher(&self) -> &Publisher {
        &self.publisher
    }
}

/// A segment in which `frame` fits.
fn spec(frame: &VslFrame) -> SegmentSpec {
    let capacity = |count: usize| u32::try_from(count.max(1)).unwrap_or(u32::MAX);
    SegmentSpec {
        vsl_capacity: capacity(frame.vsls.len().max(frame.patches.len())),
        distance_capacity: u32::try_from(frame.distances.len()).unwrap_or(u32::MAX),
        object_capacity: capacity(frame.objects.len()),
        light_capacity: capacity(frame.lights.len()),
        scene_text_capacity: capacity(frame.scene_text.len()),
        notice_capacity: capacity(frame.notice.len()).max(NOTICE_CAPACITY),
        scene_hash: frame.scene_hash,
        slots: 3,
    }
}
