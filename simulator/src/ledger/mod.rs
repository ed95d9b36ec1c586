//! Turns finished batches into flux: the single writer of the pool, and the one who says which slots to trace next.
//!
//! Batches are applied in the order in which their tasks were given out, whoever finishes first, so that pool and flux
//! after n tasks are the same on any number of threads.
//!
//! A new version of the scene makes stale the paths that met what has changed, and no others: they stay until their slots
//! are traced again, the brightest first, so that light changes gradually and never goes out. A batch that was under way
//! in an older version is taken in too, and judged in the same way when it comes.

mod importance;
mod migration;
mod queue;
mod reading;
mod refinement;
mod resplit;
mod slots_in_use;
mod tasks;

pub use migration::Migration;

use crate::{
    change::{ALL, Change},
    counters::Counters,
    emitters::Emitters,
    pool::PathPool,
    simulation::Simulation,
    tracer::{Beginnings, Draw, PathBatch},
};
use glam::Vec3;
use photonstream_scene::{Sampling, Scene};
use queue::{Queue, Ring};
use rayon::prelude::*;
use refinement::Refinement;
use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

/// Paths in one task: enough to make handing it over cheap, few enough to share the work evenly.
pub const PATHS_PER_TASK: u32 = 512;

/// Slots to be traced.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Place in the order of all tasks.
    pub number: u64,
    /// The paths; their slots belong to one light.
    pub draws: Vec<Draw>,
    /// What is still true of the paths that are there: to trace anew is to get the same.
    pub begun: Beginnings,
    /// The version of the scene to trace them in: counts the changes of the ledger.
    pub version: u64,
    light: usize,
    beyond_pool: bool,
    structure: u64,
}

/// What edits cost and what they did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Savings {
    /// Rays of paths that stayed valid through a change of objects, materials or lights.
    pub rays_saved: u64,
    /// Paths that such changes made stale.
    pub retraced_paths: u64,
}

/// Paths in one unit of parallel work when all are looked through.
const PATHS_LOOKED_AT: usize = 8192;

/// What a look through the pool has found.
#[derive(Clone, Copy, Default)]
struct Found {
    stale: u32,
    kept_rays: u64,
}

const FILLED: u8 = 1;
const STALE: u8 = 2;
const UNDER_WAY: u8 = 4;

/// Owns pool and flux.
#[derive(Debug)]
pub struct Ledger {
    emitters: Arc<Emitters>,
    sampling: Sampling,
    pool: PathPool,
    /// What is known of each slot.
    slots: Vec<u8>,
    /// How many first points of each path are true in the present version; [`ALL`] where it is not stale.
    kept: Vec<u8>,
    /// How often each slot was given out, for fresh samples.
    given: Vec<u32>,
    /// Slots in use of each light, from its first.
    active: Vec<u32>,
    queue: Queue,
    rings: Vec<Ring>,
    /// Batches of a light in an older version are in other units.
    units: Vec<u64>,
    version: u64,
    structure: u64,
    /// Changes since the version of the oldest batch under way.
    changes: VecDeque<(u64, Arc<Change>)>,
    /// Slots in use without a path.
    empty: u32,
    stale_paths: u32,
    next_task: u64,
    next_applied: u64,
    /// Versions of the tasks under way, in their order.
    under_way: VecDeque<u64>,
    waiting: BTreeMap<u64, (Task, PathBatch, u32)>,
    counters: Counters,
    refinement: Refinement,
    /// That of the lights from which the present ones fade.
    refined_before: Option<Refinement>,
    /// Nothing is refined for now.
    holds: bool,
    /// Watts per unit of each column.
    watts: Vec<Vec3>,
    savings: Savings,
}

impl Ledger {
    /// A ledger with an empty pool for the lights of `emitters` and `vsls` virtual surface lights.
    pub fn new(scene: &Scene, emitters: Arc<Emitters>, vsls: usize) -> Self {
        let columns = emitters.lights.iter().map(|l| (l.slots.end, l.column)).collect();
        let slots = emitters.slots as usize;
        let is_fresh = scene.streaming.sampling == Sampling::Fresh;
        let mut ledger = Self {
            pool: PathPool::new(columns, vsls),
            slots: vec![0; slots],
            kept: vec![ALL; slots],
            given: vec![0; if is_fresh { slots } else { 0 }],
            active: emitters.lights.iter().map(|l| l.slots.end - l.slots.start).collect(),
            queue: Queue::new(&emitters),
            rings: vec![Ring::default(); emitters.lights.len()],
            units: vec![0; emitters.lights.len()],
            sampling: scene.streaming.sampling,
            version: 0,
            structure: 0,
            changes: VecDeque::new(),
            empty: emitters.slots,
            stale_paths: 0,
            next_task: 0,
            next_applied: 0,
            under_way: VecDeque::new(),
            waiting: BTreeMap::new(),
            counters: Counters::default(),
            refinement: Refinement::new(
                if is_fresh { 0.0 } else { scene.streaming.target_error },
                vsls,
                &emitters,
            ),
            refined_before: None,
            holds: false,
            watts: emitters.column_watts(scene),
            emitters,
            savings: Savings::default(),
        };
        ledger.queue_open_slots();
        ledger
    }

