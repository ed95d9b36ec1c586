//! Turns snapshots of the ledger into frames in shared memory.

use photonstream_protocol::{
    FrameSource, LightRecord, ObjectRecord, ProtocolError, Publisher, StatisticsRecord, VslRecord,
};
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

/// What the ledger wants published. The vectors come back to it, to be filled again.
pub(super) struct Snapshot {
    pub(super) vsls: Vec<VslRecord>,
    pub(super) statistics: StatisticsRecord,
    pub(super) paused: bool,
}

/// What stays the same from frame to frame.
pub(super) struct Still {
    pub(super) objects: Vec<ObjectRecord>,
    pub(super) lights: Vec<LightRecord>,
    pub(super) scene_text: Arc<str>,
}

/// Publishes snapshots until the ledger is gone, and then closes the channel.
pub(super) fn run(
    mut publisher: Publisher,
    still: &Still,
    snapshots: &flume::Receiver<Snapshot>,
    emptied: &flume::Sender<Vec<VslRecord>>,
    latest_frame: &AtomicU64,
) -> Result<(), ProtocolError> {
    let mut paused = false;
    while let Ok(snapshot) = snapshots.recv() {
        if paused != snapshot.paused {
            paused = snapshot.paused;
            publisher.set_paused(paused);
        }
        let frame = publisher.publish(&FrameSource {
            vsls: &snapshot.vsls,
            changed: None,
            objects: &still.objects,
            lights: &still.lights,
            statistics: &snapshot.statistics,
            scene_text: &still.scene_text,
            config_generation: 1,
            simulation_time_s: snapshot.statistics.simulation_time_s,
        })?;
        latest_frame.store(frame, Ordering::Release);
        // The ledger may be gone already; the memory is then no longer wanted.
        let _ = emptied.try_send(snapshot.vsls);
    }
    publisher.close();
    Ok(())
}
