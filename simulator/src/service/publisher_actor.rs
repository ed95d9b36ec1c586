//! Turns snapshots of the ledger into frames in shared memory.

#[cfg(test)]
mod tests;

use super::published_maps::{MapUpdate, PublishedMaps};
use crate::records;
use crossbeam::queue::ArrayQueue;
use photonstream_protocol::{
    ChunkSet, FrameSource, LightRecord, NOTICE_CAPACITY, ObjectRecord, PatchRecord, ProtocolError, Publisher,
    SegmentSpec, StatisticsRecord, VslRecord,
};
use photonstream_scene::Scene;
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

/// What the ledger wants published.
pub(super) struct Snapshot {
    /// Virtual surface lights that there has to be room for.
    pub(super) room: usize,
    pub(super) vsls: PlacedRecords,
    /// The same allocation for as long as no patch changes.
    pub(super) patches: Arc<[PatchRecord]>,
    /// What has changed of the distance maps; `None` where there are none.
    pub(super) maps: Option<MapUpdate>,
    pub(super) still: Arc<Still>,
    pub(super) statistics: StatisticsRecord,
    pub(super) paused: bool,
}

/// Records of all virtual surface lights, and the versions of the scene that they are from.
#[derive(Clone, Debug)]
pub(super) struct PlacedRecords {
    pub(super) records: Vec<VslRecord>,
    /// Of their places.
    pub(super) version: u64,
    /// Of the lights themselves.
    pub(super) placement: u64,
}

/// What stays the same from frame to frame of one version of the scene.
pub(super) struct Still {
    pub(super) objects: Vec<ObjectRecord>,
    pub(super) lights: Vec<LightRecord>,
    pub(super) scene_text: Arc<str>,
    pub(super) scene_hash: u64,
    /// Counts the configs that were loaded.
    pub(super) config_generation: u64,
    /// What everybody should know: why the edited config is not shown. Empty where there is nothing.
    pub(super) notice: Arc<str>,
}

impl Still {
    /// The records of a scene's first version.
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            objects: records::object_records(scene),
            lights: records::light_records(scene),
            scene_text: Arc::clone(&scene.resolved_text),
            scene_hash: scene.hash,
            config_generation: 1,
            notice: Arc::from(""),
        }
    }

    /// What a segment for a frame of so many virtual surface lights and pieces of distance maps has to hold; no less than `least`.
    pub(super) fn spec(&self, vsls: usize, distances: usize, least: Option<&SegmentSpec>) -> SegmentSpec {
        let size = |count: usize, least: Option<u32>| (count.max(1) as u32).max(least.unwrap_or(0));
        SegmentSpec {
            vsl_capacity: size(vsls, least.map(|l| l.vsl_capacity)),
            distance_capacity: (distances as u32).max(least.map_or(0, |l| l.distance_capacity)),
            object_capacity: size(self.objects.len(), least.map(|l| l.object_capacity)),
            light_capacity: size(self.lights.len(), least.map(|l| l.light_capacity)),
            scene_text_capacity: size(self.scene_text.len(), least.map(|l| l.scene_text_capacity)),
            notice_capacity: NOTICE_CAPACITY,
            scene_hash: self.scene_hash,
            slots: 3,
        }
    }

    /// The records of the next version; those that change count their generation up.
    pub(super) fn next(&self, scene: &Scene) -> Self {
        let mut next = Self::new(scene);
        next.config_generation = self.config_generation;
        next.notice = Arc::clone(&self.notice);
        if next.scene_hash != self.scene_hash {
            return next;
        }
        for (new, old) in next.objects.iter_mut().zip(&self.objects) {
            new.generation = old.generation;
            new.generation += u32::from(new != old);
        }
        for (new, old) in next.lights.iter_mut().zip(&self.lights) {
            new.generation = old.generation;
            new.generation += u32::from(new != old);
        }
        next
    }
}

/// Sets of records that go round between ledger and publisher: one is filled, one is published, and the last one
/// published is kept to be published again.
pub(super) const RECORD_SETS: usize = 3;

/// How often a resting publisher looks whether its names are still there.
const LOOK: Duration = Duration::from_secs(1);

/// Publishes what the ledger sends, and owns the channel.
pub(super) struct PublisherActor {
    pub(super) publisher: Publisher,
    pub(super) snapshots: flume::Receiver<Snapshot>,
    /// Records that the ledger may fill again.
    pub(super) emptied: Arc<ArrayQueue<PlacedRecords>>,
    pub(super) latest_frame: Arc<AtomicU64>,
    /// Set before an orderly end; without it the channel is left as a crash leaves it, so that renderers wait for the
    /// simulator to come back instead of taking a half-lit frame for the last.
    pub(super) orderly: Arc<AtomicBool>,
    /// Who comes after an orderly end still finds the last frame; somebody else removes the channel.
    pub(super) stays_findable: bool,
    /// The segment that could not be made.
    pub(super) refused: Option<Refused>,
    /// The patches published last.
    pub(super) patches: Option<Arc<[PatchRecord]>>,
    /// The distance maps of the newest placement.
    pub(super) maps: PublishedMaps,
}

