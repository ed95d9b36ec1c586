//! Turns finished batches into flux: the single writer of the pool, and the one who says which slots to trace next.
//!
//! Batches are applied in the order in which their tasks were given out, whoever finishes first, so that pool and flux
//! after n tasks are the same on any number of threads.
//!
//! Runs of slots are traced in a ring. A new version of the scene makes runs stale: their paths stay until the ring comes
//! round to them, oldest first, so that light changes gradually and never goes out. A batch that was under way in an
//! older version is taken in too, as what it is: newer than what it replaces, and still stale.

use crate::{
    counters::Counters,
    emitters::Emitters,
    flux::{ColumnScale, FluxReading},
    pool::PathPool,
    revision::LightRevision,
    tracer::PathBatch,
};
use glam::Vec3;
use photonstream_scene::{Sampling, Scene};
use std::{collections::BTreeMap, sync::Arc};

/// Paths in one task: enough to make handing it over cheap, few enough to share the work evenly.
pub const PATHS_PER_TASK: u32 = 512;

/// Slots to be traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// Place in the order of all tasks.
    pub number: u64,
    /// First slot; all slots of a task belong to one light.
    pub first_slot: u32,
    /// Number of slots.
    pub count: u32,
    /// Which block of the light's samples: 0 replays.
    pub generation: u64,
    /// The version of the scene to trace it in: counts the revisions of the ledger.
    pub version: u64,
    run: u32,
}

/// Slots that are traced together.
#[derive(Clone, Copy, Debug)]
struct Run {
    first_slot: u32,
    count: u32,
    light: u32,
    /// Times it was given out.
    given: u64,
    /// Version of the newest task.
    given_in: Option<u64>,
    /// Version that its paths were traced in.
    traced_in: Option<u64>,
}

/// Since which version the paths of a light stand as they are.
#[derive(Clone, Copy, Debug, Default)]
struct Since {
    /// Older paths are stale.
    valid: u64,
    /// Older batches are in other units.
    units: u64,
}

/// Owns pool and flux.
#[derive(Debug)]
pub struct Ledger {
    emitters: Arc<Emitters>,
    sampling: Sampling,
    pool: PathPool,
    /// In the order in which they are traced: all lights advance alike.
    runs: Vec<Run>,
    lights: Vec<Since>,
    version: u64,
    next_run: usize,
    /// Runs that no task of a valid version was given out for.
    open_runs: usize,
    stale_paths: u32,
    next_task: u64,
    next_applied: u64,
    waiting: BTreeMap<u64, (Task, PathBatch, u32)>,
    counters: Counters,
}

