//! Turns a recording into published frames: in time, at another speed, or step by step, as the control socket asks.

use crate::{error::LauncherError, span::Span};
use photonstream_protocol::{ControlServer, Incoming, Replier, Reply, Request};
use photonstream_recording::{Playback, Recording, RecordingError};
use serde_json::json;
use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

/// Longest sleep before it is looked whether to stop.
const LOOK: Duration = Duration::from_millis(50);
/// Least time between the beginnings of two rounds: one frame has no time of its own, nor have frames at once.
const ROUND: Duration = Duration::from_millis(20);

/// How a recording is played.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Manner {
    /// Times the recorded speed.
    pub(crate) speed: f64,
    /// From the first frame again after the last one.
    pub(crate) repeats: bool,
    /// The last frame stays until somebody asks for the end.
    pub(crate) holds: bool,
    /// Frames that are played.
    pub(crate) span: Span,
}

/// Why it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// All was shown.
    End,
    /// A signal.
    Stopped,
    /// A client of the control socket.
    Shutdown,
}

/// Plays one recording on one channel.
pub(crate) struct Player<'a> {
    pub(crate) file: &'a Path,
    pub(crate) manner: Manner,
    pub(crate) recording: Recording,
    pub(crate) playback: Playback,
    pub(crate) server: ControlServer,
    /// A message for each press of Enter.
    pub(crate) enter: flume::Receiver<()>,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) is_paused: bool,
    /// Frames that were shown, and how often the recording began again.
    pub(crate) shown: u64,
    /// Number of the frame in the recording that was shown last.
    pub(crate) at: u64,
    pub(crate) rounds: u64,
    /// What ended the recording before its end.
    pub(crate) damage: Option<RecordingError>,
}

/// What a pause between two frames ends with.
enum Next {
    Show(Option<Replier>),
    End(Ending),
}

impl Player<'_> {
    /// Plays from the frame that the recording gave last until the end.
    ///
    /// # Errors
    /// Frames that cannot be published.
    pub(crate) fn play(&mut self) -> Result<Ending, LauncherError> {
        self.playback.publisher().set_paused(self.is_paused);
        let mut due = Instant::now();
        let (mut round, mut begun) = (self.rounds, due);
        let mut time_ns = self.show(None)?;
        loop {
            let is_there = self.fetch();
            let recorded_ns = self.recording.frame().publish_time_ns;
            if is_there {
                // A frame of an earlier time is the first one of another round.
                let pause = Duration::from_nanos(recorded_ns.saturating_sub(time_ns)).as_secs_f64();
                due += Duration::try_from_secs_f64(pause / self.manner.speed).unwrap_or(FOREVER).min(FOREVER);
                if self.rounds != round {
                    due = due.max(begun + ROUND);
                    (round, begun) = (self.rounds, due.max(Instant::now()));
                }
            } else if !self.manner.holds {
                return Ok(Ending::End);
            }
            match self.wait(is_there, &mut due) {
                Next::End(ending) => return Ok(ending),
                Next::Show(replier) => time_ns = self.show(replier)?,
            }
        }
    }

    /// Publishes the frame that the recording gave last; the time at which it was recorded.
    fn show(&mut self, replier: Option<Replier>) -> Result<u64, LauncherError> {
        let frame = self.recording.frame();
        let number = self.playback.show(frame)?;
        self.shown += 1;
        self.at = self.recording.position() - 1;
        if let Some(replier) = replier {
            replier.reply(Reply::Ok { frame: number });
        }
        Ok(frame.publish_time_ns)
    }

    /// Gets the next frame, if there is one.
    fn fetch(&mut self) -> bool {
        for _ in 0..2 {
            let is_wanted = self.manner.span.last.is_none_or(|last| self.recording.position() <= last);
            match if is_wanted { self.recording.next_frame() } else { Ok(None) } {
                Ok(Some(_)) => return true,
                Ok(None) => {}
                Err(error) => {
                    if self.damage.is_none() {
                        tracing::warn!("{error}");
                    }
                    self.damage = Some(error);
                }
            }
            if !self.manner.repeats || self.recording.seek(self.manner.span.first).is_err() {
                return false;
            }
            self.rounds += 1;
        }
        false
    }

    /// Serves requests until it is time for the next frame, if there is one.
    fn wait(&mut self, is_there: bool, due: &mut Instant) -> Next {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Next::End(Ending::Stopped);
            }
            let left = due.saturating_duration_since(Instant::now());
            let plays = is_there && !self.is_paused;
            if plays && left.is_zero() {
                return Next::Show(None);
            }
            let patience = if plays { LOOK.min(left) } else { LOOK };
            let heard = flume::Selector::new()
                .recv(self.server.requests(), Result::ok)
                .recv(&self.enter, |_| None)
                .wait_timeout(patience);
            match heard {
                Err(_) => {}
                Ok(None) if is_there && self.is_paused => return Next::Show(None),
                Ok(None) => {}
                Ok(Some(Incoming { request: Request::Step, replier })) if is_there && self.is_paused => {
                    return Next::Show(Some(replier));
                }
                Ok(Some(Incoming { request, replier })) => {
                    let ends = request == Request::Shutdown;
                    let was_paused = self.is_paused;
                    replier.reply(self.answer(&request));
                    if ends {
                        return Next::End(Ending::Shutdown);
                    }
                    if was_paused && !self.is_paused {
                        *due = Instant::now();
                    }
                }
            }
        }
    }

    fn answer(&mut self, request: &Request) -> Reply {
        let publisher = self.playback.publisher();
        let ok = Reply::Ok { frame: publisher.frame() };
        match request {
            Request::Pause | Request::Resume => {
                self.is_paused = *request == Request::Pause;
                publisher.set_paused(self.is_paused);
                ok
            }
            Request::Step if self.is_paused => Reply::error("at-end", "the recording has no further frame"),
            Request::Step => Reply::error("not-paused", "pause the replay before stepping through it"),
            Request::Shutdown => ok,
            Request::Query => Reply::State {
                state: json!({
                    "replay": self.file,
                    "paused": self.is_paused,
                    "recorded_frame": self.at,
                    "shown": self.shown,
                    "speed": self.manner.speed,
                }),
            },
            _ => Reply::error(
                "replay",
                format!(
                    "this is a replay of {}: its light is recorded and follows no edit; simulate the scene instead",
                    self.file.display()
                ),
            ),
        }
    }
}

/// Beyond any recording, and within what clocks can add.
const FOREVER: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