    /// Goes on in a new version of the scene; `change` says what it means for the paths.
    ///
    /// The pool is split as before: [`Emitters::with_scene`]. `budget` is the number of paths that can be traced in the
    /// time a change may take: where more are stale, the lights with columns of their own go on with fewer slots, and
    /// get them back when there is time.
    pub fn revise(&mut self, simulation: &Simulation, change: Change, budget: Option<u32>) {
        let emitters = Arc::clone(&simulation.emitters);
        debug_assert!(self.emitters.lights.iter().zip(&emitters.lights).all(|(a, b)| a.slots == b.slots));
        self.version += 1;
        self.watts = emitters.column_watts(&simulation.scene);
        self.emitters = emitters;
        self.refinement.forget_error();
        let needs_rays = (0..change.lights.len()).any(|light| change.may_concern(light));
        for (index, revision) in change.lights.iter().enumerate() {
            let light = &self.emitters.lights[index];
            if revision.factor != Vec3::ONE {
                self.units[index] = self.version;
                self.pool.scale(light.slots.clone(), revision.factor);
            }
            if revision.factor != Vec3::ONE || change.may_concern(index) {
                self.refinement.reset(light.column as usize, self.version);
                if let Some(before) = &mut self.refined_before {
                    before.reset(light.column as usize, self.version);
                }
            }
        }
        let concerned: Vec<bool> = (0..change.lights.len()).map(|light| change.may_concern(light)).collect();
        if needs_rays {
            if let Some(budget) = budget {
                self.fit(budget, &concerned, |ledger| ledger.estimate(&change));
            }
            self.make_stale(&change);
        }
        if let Some(budget) = budget {
            self.fit(budget, &concerned, Self::open_slots);
        }
        if !self.under_way.is_empty() {
            self.changes.push_back((self.version, Arc::new(change)));
        }
        self.queue_open_slots();
    }

    /// Marks the paths that `change` concerns.
    fn make_stale(&mut self, change: &Change) {
        let concerned = change.look_through(&self.pool);
        for (index, light) in self.emitters.lights.iter().enumerate() {
            let first = light.slots.start as usize;
            let (pool, count) = (&self.pool, self.active[index] as usize);
            let look = |(marks, kept, start): (&mut [u8], &mut [u8], usize)| {
                let mut found = Found::default();
                for ((mark, kept), slot) in marks.iter_mut().zip(kept).zip(start as u32..) {
                    if *mark & FILLED == 0 {
                        continue;
                    }
                    let (points, was_stale) = (concerned.kept(index, slot), *mark & STALE != 0);
                    let is_stale = was_stale | (points != ALL);
                    *kept = points.min(*kept);
                    *mark |= if is_stale { STALE } else { 0 };
                    found.stale += u32::from(is_stale & !was_stale);
                    found.kept_rays += if is_stale { 0 } else { pool.rays(slot) };
                }
                found
            };
            let slots = first..first + count;
            let parts = self.slots[slots.clone()].par_chunks_mut(PATHS_LOOKED_AT);
            let parts = parts.zip(self.kept[slots].par_chunks_mut(PATHS_LOOKED_AT)).enumerate();
            let found = parts
                .map(|(part, (marks, kept))| look((marks, kept, first + part * PATHS_LOOKED_AT)))
                .reduce(Found::default, |a, b| Found {
                    stale: a.stale + b.stale,
                    kept_rays: a.kept_rays + b.kept_rays,
                });
            self.stale_paths += found.stale;
            self.savings.retraced_paths += u64::from(found.stale);
            self.savings.rays_saved += found.kept_rays;
        }
    }

