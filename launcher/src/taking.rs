//! Turns the frames of a channel into a recording, until there are enough or it is told to stop.

use crate::error::LauncherError;
use photonstream_protocol::{AccessMode, ChannelName, Liveness, ProtocolError, Reading, Subscriber};
use photonstream_recording::Recorder;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// Longest sleep before it is looked whether to stop.
const LOOK: Duration = Duration::from_millis(20);
/// Time between two looks for a channel: its first frames are not to be missed.
const LOOK_FOR_CHANNEL: Duration = Duration::from_millis(1);

/// What a recording is to hold at most.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Limits {
    pub(crate) frames: Option<u64>,
    pub(crate) time: Option<Duration>,
}

/// What was recorded.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Taken {
    pub(crate) file: PathBuf,
    pub(crate) frames: u64,
    /// Frames that were published and gone before they could be read, since the first one recorded or wanted.
    pub(crate) skipped_frames: u64,
    pub(crate) bytes: u64,
    pub(crate) seconds: f64,
}

/// Where a recording begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beginning {
    /// With the first frame that was published: others before the first one read are skipped ones.
    First,
    /// With the frame that is there.
    Present,
}

/// Records until a limit, the end of the channel, or `stop`; a simulator that is started again is followed.
///
/// # Errors
/// A file that cannot grow; a channel that cannot be read.
pub(crate) fn take(
    file: &Path,
    mut recorder: Recorder,
    subscriber: &mut Subscriber,
    beginning: Beginning,
    limits: Limits,
    stop: &AtomicBool,
) -> Result<Taken, LauncherError> {
    let begun = Instant::now();
    let mut last = (beginning == Beginning::First).then_some(0);
    let (mut publisher, mut skipped_frames) = (subscriber.publisher_pid(), 0);
    loop {
        // Asked before reading: what was published before the end is then read.
        let is_over = stop.load(Ordering::Relaxed) || subscriber.liveness() == Liveness::Retired;
        let reading = subscriber.read()?;
        let is_new = reading == Reading::New || (last.is_none() && subscriber.frame().is_some());
        if let (true, Some(frame)) = (is_new, subscriber.frame()) {
            recorder.write(frame)?;
            if std::mem::replace(&mut publisher, subscriber.publisher_pid()) != publisher {
                // A simulator that is started again counts from 1.
                last = Some(0);
            }
            skipped_frames += last.map_or(0, |last| frame.frame.saturating_sub(last + 1));
            last = Some(frame.frame);
        }
        let is_full = limits.frames.is_some_and(|frames| recorder.frames() >= frames)
            || limits.time.is_some_and(|time| begun.elapsed() >= time);
        // A frame that is not read yet, though it is there, is read first.
        if is_full || (is_over && reading != Reading::Busy) {
            break;
        }
        subscriber.wait(limits.time.map_or(LOOK, |time| LOOK.min(time.saturating_sub(begun.elapsed()))));
    }
    let frames = recorder.frames();
    recorder.finish()?;
    let bytes = std::fs::metadata(file).map_err(|e| LauncherError::io("look at", file, e))?.len();
    Ok(Taken { file: file.to_owned(), frames, skipped_frames, bytes, seconds: begun.elapsed().as_secs_f64() })
}

/// A recording that is made beside other work, from the channel's first frame.
pub(crate) struct Background {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<Option<Taken>, LauncherError>>,
}

impl Background {
    /// Starts to record, also before there is a channel.
    ///
    /// # Errors
    /// A file that cannot be made.
    pub(crate) fn start(file: &Path, channel: &ChannelName) -> Result<Self, LauncherError> {
        let recorder = Recorder::create(file)?;
        let stop = Arc::new(AtomicBool::new(false));
        let (file, channel, flag) = (file.to_owned(), channel.clone(), Arc::clone(&stop));
        let record = move || {
            let Some(mut subscriber) = attach(&channel, &flag)? else { return Ok(None) };
            take(&file, recorder, &mut subscriber, Beginning::First, Limits::default(), &flag).map(Some)
        };
        let thread = std::thread::Builder::new().name("recording".into()).spawn(record);
        let thread = thread.map_err(|e| LauncherError::io("start the thread of", "the recording", e))?;
        Ok(Self { stop, thread })
    }

    /// Takes the last frame and ends; `None` where there never was a channel.
    ///
    /// # Errors
    /// Whatever ended the recording before.
    pub(crate) fn finish(self) -> Result<Option<Taken>, LauncherError> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().expect("invariant: nothing in the recording's thread panics")
    }
}

/// Attaches once a publisher lives there: what a crash has left on the channel is not of this run.
fn attach(channel: &ChannelName, stop: &AtomicBool) -> Result<Option<Subscriber>, LauncherError> {
    loop {
        match Subscriber::attach(channel, AccessMode::Mapped) {
            Ok(subscriber) => {
                if !matches!(subscriber.liveness(), Liveness::Gone { .. } | Liveness::Retired) {
                    return Ok(Some(subscriber));
                }
            }
            Err(ProtocolError::NotCreated { .. } | ProtocolError::NotInitialised { .. }) => {}
            Err(error) => return Err(error.into()),
        }
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        std::thread::sleep(LOOK_FOR_CHANNEL);
    }
}
