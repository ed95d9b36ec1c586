//! Turns new versions of the scene into what the ledger goes on with, and the time that changes take into budgets.

use super::{Asked, Fade, Few, Moved, Progress, SceneChange, Version};
use crate::{distance_maps::Schedule, ledger::Migration, records, simulation::Simulation};
use photonstream_protocol::{PatchRecord, monotonic_ns};
use photonstream_scene::Geometry;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// The patches of virtual surface lights, and the versions of the scene that they are from.
pub(super) struct Placed {
    records: Arc<[PatchRecord]>,
    geometry: Arc<Geometry>,
    exposed: Arc<[f32]>,
    places: u64,
    placements: u64,
}

impl Progress {
    /// Goes on in a new version of the scene. Batches under way stay those of the old one.
    pub(super) fn edit(&mut self, version: Version, has_no_fade: bool) {
        let Version { simulation, still, asked, time_s, only_whole } = version;
        let (received_ns, moved) = match asked {
            Asked::At(received_ns) => (Some(received_ns), None),
            Asked::Nobody(moved) => (None, Some(moved)),
        };
        let follows_variance = simulation.scene.streaming.latency_ms > 0.0;
        let simulation =
            if follows_variance { simulation.with_split_of(&self.simulation) } else { simulation };
        if Arc::ptr_eq(&simulation.placement, &self.simulation.placement) {
            let is_still = Arc::ptr_eq(&simulation.scene.geometry, &self.simulation.scene.geometry);
            self.places += u64::from(!is_still);
            let change = SceneChange::between(&self.simulation, &simulation);
            let budget = self.budget(&simulation);
            self.ledger.revise(&simulation, change, budget);
            if let Some(maps) = &mut self.maps {
                maps.revise(&simulation);
            }
        } else {
            self.places += 1;
            self.placements += 1;
            let migration = Migration::between(&self.simulation, &simulation);
            let numbers = moved.as_ref().filter(|_| !has_no_fade).and_then(|moved| moved.numbers.clone());
            let migration = match numbers {
                Some(_) => migration.fading_from(&self.simulation),
                None => migration,
            };
            self.fade = numbers.map(Fade::new);
            // Its place is taken at once.
            let old = std::mem::replace(&mut self.ledger, simulation.ledger());
            let budget = self.budget(&simulation);
            self.ledger = old.migrate(&migration, &simulation, budget);
            self.replace_maps(&simulation, moved);
            self.few = simulation.few_lights().map(Few::new);
        }
        self.tracer = Arc::new(simulation.tracer.clone());
        self.simulation = simulation;
        self.still = still;
        (self.time_s, self.only_whole, self.unsettled) = (time_s, only_whole, true);
        self.versions += 1;
        if !self.changed {
            self.shown_at = Instant::now();
        }
        self.moves.are_due();
        self.hold_or_refine();
        if let Some(received_ns) = received_ns {
            self.edit_received_ns = received_ns;
            // An edit that needs no ray is traced with its arrival.
            self.traced_ns = monotonic_ns();
            if self.waiting_since_ns.is_none() {
                self.waiting_since_ns = Some(received_ns);
                self.paths_before_change = self.ledger.counters().paths;
            }
        }
        // A power alone moves no path.
        self.split_is_due |= !self.ledger.is_settled();
        self.note_whole_light();
        self.changed = true;
    }

    /// Begins the maps of other lights, but for those that are known. Maps under way are lost.
    fn replace_maps(&mut self, simulation: &Simulation, known: Option<Moved>) {
        self.maps = match (self.maps.take(), known) {
            (Some(old), Some(Moved { maps, scene, .. })) => {
                Schedule::following(old, simulation, self.placements, maps, &scene)
            }
            _ => Schedule::new(simulation, self.placements),
        };
    }

    /// Tasks of all kinds that are under way.
    pub(super) fn in_flight(&self) -> u64 {
        self.ledger.in_flight() + self.maps.as_ref().map_or(0, |maps| maps.in_flight() as u64)
    }

    /// Whether every distance map, if there are any, is that of the present scene.
    pub(super) fn has_whole_maps(&self) -> bool {
        self.maps.as_ref().is_none_or(Schedule::is_whole)
    }

    /// Whether all light and all shadows are those of the present scene.
    pub(super) fn is_whole(&self) -> bool {
        self.ledger.is_settled() && self.has_whole_maps()
    }

