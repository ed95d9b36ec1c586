//! Turns a channel into the frame that was waited for, with a progress bar of the light on its way there.

use crate::{
    error::LauncherError,
    output::{grouped, si},
    progress::Share,
    supervise::{Kind, Supervisor},
};
use photonstream_protocol::{
    AccessMode, ChannelName, Liveness, ProtocolError, Reading, Subscriber, VslFrame,
};
use std::time::{Duration, Instant};

/// Time between two looks at the channel.
const LOOK: Duration = Duration::from_millis(4);

/// Attaches to a channel as it is now.
///
/// # Errors
/// Where there is no such channel, or it holds no frame yet.
pub(crate) fn present_frame(channel: &ChannelName) -> Result<Subscriber, LauncherError> {
    let mut subscriber = Subscriber::attach(channel, AccessMode::Mapped)?;
    // The first frame follows the creation of the channel within milliseconds.
    for _ in 0..500 {
        subscriber.read()?;
        if subscriber.frame().is_some() {
            return Ok(subscriber);
        }
        if matches!(subscriber.liveness(), Liveness::Gone { .. } | Liveness::Retired) {
            break;
        }
        subscriber.wait(LOOK);
    }
    let what = "its first frame";
    Err(LauncherError::SimulatorEnded { channel: channel.to_string(), what })
}

/// Follows the channel of a supervised simulator until its light has converged.
///
/// # Errors
/// Those of the simulator, if it fails for good; interruption.
pub(crate) fn converged_frame(
    supervisor: &mut Supervisor,
    channel: &ChannelName,
) -> Result<VslFrame, LauncherError> {
    let light = Light::start();
    let mut subscriber = None;
    loop {
        match poll(&mut subscriber, channel)? {
            Some(frame) => {
                light.show(frame);
                if frame.statistics.converged == 1 {
                    return Ok(frame.clone());
                }
            }
            None => light.prepare(),
        }
        if supervisor.is_over(Kind::Simulator) {
            let what = "its light had converged";
            return Err(LauncherError::SimulatorEnded { channel: channel.to_string(), what });
        }
        supervisor.attend(LOOK)?;
    }
}

/// The newest frame of a channel that may not be there yet, or be restarting.
pub(crate) fn poll<'a>(
    subscriber: &'a mut Option<Subscriber>,
    channel: &ChannelName,
) -> Result<Option<&'a VslFrame>, LauncherError> {
    if subscriber.is_none() {
        match Subscriber::attach(channel, AccessMode::Mapped) {
            Ok(attached) => *subscriber = Some(attached),
            Err(ProtocolError::NotCreated { .. } | ProtocolError::NotInitialised { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
    }
    let Some(subscriber) = subscriber else { return Ok(None) };
    let _: Reading = subscriber.read()?;
    Ok(subscriber.frame())
}

/// The progress of the light.
pub(crate) struct Light {
    bar: Share,
    begun: Instant,
}

impl Light {
    pub(crate) fn start() -> Self {
        Self { bar: Share::start("light"), begun: Instant::now() }
    }

    /// Before there is any: the scene is read, and lights are placed.
    pub(crate) fn prepare(&self) {
        self.bar.say(format!(
            "reading the scene and placing lights, {:.0} s",
            self.begun.elapsed().as_secs_f64()
        ));
    }

    pub(crate) fn show(&self, frame: &VslFrame) {
        let statistics = &frame.statistics;
        self.bar.set(statistics.pool_valid as f64 / statistics.pool_paths.max(1) as f64);
        self.bar.say(format!(
            "{} paths, {} VSLs, {}rays/s",
            grouped(statistics.paths_total),
            grouped(frame.vsls.len() as u64),
            si(statistics.rays_per_s),
        ));
    }
}
