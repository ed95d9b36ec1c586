//! Turns a channel into the newest whole frame, whatever happens to the simulator behind it.

use std::time::{Duration, Instant};

use crate::chunks::ChunkSet;
use crate::error::ProtocolError;
use crate::frame::{FramePair, VslFrame};
use crate::layout::{state, word};
use crate::local_socket::{Lifeline, SOCKET};
use crate::mapped_segment::MappedSegment;
use crate::process::monotonic_ns;
use crate::reader_segment::{AccessMode, ReaderSegment, Words};
use crate::ring_read::{Head, Outcome, RingReader};
use crate::runtime::{ChannelDir, ChannelName, Runtime};
use crate::shape::HEAD_WORDS;

/// Time one `read` may take before it reports `Busy`.
const READ_LIMIT: Duration = Duration::from_millis(2);
/// Chunks copied between two looks at the clock (a few microseconds).
const CHUNKS_PER_LOOK: u32 = 16;
/// Age of a heartbeat from which the simulator is no longer taken to run.
const STALE_AFTER: Duration = Duration::from_millis(500);
/// Time between two looks for a successor, once the segment is over.
const LOOK_AGAIN: Duration = Duration::from_millis(10);
/// Longest sleep within `wait` before the control socket and the heartbeat are looked at.
const SLICE: Duration = Duration::from_millis(4);

/// Time between two attempts to reach the control socket.
const RECONNECT: Duration = Duration::from_millis(500);

/// How one `read` ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// `frame` is a newer one.
    New,
    /// `frame` is still the newest.
    Unchanged,
    /// The newest frame could not be completed in time; `frame` is the last one, the next call goes on.
    Busy,
    /// Nothing has been published since the segment was made; `frame` is the last one, if any.
    Empty,
}

/// What is known of the simulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Liveness {
    /// It runs.
    Live,
    /// It runs, and its simulation is paused.
    Paused,
    /// Its process exists and has not given a sign of life for `age` (stopped, or starved).
    Stalled {
        /// Age of the last sign of life.
        age: Duration,
    },
    /// It ended without closing the channel.
    Gone {
        /// How this is known.
        reason: String,
    },
    /// It closed the channel in order.
    Retired,
}

/// Why `wait` returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// A frame that has not been read is there.
    NewFrame,
    /// `liveness` differs from what it was at the last return, or another segment is followed.
    StateChanged,
    /// The time is over.
    TimedOut,
}

/// A reader of a channel; it writes nothing that anyone else could see.
pub struct Subscriber {
    dir: ChannelDir,
    mode: AccessMode,
    segment: ReaderSegment,
    reader: RingReader,
    frames: FramePair,
    changed: ChunkSet,
    head: Head,
    lifeline: Lifeline,
    last_look: Instant,
    last_connect: Instant,
    last_state: u8,
}

impl std::fmt::Debug for Subscriber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (channel, segment) = (&self.dir.channel, &self.segment.name);
        f.debug_struct("Subscriber")
            .field("channel", channel)
            .field("segment", segment)
            .finish_non_exhaustive()
    }
}

impl Subscriber {
    /// Attaches to a channel of the environment's runtime folder; also to a simulator that has died, whose last frame is
    /// still there.
    ///
    /// # Errors
    /// `NotCreated`, `NotInitialised`, `VersionMismatch`, `LayoutMismatch`, `EndianMismatch`, `Corrupt`, `Insecure`, `Io`.
    pub fn attach(channel: &ChannelName, mode: AccessMode) -> Result<Self, ProtocolError> {
        Self::attach_in(&Runtime::from_env(), channel, mode)
    }

    /// The same, in a runtime folder of the caller's choice.
    ///
    /// # Errors
    /// As `attach`.
    pub fn attach_in(
        runtime: &Runtime,
        channel: &ChannelName,
        mode: AccessMode,
    ) -> Result<Self, ProtocolError> {
        let dir = runtime.open_channel(channel)?;
        let segment = open_current(&dir, mode)?;
        Ok(Self {
            reader: RingReader::new(segment.layout.shape.clone()),
            lifeline: Lifeline::connect(&dir.file(SOCKET)),
            dir,
            mode,
            segment,
            frames: FramePair::default(),
            changed: ChunkSet::default(),
            head: [0; HEAD_WORDS],
            last_look: Instant::now(),
            last_connect: Instant::now(),
            last_state: 0,
        })
    }