    /// The patches of the virtual surface lights: the same allocation until one of them changes.
    pub(super) fn patches(&mut self) -> Arc<[PatchRecord]> {
        let (scene, placement) = (&self.simulation.scene, &self.simulation.placement);
        let last = self.patches.take();
        let records = match &last {
            Some(last) if last.places == self.places => Arc::clone(&last.records),
            Some(last) if last.placements == self.placements => {
                let differs = |index: usize| {
                    let triangle = placement.vsls[index].triangle;
                    last.geometry.triangle(triangle) != scene.geometry.triangle(triangle)
                        || last.exposed[index] != self.simulation.exposed[index]
                };
                if (0..placement.vsls.len()).any(differs) {
                    let mut records = last.records.to_vec();
                    records::write_patches(&mut records, &self.simulation, differs);
                    records.into()
                } else {
                    Arc::clone(&last.records)
                }
            }
            _ => records::patch_records(&self.simulation).into(),
        };
        let placed = Placed {
            records: Arc::clone(&records),
            geometry: Arc::clone(&scene.geometry),
            exposed: Arc::clone(&self.simulation.exposed),
            places: self.places,
            placements: self.placements,
        };
        self.patches = Some(placed);
        records
    }

    /// Where the pool follows a latency target, splits it by measured variance: once after each change that was traced,
    /// as soon as its light is whole, so that a still scene comes to rest.
    pub(super) fn follow_variance(&mut self) {
        let scene = &self.simulation.scene;
        let is_ready = self.ledger.is_settled() && self.fade.is_none();
        if !self.split_is_due || scene.streaming.latency_ms <= 0.0 || !is_ready {
            return;
        }
        self.split_is_due = false;
        let Some(slots) = self.ledger.better_split(scene) else { return };
        let next = self.simulation.with_split(&slots);
        // Its place is taken at once.
        let old = std::mem::replace(&mut self.ledger, next.ledger());
        self.ledger = old.resplit(&self.simulation, &next);
        self.tracer = Arc::new(next.tracer.clone());
        self.simulation = next;
        self.hold_or_refine();
        self.changed = true;
    }

    /// The number of paths that can be traced in the time that a change may take; `None` where it may take any.
    fn budget(&self, simulation: &Simulation) -> Option<u32> {
        let latency_ms = simulation.scene.streaming.latency_ms;
        if latency_ms <= 0.0 {
            return None;
        }
        let paths_per_ms = self.paths_per_ms.or_else(|| {
            let ms = self.active_time(Instant::now()).as_secs_f64() * 1e3;
            let paths = self.ledger.counters().paths;
            // A rate of less than that says little.
            (paths >= 4096 && ms > 0.0).then(|| paths as f64 / ms)
        })?;
        // The frame that shows it has to be made, too.
        let time = (latency_ms - self.publishing.as_secs_f64() * 1e3).max(0.1 * latency_ms);
        Some((paths_per_ms * time).min(f64::from(u32::MAX)) as u32)
    }

    /// Notes how long a change has taken, once its light is traced, and how many paths a change can take in a time.
    pub(super) fn note_whole_light(&mut self) {
        if self.ledger.is_settled()
            && let Some(since) = self.waiting_since_ns.take()
        {
            self.latency_ms = self.traced_ns.saturating_sub(since) as f64 * 1e-6;
            let paths = self.ledger.counters().paths.saturating_sub(self.paths_before_change);
            // Fewer are over before the threads have begun.
            if paths >= 1024 && self.latency_ms > 0.0 {
                let now = paths as f64 / self.latency_ms;
                self.paths_per_ms = Some(self.paths_per_ms.map_or(now, |before| 0.5 * (before + now)));
            }
        }
    }

    pub(super) fn now_ms(&self) -> u32 {
        u32::try_from(self.started.elapsed().as_millis()).unwrap_or(u32::MAX)
    }

    pub(super) fn note_activity(&mut self, now: Instant) {
        match (self.in_flight() > 0, self.active_since) {
            (true, None) => self.active_since = Some(now),
            (false, Some(since)) => {
                self.active += now - since;
                self.active_since = None;
            }
            _ => {}
        }
    }

    pub(super) fn active_time(&self, now: Instant) -> Duration {
        self.active + self.active_since.map_or(Duration::ZERO, |since| now - since)
    }
}