/// A segment that could not be made.
pub(super) struct Refused {
    spec: SegmentSpec,
    when: Instant,
    reason: String,
}

impl PublisherActor {
    /// Publishes until the ledger is gone, and then ends the channel.
    pub(super) fn run(mut self) -> Result<(), ProtocolError> {
        let result = self.publish_all();
        // Set before the ledger was told to end, which is what ended the snapshots.
        if result.is_ok() && self.orderly.load(Ordering::Acquire) {
            if self.stays_findable {
                self.publisher.close_findable();
            } else {
                self.publisher.close();
            }
        } else {
            self.publisher.abandon();
        }
        result
    }

    fn publish_all(&mut self) -> Result<(), ProtocolError> {
        let mut last: Option<Snapshot> = None;
        loop {
            match self.snapshots.recv_timeout(LOOK) {
                Ok(snapshot) => {
                    if last.as_ref().is_some_and(|last| last.paused) != snapshot.paused {
                        self.publisher.set_paused(snapshot.paused);
                    }
                    self.maps.update(snapshot.maps.as_ref());
                    let free = match (self.make_room(&snapshot), &last) {
                        (Ok(()), _) => {
                            self.publish(&snapshot, &snapshot.still.notice)?;
                            last.replace(snapshot)
                        }
                        // The last scene goes on, as with a config that is not valid.
                        (Err(()), Some(shown)) => {
                            let reason = self.refused.as_ref().map_or("", |refused| &refused.reason);
                            self.publish(shown, &format!("the changed scene is not shown: {reason}"))?;
                            Some(snapshot)
                        }
                        // The first scene has the segment that it was made for.
                        (Err(()), None) => Some(snapshot),
                    };
                    if let Some(free) = free {
                        // There are as many places as sets of records.
                        let _ = self.emptied.push(free.vsls);
                    }
                }
                Err(flume::RecvTimeoutError::Timeout) => {
                    if let Some(last) = last.as_ref().filter(|_| self.publisher.names_are_lost()) {
                        tracing::warn!(
                            "the channel's names were removed by someone: publishing under new ones"
                        );
                        self.publish(last, &last.still.notice)?;
                    }
                }
                Err(flume::RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    /// Takes another segment where the scene is another one, or does not fit into the present one.
    ///
    /// # Errors
    /// Where there is no room for it, which is then noted; tried again after a while.
    fn make_room(&mut self, snapshot: &Snapshot) -> Result<(), ()> {
        let spec = self.publisher.spec();
        let room = snapshot.room.max(snapshot.vsls.records.len());
        let distances = snapshot.maps.as_ref().map_or(0, |maps| maps.records_of(room));
        let least = snapshot.still.spec(room, distances, Some(spec));
        // Only a larger or another scene needs another one: what is too large is kept for the next.
        if least == *spec {
            self.refused = None;
            return Ok(());
        }
        let before = self.refused.as_ref().filter(|refused| refused.spec == least);
        if before.is_some_and(|refused| refused.when.elapsed() < LOOK) {
            return Err(());
        }
        let Err(error) = self.publisher.replace_segment(&least) else {
            self.refused = None;
            return Ok(());
        };
        if before.is_none() {
            tracing::warn!("the changed scene is not shown, the last one goes on: {error}");
        }
        self.refused = Some(Refused { spec: least, when: Instant::now(), reason: error.to_string() });
        Err(())
    }

    fn publish(&mut self, snapshot: &Snapshot, notice: &str) -> Result<(), ProtocolError> {
        let is_same = self.patches.as_ref().is_some_and(|last| Arc::ptr_eq(last, &snapshot.patches));
        let count = snapshot.patches.len();
        let none = ChunkSet::default();
        let patches_changed = if is_same { ChunkSet::for_records(count) } else { ChunkSet::all(count) };
        // What fails to be published is not what was published last.
        self.patches = None;
        let has_maps = self.maps.are_of(snapshot.vsls.placement, snapshot.vsls.records.len());
        let (distances, distances_changed) = if has_maps { self.maps.records() } else { (&[][..], &none) };
        let published = self.publisher.publish(&FrameSource {
            vsls: &snapshot.vsls.records,
            changed: None,
            patches: &snapshot.patches,
            patches_changed: Some(&patches_changed),
            distances,
            distances_changed: Some(distances_changed),
            objects: &snapshot.still.objects,
            lights: &snapshot.still.lights,
            statistics: &snapshot.statistics,
            scene_text: &snapshot.still.scene_text,
            notice,
            config_generation: snapshot.still.config_generation,
            simulation_time_s: snapshot.statistics.simulation_time_s,
        });
        if has_maps && published.is_ok() {
            self.maps.published();
        } else {
            self.maps.not_published();
        }
        let frame = published?;
        self.patches = Some(Arc::clone(&snapshot.patches));
        self.latest_frame.store(frame, Ordering::Release);
        Ok(())
    }
}