    /// Attaches as soon as the channel is there.
    ///
    /// # Errors
    /// `TimedOut`, `Cancelled`, and those of `attach` that waiting does not cure.
    pub fn attach_wait(
        channel: &ChannelName,
        mode: AccessMode,
        timeout: Duration,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Self, ProtocolError> {
        Self::attach_wait_in(&Runtime::from_env(), channel, mode, timeout, cancelled)
    }

    /// The same, in a runtime folder of the caller's choice.
    ///
    /// # Errors
    /// As `attach_wait`.
    pub fn attach_wait_in(
        runtime: &Runtime,
        channel: &ChannelName,
        mode: AccessMode,
        timeout: Duration,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Self, ProtocolError> {
        let start = Instant::now();
        loop {
            match Self::attach_in(runtime, channel, mode) {
                Err(error) if is_transient(&error) => {}
                result => return result,
            }
            let what = format!("channel '{channel}'");
            if cancelled() {
                return Err(ProtocolError::Cancelled { what });
            }
            if start.elapsed() >= timeout {
                return Err(ProtocolError::TimedOut { what, milliseconds: timeout.as_millis() });
            }
            std::thread::sleep(Duration::from_millis(5).min(timeout.saturating_sub(start.elapsed())));
        }
    }

    /// Takes the newest frame, within about 2 ms; follows a replaced segment or a restarted simulator by itself.
    ///
    /// # Errors
    /// `Corrupt` for bytes that no publisher writes, `VersionMismatch` and the like when a restarted simulator is of
    /// another release. The last frame stays available, and a later call tries again.
    pub fn read(&mut self) -> Result<Reading, ProtocolError> {
        let outcome = self.read_segment();
        if matches!(outcome, Ok(Outcome::New)) || !self.follow()? {
            return outcome.map(reading);
        }
        self.read_segment().map(reading)
    }

    fn read_segment(&mut self) -> Result<Outcome, ProtocolError> {
        // Started by the first look: a reader that polls does not look at the clock for nothing.
        let mut start = None;
        let mut copied = 0u32;
        let mut spent = || {
            copied += 1;
            copied.is_multiple_of(CHUNKS_PER_LOOK)
                && start.get_or_insert_with(Instant::now).elapsed() >= READ_LIMIT
        };
        let before = self.reader.seen();
        let outcome = match self.segment.words() {
            Words::Mapped(words) => self.reader.read(words, &mut self.frames, &mut self.head, &mut spent),
            Words::Strict(words) => self.reader.read(words, &mut self.frames, &mut self.head, &mut spent),
        }?;
        if outcome == Outcome::New {
            let layout = &self.segment.layout;
            let finished = self.frames.finish(&self.head, layout.epoch, layout.scene_hash, &mut self.changed);
            finished.inspect_err(|_| self.reader.set_seen(before))?;
        }
        Ok(outcome)
    }

    /// The last complete frame; `None` before the first.
    pub fn frame(&self) -> Option<&VslFrame> {
        self.frames.frame()
    }

    /// Chunks of lights that the last `New` changed; all of them after another segment was followed.
    pub fn changed_chunks(&self) -> &ChunkSet {
        &self.changed
    }

    /// What is known of the simulator now.
    pub fn liveness(&self) -> Liveness {
        let load = |at| self.segment.load(at).unwrap_or(0);
        if load(word::STATE) == state::CLOSED {
            return Liveness::Retired;
        }
        let writer = self.segment.layout.writer;
        let age = Duration::from_nanos(monotonic_ns().saturating_sub(load(word::HEARTBEAT)));
        if self.lifeline.is_cut() && !writer.is_alive() {
            let reason = format!("process {} closed its control socket and ended", writer.pid);
            return Liveness::Gone { reason };
        }
        if age < STALE_AFTER {
            return if load(word::PAUSED) == 1 { Liveness::Paused } else { Liveness::Live };
        }
        if writer.is_alive() {
            return Liveness::Stalled { age };
        }
        Liveness::Gone {
            reason: format!("process {} ended; last heartbeat {} ms ago", writer.pid, age.as_millis()),
        }
    }

    /// Sleeps until there is a frame to read or news of the simulator, at most `timeout`.
    pub fn wait(&mut self, timeout: Duration) -> Wake {
        let start = Instant::now();
        loop {
            let seen = self.segment.wake_count();
            if self.has_new() {
                return Wake::NewFrame;
            }
            // An error of a successor is reported by the next `read`.
            let followed = self.follow().unwrap_or(false);
            let state = self.liveness().ordinal();
            if std::mem::replace(&mut self.last_state, state) != state || followed {
                return if self.has_new() { Wake::NewFrame } else { Wake::StateChanged };
            }
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Wake::TimedOut;
            }
            self.segment.sleep(seen, left.min(SLICE));
        }
    }

    /// The channel.
    pub fn channel(&self) -> &ChannelName {
        &self.dir.channel
    }

    /// Number of the segment that is attached.
    pub fn epoch(&self) -> u64 {
        self.segment.layout.epoch
    }

    /// Process of the publisher.
    pub fn publisher_pid(&self) -> u32 {
        self.segment.layout.writer.pid
    }

    /// Bytes of the attached segment.
    pub fn segment_bytes(&self) -> u64 {
        self.segment.layout.bytes
    }

    /// The map of the attached segment, for devices that copy from it by themselves; `None` with
    /// [`AccessMode::Strict`]. Another one is followed by `read` and `wait`: compare the epochs.
    pub fn mapped(&self) -> Option<MappedSegment> {
        self.segment.mapped()
    }

    fn has_new(&self) -> bool {
        let new = match self.segment.words() {
            Words::Mapped(words) => self.reader.has_new(words),
            Words::Strict(words) => self.reader.has_new(words),
        };
        new.unwrap_or(false)
    }

    /// Attaches to the segment that took this one's place, if there is one; looks only when this one seems over.
    fn follow(&mut self) -> Result<bool, ProtocolError> {
        if self.last_look.elapsed() < LOOK_AGAIN {
            return Ok(false);
        }
        self.last_look = Instant::now();
        self.keep_lifeline();
        if !self.seems_over() {
            return Ok(false);
        }
        let next = match self.dir.current() {
            Ok(current) if current.segment == self.segment.name => return Ok(false),
            Ok(current) => ReaderSegment::open(&self.dir, &current, self.mode),
            Err(error) => Err(error),
        };
        match next {
            Ok(next) => {
                self.reader = RingReader::new(next.layout.shape.clone());
                self.segment = next;
                self.frames.forget_versions();
                self.lifeline = Lifeline::connect(&self.dir.file(SOCKET));
                Ok(true)
            }
            Err(error) if is_transient(&error) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Connects to a control socket that appeared after this reader, or that had turned it away.
    fn keep_lifeline(&mut self) {
        let useless = !self.lifeline.is_connected() || self.lifeline.is_cut();
        if useless && self.last_connect.elapsed() >= RECONNECT {
            self.last_connect = Instant::now();
            self.lifeline = Lifeline::connect(&self.dir.file(SOCKET));
        }
    }

    fn seems_over(&self) -> bool {
        let load = |at| self.segment.load(at).unwrap_or(0);
        load(word::STATE) != state::LIVE
            || monotonic_ns().saturating_sub(load(word::HEARTBEAT)) > STALE_AFTER.as_nanos() as u64
            || self.lifeline.is_cut()
    }
}

impl Liveness {
    fn ordinal(&self) -> u8 {
        match self {
            Self::Live => 0,
            Self::Paused => 1,
            Self::Stalled { .. } => 2,
            Self::Gone { .. } => 3,
            Self::Retired => 4,
        }
    }
}

fn reading(outcome: Outcome) -> Reading {
    match outcome {
        Outcome::New => Reading::New,
        Outcome::Unchanged => Reading::Unchanged,
        Outcome::Busy => Reading::Busy,
        Outcome::Empty => Reading::Empty,
    }
}

/// Whether an error is that of a simulator which is starting or ending.
fn is_transient(error: &ProtocolError) -> bool {
    matches!(error, ProtocolError::NotCreated { .. } | ProtocolError::NotInitialised { .. })
}

/// Opens what `current` names; a second look tells a replaced segment from a missing one.
fn open_current(dir: &ChannelDir, mode: AccessMode) -> Result<ReaderSegment, ProtocolError> {
    let mut current = dir.current()?;
    loop {
        match ReaderSegment::open(dir, &current, mode) {
            Err(error @ ProtocolError::NotCreated { .. }) => {
                let again = dir.current()?;
                if again == current {
                    return Err(error);
                }
                current = again;
            }
            result => return result,
        }
    }
}
