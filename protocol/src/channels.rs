//! Turns the runtime folder into a list of channels, and removes from it what crashed simulators left.

use std::path::PathBuf;
use std::time::Duration;

use rustix::shm;

use crate::claim::{Claim, holder, journal};
use crate::error::ProtocolError;
use crate::layout::{state, word};
use crate::process::{Identity, monotonic_ns};
use crate::reader_segment::{AccessMode, ReaderSegment};
use crate::runtime::{ChannelDir, ChannelName, Runtime};

/// What is known of one channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelStatus {
    /// The channel.
    pub name: ChannelName,
    /// Process that holds or last held it.
    pub pid: Option<u32>,
    /// Whether that process runs.
    pub alive: bool,
    /// Whether its simulation is paused.
    pub paused: bool,
    /// Number of the segment.
    pub epoch: Option<u64>,
    /// Newest complete frame, 0 before the first.
    pub frame: Option<u64>,
    /// Age of the last sign of life.
    pub age: Option<Duration>,
    /// Bytes of the segment.
    pub segment_bytes: Option<u64>,
    /// Why the segment cannot be read, if there should be one.
    pub problem: Option<String>,
}

/// What was removed of one channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cleaned {
    /// The channel; `None` for segments whose runtime folder is gone.
    pub channel: Option<ChannelName>,
    /// Names of the removed shared-memory objects.
    pub segments: Vec<String>,
    /// Folder that was removed.
    pub folder: Option<PathBuf>,
}

/// Lists the channels of the environment's runtime folder: what runs, and what a crash left.
///
/// # Errors
/// `Io` or `Insecure` where the runtime folder cannot be trusted; a single bad channel is a `problem` of its entry.
pub fn channels() -> Result<Vec<ChannelStatus>, ProtocolError> {
    channels_in(&Runtime::from_env())
}

/// The same, in a runtime folder of the caller's choice.
///
/// # Errors
/// As `channels`.
pub fn channels_in(runtime: &Runtime) -> Result<Vec<ChannelStatus>, ProtocolError> {
    Ok(runtime.channel_names()?.into_iter().filter_map(|name| status(runtime, name)).collect())
}

/// The state of one channel; `None` where nothing runs and nothing was left.
fn status(runtime: &Runtime, name: ChannelName) -> Option<ChannelStatus> {
    let mut status = ChannelStatus {
        name,
        pid: None,
        alive: false,
        paused: false,
        epoch: None,
        frame: None,
        age: None,
        segment_bytes: None,
        problem: None,
    };
    if let Err(error) = inspect(runtime, &mut status) {
        status.problem = Some(error.to_string());
    }
    (status.alive || status.epoch.is_some() || status.problem.is_some()).then_some(status)
}

fn inspect(runtime: &Runtime, status: &mut ChannelStatus) -> Result<(), ProtocolError> {
    let dir = runtime.open_channel(&status.name)?;
    if let Some(holder) = holder(&dir) {
        status.pid = Some(holder.pid);
        status.alive = holder.identity().is_alive();
    }
    if dir.read_small("current")?.is_none() {
        if !status.alive && !journal(&dir)?.is_empty() {
            status.problem =
                Some("a simulator crashed while it started; `photonstream clean` removes its rest".into());
        }
        // A process that held the channel and closed it has let it go, even if it runs on.
        status.alive = status.alive && !journal(&dir)?.is_empty();
        return Ok(());
    }
    let current = dir.current()?;
    status.pid = Some(current.pid);
    status.alive = Identity { pid: current.pid, start_time: current.start_time }.is_alive();
    status.epoch = Some(current.epoch);
    status.segment_bytes = Some(current.bytes);
    let segment = ReaderSegment::open(&dir, &current, AccessMode::Strict)?;
    status.frame = Some(segment.load(word::LATEST)?);
    status.age = Some(Duration::from_nanos(monotonic_ns().saturating_sub(segment.load(word::HEARTBEAT)?)));
    status.paused = status.alive && segment.load(word::PAUSED)? == 1;
    status.alive &= segment.load(word::STATE)? != state::CLOSED;
    Ok(())
}

/// Removes what crashed simulators left, in the environment's runtime folder and in shared memory; never a live channel.
///
/// # Errors
/// `Io` or `Insecure`; what was removed before stays removed.
pub fn clean() -> Result<Vec<Cleaned>, ProtocolError> {
    let mut cleaned = clean_in(&Runtime::from_env())?;
    let segments = remove_orphans();
    if !segments.is_empty() {
        cleaned.push(Cleaned { channel: None, segments, folder: None });
    }
    Ok(cleaned)
}

/// The same in a runtime folder of the caller's choice, and nowhere else.
///
/// # Errors
/// As `clean`.
pub fn clean_in(runtime: &Runtime) -> Result<Vec<Cleaned>, ProtocolError> {
    let mut cleaned = Vec::new();
    for name in runtime.channel_names()? {
        match runtime.open_channel(&name).and_then(clean_channel) {
            Ok(found) => cleaned.push(found),
            Err(ProtocolError::ChannelBusy { .. } | ProtocolError::NotCreated { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(cleaned)
}

/// Removes what is left of one channel of the environment's runtime folder.
///
/// # Errors
/// `ChannelBusy` for a live channel, `NotCreated` where there is none, `Io`, `Insecure`.
pub fn clean_one(channel: &ChannelName) -> Result<Cleaned, ProtocolError> {
    clean_channel(Runtime::from_env().open_channel(channel)?)
}

fn clean_channel(dir: ChannelDir) -> Result<Cleaned, ProtocolError> {
    let claim = Claim::take(dir)?;
    let segments = claim.recover()?;
    // While the lock is held: who opened the old file notices that it is no longer the one in the folder.
    claim.dir.remove("lock")?;
    let folder = std::fs::remove_dir(&claim.dir.path).is_ok().then(|| claim.dir.path.clone());
    Ok(Cleaned { channel: Some(claim.dir.channel.clone()), segments, folder })
}

/// Removes segments of ours whose writer is gone and whose folder nobody can find any more (Linux).
fn remove_orphans() -> Vec<String> {
    let Ok(entries) = std::fs::read_dir("/dev/shm") else { return Vec::new() };
    entries
        .filter_map(|entry| Some(format!("/{}", entry.ok()?.file_name().to_str()?)))
        .filter(|name| ReaderSegment::is_orphan(name) && shm::unlink(name).is_ok())
        .collect()
}
