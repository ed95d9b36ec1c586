//! Turns the simulator's frames into bytes that any number of readers can take at any moment.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::chunks::ChunkSet;
use crate::claim::{Claim, new_segment_name};
use crate::error::ProtocolError;
use crate::heartbeat::Heartbeat;
use crate::layout::{ABI_MAJOR, Layout, SegmentSpec, state};
use crate::process::{Identity, monotonic_ns};
use crate::record::{DistanceRecord, LightRecord, ObjectRecord, PatchRecord, StatisticsRecord, VslRecord};
use crate::ring_write::{ArraySource, Changed, FrameHead, RingWriter};
use crate::runtime::{ChannelDir, ChannelName, Current, Runtime};
use crate::text::{PublishedText, fitted};
use crate::writer_segment::WriterSegment;

/// Content of one frame, borrowed from the simulator.
#[derive(Debug, Clone, Copy)]
pub struct FrameSource<'a> {
    /// Virtual surface lights; `changed_frame` is filled in by the publisher.
    pub vsls: &'a [VslRecord],
    /// Chunks of `vsls` that differ from the frame published last, where the caller knows; `None` makes the publisher
    /// compare. A changed chunk that is missing here stays unseen by readers.
    pub changed: Option<&'a ChunkSet>,
    /// Patches of `vsls`: one for each, or none at all.
    pub patches: &'a [PatchRecord],
    /// Chunks of `patches` that differ from the frame published last, as `changed` says it of `vsls`.
    pub patches_changed: Option<&'a ChunkSet>,
    /// Pieces of the distance maps of `vsls`: as many for each light, or none at all.
    pub distances: &'a [DistanceRecord],
    /// Chunks of `distances` that differ from the frame published last, as `changed` says it of `vsls`.
    pub distances_changed: Option<&'a ChunkSet>,
    /// Objects.
    pub objects: &'a [ObjectRecord],
    /// Lights.
    pub lights: &'a [LightRecord],
    /// Counters; `published_ns` is filled in by the publisher.
    pub statistics: &'a StatisticsRecord,
    /// The resolved scene, from which a renderer parses exactly what the simulator runs.
    pub scene_text: &'a str,
    /// What is wrong with the simulation (an edited config that was refused, for one), empty while nothing is; cut to the
    /// segment's capacity.
    pub notice: &'a str,
    /// Counts the configurations that were loaded.
    pub config_generation: u64,
    /// Time of the simulated scene, in s.
    pub simulation_time_s: f64,
}

/// The single writer of a channel.
pub struct Publisher {
    claim: Claim,
    spec: SegmentSpec,
    segment: Arc<WriterSegment>,
    writer: RingWriter,
    heartbeat: Heartbeat,
    frame: Arc<AtomicU64>,
    text: PublishedText,
    notice: PublishedText,
    process: u32,
    abandoned: bool,
    keeps_names: bool,
}

impl std::fmt::Debug for Publisher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (channel, segment) = (&self.claim.dir.channel, &self.segment.name);
        f.debug_struct("Publisher")
            .field("channel", channel)
            .field("segment", segment)
            .finish_non_exhaustive()
    }
}

impl Publisher {
    /// Takes a channel of the environment's runtime folder, removing what a crashed predecessor left.
    ///
    /// # Errors
    /// `ChannelBusy` while another publisher lives, `NoSpace` where shared memory is full, `InvalidSpec`, `Insecure`,
    /// `Io`.
    pub fn create(channel: &ChannelName, spec: &SegmentSpec) -> Result<Self, ProtocolError> {
        Self::create_in(&Runtime::from_env(), channel, spec)
    }

    /// The same, in a runtime folder of the caller's choice.
    ///
    /// # Errors
    /// As `create`.
    pub fn create_in(
        runtime: &Runtime,
        channel: &ChannelName,
        spec: &SegmentSpec,
    ) -> Result<Self, ProtocolError> {
        let mut claim = take(runtime, channel)?;
        claim.recover()?;
        let segment = match new_segment(&mut claim, spec, None) {
            Ok(segment) => Arc::new(segment),
            Err(error) => {
                claim.recover()?;
                return Err(error);
            }
        };
        let heartbeat = Heartbeat::start(Arc::clone(&segment), claim.dir.clone())?;
        Ok(Self {
            writer: RingWriter::new(segment.layout.shape.clone(), 0),
            claim,
            spec: spec.clone(),
            segment,
            heartbeat,
            frame: Arc::new(AtomicU64::new(0)),
            text: PublishedText::default(),
            notice: PublishedText::default(),
            process: std::process::id(),
            abandoned: false,
            keeps_names: false,
        })
    }