impl Ledger {
    /// A ledger with an empty pool for the lights of `emitters` and `vsls` virtual surface lights.
    pub fn new(scene: &Scene, emitters: Arc<Emitters>, vsls: usize) -> Self {
        let columns = emitters.lights.iter().map(|l| (l.slots.end, l.column)).collect();
        let mut runs: Vec<(f64, Run)> = Vec::new();
        for light in &emitters.lights {
            let slots = light.slots.clone();
            for first_slot in slots.clone().step_by(PATHS_PER_TASK as usize) {
                let progress = f64::from(first_slot - slots.start) / f64::from(slots.end - slots.start);
                let count = PATHS_PER_TASK.min(slots.end - first_slot);
                let light = light.light.0;
                let run = Run { first_slot, count, light, given: 0, given_in: None, traced_in: None };
                runs.push((progress, run));
            }
        }
        runs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.first_slot.cmp(&b.1.first_slot)));
        Self {
            pool: PathPool::new(columns, vsls),
            open_runs: runs.len(),
            runs: runs.into_iter().map(|(_, run)| run).collect(),
            lights: vec![Since::default(); emitters.lights.len()],
            sampling: scene.streaming.sampling,
            emitters,
            version: 0,
            next_run: 0,
            stale_paths: 0,
            next_task: 0,
            next_applied: 0,
            waiting: BTreeMap::new(),
            counters: Counters::default(),
        }
    }

    /// Goes on in a new version of the scene; `revisions` says for each light what it means for its paths.
    ///
    /// `emitters` splits the pool as before: [`Emitters::with_scene`].
    pub fn revise(&mut self, emitters: Arc<Emitters>, revisions: &[LightRevision]) {
        debug_assert!(self.emitters.lights.iter().zip(&emitters.lights).all(|(a, b)| a.slots == b.slots));
        self.version += 1;
        for ((since, revision), light) in self.lights.iter_mut().zip(revisions).zip(&emitters.lights) {
            if revision.stale || revision.factor != Vec3::ONE {
                since.valid = self.version;
            }
            if revision.factor != Vec3::ONE {
                since.units = self.version;
                self.pool.scale(light.slots.clone(), revision.factor);
            }
        }
        self.emitters = emitters;
        let (mut open_runs, mut stale_paths) = (0, 0);
        for run in &self.runs {
            open_runs += usize::from(self.is_open(run));
            stale_paths += if self.is_stale(run) { run.count } else { 0 };
        }
        (self.open_runs, self.stale_paths) = (open_runs, stale_paths);
    }

    /// Whether a task has to be given out so that its paths become those of the present version.
    fn is_open(&self, run: &Run) -> bool {
        run.given_in.is_none_or(|version| version < self.lights[run.light as usize].valid)
    }

    fn is_stale(&self, run: &Run) -> bool {
        run.traced_in.is_some_and(|version| version < self.lights[run.light as usize].valid)
    }

    /// What to trace next; `None` where everything that is worth tracing has been given out.
    pub fn next_task(&mut self) -> Option<Task> {
        if self.open_runs > 0 {
            self.next_task_where(|ledger, run| ledger.is_open(run))
        } else if self.sampling == Sampling::Fresh {
            self.next_task_where(|_, _| true)
        } else {
            None
        }
    }

    /// As [`Ledger::next_task`], for paths of an older version alone.
    pub fn next_stale_task(&mut self) -> Option<Task> {
        if self.stale_paths == 0 {
            return None;
        }
        self.next_task_where(|ledger, run| ledger.is_stale(run) && ledger.is_open(run))
    }

    /// The next task in the ring whose run is `wanted`.
    fn next_task_where(&mut self, wanted: impl Fn(&Self, &Run) -> bool) -> Option<Task> {
        let count = self.runs.len();
        let index = (self.next_run..self.next_run + count)
            .map(|index| index % count)
            .find(|&index| wanted(self, &self.runs[index]))?;
        self.open_runs -= usize::from(self.is_open(&self.runs[index]));
        let run = &mut self.runs[index];
        let generation = if self.sampling == Sampling::Replay { 0 } else { run.given };
        run.given += 1;
        run.given_in = Some(self.version);
        let task = Task {
            number: self.next_task,
            first_slot: run.first_slot,
            count: run.count,
            generation,
            version: self.version,
            run: index as u32,
        };
        self.next_run = (index + 1) % count;
        self.next_task += 1;
        Some(task)
    }

    /// Takes in the finished batch of a task, and of those that waited for it. Returns batches whose memory is free.
    pub fn apply(&mut self, task: Task, batch: PathBatch, birth_ms: u32) -> Vec<PathBatch> {
        self.waiting.insert(task.number, (task, batch, birth_ms));
        let mut free = Vec::new();
        while let Some((task, batch, birth_ms)) = self.waiting.remove(&self.next_applied) {
            self.counters += batch.counters;
            self.next_applied += 1;
            let run = self.runs[task.run as usize];
            // A batch in older units would weigh more or less than its light.
            if task.version >= self.lights[run.light as usize].units {
                self.pool.replace(&batch, birth_ms);
                let was_stale = self.is_stale(&run);
                self.runs[task.run as usize].traced_in = Some(task.version);
                let is_stale = self.is_stale(&self.runs[task.run as usize]);
                self.stale_paths -= if was_stale { run.count } else { 0 };
                self.stale_paths += if is_stale { run.count } else { 0 };
            }
            free.push(batch);
        }
        free
    }

    /// Tasks given out and not yet applied.
    pub fn in_flight(&self) -> u64 {
        self.next_task - self.next_applied
    }

    /// Paths in the pool that stand for an older version of the scene.
    pub fn stale_paths(&self) -> u32 {
        self.stale_paths
    }

    /// Whether every slot holds a path of the present version: the light is as good as the pool's size makes it. A stream
    /// of fresh samples goes on from there; replayed samples are all traced.
    pub fn is_converged(&self) -> bool {
        self.pool.valid().iter().sum::<u32>() == self.pool.slots()
            && self.stale_paths == 0
            && (self.sampling == Sampling::Fresh || self.in_flight() == 0)
    }

    /// Whether nothing is being traced and nothing is left to trace.
    pub fn is_done(&self) -> bool {
        self.in_flight() == 0
            && self.open_runs == 0
            && (self.sampling == Sampling::Replay || self.runs.is_empty())
    }

    /// The paths, and the flux they sum to.
    pub fn pool(&self) -> &PathPool {
        &self.pool
    }

    /// What has happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// What a unit of each column stands for with the lights' present powers.
    pub fn scales(&self, scene: &Scene) -> Vec<ColumnScale> {
        let watts = self.emitters.column_watts(scene);
        watts.into_iter().zip(self.pool.valid()).map(|(watts, &paths)| ColumnScale { watts, paths }).collect()
    }

    /// The flux of every virtual surface light with the lights' present powers, in their order.
    pub fn readings(&self, scene: &Scene) -> impl Iterator<Item = FluxReading> {
        let scales = self.scales(scene);
        (0..self.pool.flux().vsls() as u32).map(move |vsl| self.pool.flux().read(vsl, &scales))
    }
}