    /// Takes in the finished batch of a task, and of those that waited for it. Returns batches whose memory is free.
    pub fn apply(&mut self, task: Task, batch: PathBatch, birth_ms: u32) -> Vec<PathBatch> {
        if task.structure != self.structure {
            // Of a scene with other triangles.
            self.counters += batch.counters;
            return vec![batch];
        }
        self.waiting.insert(task.number, (task, batch, birth_ms));
        let mut free = Vec::new();
        while let Some((task, batch, birth_ms)) = self.waiting.remove(&self.next_applied) {
            self.counters += batch.counters;
            self.next_applied += 1;
            self.under_way.pop_front();
            if task.beyond_pool {
                let column = self.emitters.lights[task.light].column as usize;
                self.refinement.apply(column, task.version, &batch, birth_ms);
            } else {
                self.take_in(&task, &batch, birth_ms);
            }
            free.push(batch);
        }
        let oldest = self.under_way.front().copied().unwrap_or(self.version);
        while self.changes.front().is_some_and(|(version, _)| *version <= oldest) {
            self.changes.pop_front();
        }
        free
    }

    /// Puts the paths of a batch into the pool.
    fn take_in(&mut self, task: &Task, batch: &PathBatch, birth_ms: u32) {
        let light = &self.emitters.lights[task.light];
        let (column, in_use) = (light.column, light.slots.start + self.active[task.light]);
        let is_in_other_units = task.version < self.units[task.light];
        let mut is_queue_longer = false;
        for path in batch.paths() {
            let mark = self.slots[path.slot as usize] & !UNDER_WAY;
            self.slots[path.slot as usize] = mark;
            if path.slot >= in_use {
                continue;
            }
            if is_in_other_units {
                if mark & (FILLED | STALE) != FILLED {
                    self.queue.push(task.light, path.slot, self.weight(column, path.slot));
                    is_queue_longer = true;
                }
                continue;
            }
            let later = self.changes.iter().filter(|(version, _)| *version > task.version);
            let kept = later.map(|(_, change)| change.kept(task.light, path.vertices)).min().unwrap_or(ALL);
            let is_stale = kept != ALL;
            self.empty -= u32::from(mark & FILLED == 0);
            self.stale_paths -= u32::from(mark & STALE != 0);
            self.stale_paths += u32::from(is_stale);
            self.pool.put(&path, birth_ms);
            self.slots[path.slot as usize] = FILLED | if is_stale { STALE } else { 0 };
            self.kept[path.slot as usize] = kept;
            if is_stale {
                self.savings.retraced_paths += 1;
                self.queue.push(task.light, path.slot, self.weight(column, path.slot));
                is_queue_longer = true;
            }
        }
        if is_queue_longer {
            self.queue.sort();
        }
    }

    /// Tasks given out and not yet applied.
    pub fn in_flight(&self) -> u64 {
        self.next_task - self.next_applied
    }

    /// Paths in the pool that stand for an older version of the scene.
    pub fn stale_paths(&self) -> u32 {
        self.stale_paths
    }

    /// Slots in use: all, but while a change has to be followed in little time.
    pub fn active_slots(&self) -> u32 {
        self.active.iter().sum()
    }

    /// Samples beyond the pool in the present light.
    pub fn refined_paths(&self) -> u64 {
        self.refinement.all_paths()
    }

    /// The relative standard error of a light's flux in the mean over lights, weighted by flux.
    pub fn relative_error(&self) -> f64 {
        let measured = self.refinement.measured_error();
        measured
            .unwrap_or_else(|| self.pool.flux().errors(self.refinement.flux(), &self.all_scales()).relative())
    }

    /// What edits cost and saved so far.
    pub fn savings(&self) -> Savings {
        self.savings
    }

    /// Whether every slot in use holds a path of the present version: there is no light of an older one.
    pub fn is_settled(&self) -> bool {
        self.empty == 0 && self.stale_paths == 0
    }

    /// Whether to add no samples beyond the pool for now: the virtual surface lights may be others soon, which have to be
    /// refined from the pool on.
    pub fn hold_refinement(&mut self, holds: bool) {
        self.holds = holds;
    }

    /// Whether every slot holds a path of the present version, and the light is refined as far as it is to be. A stream
    /// of fresh samples goes on from there; replayed samples are all traced.
    pub fn is_converged(&self) -> bool {
        let is_traced = self.is_settled() && self.is_full();
        is_traced
            && (self.sampling == Sampling::Fresh || (self.in_flight() == 0 && self.refinement.is_done()))
    }

    /// Whether nothing is being traced and nothing is left to trace.
    pub fn is_done(&self) -> bool {
        let is_endless = self.sampling == Sampling::Fresh && !self.slots.is_empty();
        self.in_flight() == 0 && !is_endless && self.is_converged()
    }

    /// The paths, and the flux they sum to.
    pub fn pool(&self) -> &PathPool {
        &self.pool
    }

    /// What has happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }
}