    /// Replaces the segment by a new one (another size, another scene); readers follow by themselves.
    ///
    /// Frame numbers continue. Readers keep the last frame until the first one of the new segment.
    ///
    /// # Errors
    /// As `create`; the old segment stays in use then.
    pub fn replace_segment(&mut self, spec: &SegmentSpec) -> Result<(), ProtocolError> {
        let old = Arc::clone(&self.segment);
        let new = match new_segment(&mut self.claim, spec, Some(&old)) {
            Ok(segment) => Arc::new(segment),
            Err(error) => {
                self.claim.write_journal(&[&old.name])?;
                return Err(error);
            }
        };
        self.writer = RingWriter::new(new.layout.shape.clone(), self.writer.frame());
        self.heartbeat.follow(Arc::clone(&new));
        self.spec = spec.clone();
        self.segment = new;
        old.end(state::RETIRED);
        old.unlink();
        self.claim.write_journal(&[&self.segment.name])
    }

    /// Publishes a frame and returns its number; never waits for a reader.
    ///
    /// # Errors
    /// `NonFinite` for NaN or an infinity in a changed record and `TooMany` for more than the segment holds: nothing is
    /// published then, and the next call publishes everything that it lacks.
    pub fn publish(&mut self, frame: &FrameSource<'_>) -> Result<u64, ProtocolError> {
        if !frame.simulation_time_s.is_finite() {
            let value = frame.simulation_time_s;
            return Err(ProtocolError::NonFinite {
                record: "frame",
                index: 0,
                field: "simulation_time_s",
                value,
            });
        }
        let capacity = self.spec.scene_text_capacity as usize;
        if frame.scene_text.len() > capacity {
            return Err(ProtocolError::TooMany {
                field: "scene text bytes",
                found: frame.scene_text.len(),
                capacity,
            });
        }
        if self.heartbeat.name_is_lost() {
            self.regenerate()?;
        }
        self.text.set(frame.scene_text);
        self.notice.set(&fitted(frame.notice, self.spec.notice_capacity as usize));
        let now = monotonic_ns();
        let statistics = [StatisticsRecord { published_ns: now, ..*frame.statistics }];
        let array = |words, stamp, changed| ArraySource { words, changed, stamp };
        let sources = [
            array(
                bytemuck::cast_slice(frame.vsls),
                true,
                frame.changed.map_or(Changed::Compare, Changed::Chunks),
            ),
            array(bytemuck::cast_slice(frame.objects), false, Changed::Compare),
            array(bytemuck::cast_slice(frame.lights), false, Changed::Compare),
            array(bytemuck::cast_slice(&statistics), false, Changed::Compare),
            array(self.text.words(), false, Changed::Compare),
            array(self.notice.words(), false, Changed::Compare),
            array(
                bytemuck::cast_slice(frame.patches),
                false,
                frame.patches_changed.map_or(Changed::Compare, Changed::Chunks),
            ),
            array(
                bytemuck::cast_slice(frame.distances),
                false,
                frame.distances_changed.map_or(Changed::Compare, Changed::Chunks),
            ),
        ];
        let head = FrameHead {
            publish_time_ns: now,
            simulation_time_s: frame.simulation_time_s,
            config_generation: frame.config_generation,
            text_bytes: self.text.bytes(),
            notice_bytes: self.notice.bytes(),
        };
        let number = self.writer.publish(self.segment.words(), &head, &sources)?;
        self.frame.store(number, Ordering::Relaxed);
        self.segment.beat();
        self.segment.wake();
        Ok(number)
    }

    /// Tells readers whether the simulation is paused (a paused publisher keeps its heartbeat).
    pub fn set_paused(&self, paused: bool) {
        self.segment.set_paused(paused);
    }

    /// Number of the frame published last, 0 before the first.
    pub fn frame(&self) -> u64 {
        self.writer.frame()
    }

    /// Number of the segment among those of this channel.
    pub fn epoch(&self) -> u64 {
        self.segment.layout.epoch
    }

    /// The channel.
    pub fn channel(&self) -> &ChannelName {
        &self.claim.dir.channel
    }

    /// Capacities of the segment.
    pub fn spec(&self) -> &SegmentSpec {
        &self.spec
    }

    /// Bytes of the segment.
    pub fn segment_bytes(&self) -> u64 {
        self.segment.layout.bytes
    }

    /// Ends the channel: readers see `Retired` and keep the last frame. Dropping does the same, unless the thread panics:
    /// then the channel is abandoned.
    pub fn close(self) {}

    /// Ends the channel, and leaves its names: a reader that is still starting finds the last frame, and sees `Retired`.
    /// Whoever started this process removes them ([`crate::clean_one`]); so does the next publisher.
    pub fn close_findable(mut self) {
        self.keeps_names = true;
    }

    /// Leaves the channel as a crash would: readers see that the publisher is `Gone`, keep the last frame and wait for
    /// its successor, which removes what is left here.
    pub fn abandon(mut self) {
        self.abandoned = true;
    }

    /// Whether someone has removed the names by which new readers find the segment (a clean-up of temporary files, the
    /// end of a login session). The next [`Publisher::publish`] makes them anew.
    pub fn names_are_lost(&self) -> bool {
        self.heartbeat.name_is_lost()
    }

    /// The number of the frame published last, for the control server's replies.
    pub(crate) fn frame_counter(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.frame)
    }

    pub(crate) fn dir(&self) -> &ChannelDir {
        &self.claim.dir
    }

    /// Makes the channel findable again after someone removed its names.
    fn regenerate(&mut self) -> Result<(), ProtocolError> {
        if !self.claim.is_intact() {
            let dir = &self.claim.dir;
            let root = dir.path.parent().map_or_else(|| dir.path.clone(), std::path::Path::to_owned);
            self.claim = take(&Runtime::at(root), &dir.channel.clone())?;
        }
        self.replace_segment(&self.spec.clone())
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        // A forked child must not end its parent's channel.
        if self.process != std::process::id() || self.abandoned || std::thread::panicking() {
            return;
        }
        self.segment.end(state::CLOSED);
        if self.keeps_names {
            return;
        }
        let dir = &self.claim.dir;
        if dir.current().is_ok_and(|current| current.segment == self.segment.name) {
            // What cannot be removed now is removed by the next publisher or by `clean`.
            let _ = dir.remove("current");
        }
        self.segment.unlink();
        let _ = dir.remove("journal");
    }
}

/// Takes a channel; its folder may vanish between being made and being locked when someone cleans up.
fn take(runtime: &Runtime, channel: &ChannelName) -> Result<Claim, ProtocolError> {
    let mut attempts = 0;
    loop {
        match runtime.create_channel(channel).and_then(Claim::take) {
            Err(ProtocolError::Io { source, .. })
                if attempts < 10 && source.kind() == std::io::ErrorKind::NotFound =>
            {
                attempts += 1;
            }
            result => return result,
        }
    }
}

/// Creates the next segment of a channel and points readers to it.
fn new_segment(
    claim: &mut Claim,
    spec: &SegmentSpec,
    old: Option<&WriterSegment>,
) -> Result<WriterSegment, ProtocolError> {
    let writer = Identity::own();
    let layout = Layout::new(spec, claim.next_epoch()?, writer)?;
    let name = new_segment_name();
    let mut journal = vec![name.as_str()];
    journal.extend(old.map(|old| old.name.as_str()));
    claim.write_journal(&journal)?;
    let segment = WriterSegment::create(name, layout, old.is_some_and(WriterSegment::is_paused))?;
    let current = Current {
        abi: ABI_MAJOR,
        segment: segment.name.clone(),
        epoch: segment.layout.epoch,
        bytes: segment.layout.bytes,
        pid: writer.pid,
        start_time: writer.start_time,
    };
    let text = toml::to_string(&current).expect("invariant: integers and a name are TOML");
    claim.dir.replace_small("current", &text).inspect_err(|_| segment.unlink())?;
    Ok(segment)
}
