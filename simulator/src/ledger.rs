//! Turns finished batches into flux: the single writer of the pool, and the one who says which slots to trace next.
//!
//! Batches are applied in the order in which their tasks were given out, whoever finishes first, so that pool and flux
//! after n tasks are the same on any number of threads.

use crate::{
    counters::Counters,
    emitters::Emitters,
    flux::{ColumnScale, FluxReading},
    pool::PathPool,
    tracer::PathBatch,
};
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
}

/// Owns pool and flux.
#[derive(Debug)]
pub struct Ledger {
    emitters: Arc<Emitters>,
    sampling: Sampling,
    pool: PathPool,
    /// Runs of slots in the order in which they are traced: all lights advance alike.
    runs: Vec<(u32, u32)>,
    next_run: usize,
    generation: u64,
    next_task: u64,
    next_applied: u64,
    waiting: BTreeMap<u64, (PathBatch, u32)>,
    counters: Counters,
}

impl Ledger {
    /// A ledger with an empty pool for the lights of `emitters` and `vsls` virtual surface lights.
    pub fn new(scene: &Scene, emitters: Arc<Emitters>, vsls: usize) -> Self {
        let columns = emitters.lights.iter().map(|l| (l.slots.end, l.column)).collect();
        let mut runs: Vec<(f64, (u32, u32))> = Vec::new();
        for light in &emitters.lights {
            let slots = light.slots.clone();
            for first in slots.clone().step_by(PATHS_PER_TASK as usize) {
                let progress = f64::from(first - slots.start) / f64::from(slots.end - slots.start);
                runs.push((progress, (first, PATHS_PER_TASK.min(slots.end - first))));
            }
        }
        runs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        Self {
            pool: PathPool::new(columns, vsls),
            runs: runs.into_iter().map(|(_, run)| run).collect(),
            sampling: scene.streaming.sampling,
            emitters,
            next_run: 0,
            generation: 0,
            next_task: 0,
            next_applied: 0,
            waiting: BTreeMap::new(),
            counters: Counters::default(),
        }
    }

    /// What to trace next; `None` where everything that is worth tracing has been given out.
    pub fn next_task(&mut self) -> Option<Task> {
        if self.next_run == self.runs.len() {
            if self.sampling == Sampling::Replay || self.runs.is_empty() {
                return None;
            }
            self.next_run = 0;
            self.generation += 1;
        }
        let (first_slot, count) = self.runs[self.next_run];
        let task = Task { number: self.next_task, first_slot, count, generation: self.generation };
        self.next_run += 1;
        self.next_task += 1;
        Some(task)
    }

    /// Takes in the finished batch of a task, and of those that waited for it. Returns batches whose memory is free.
    pub fn apply(&mut self, task: Task, batch: PathBatch, birth_ms: u32) -> Vec<PathBatch> {
        self.waiting.insert(task.number, (batch, birth_ms));
        let mut free = Vec::new();
        while let Some((batch, birth_ms)) = self.waiting.remove(&self.next_applied) {
            self.pool.replace(&batch, birth_ms);
            self.counters += batch.counters;
            self.next_applied += 1;
            free.push(batch);
        }
        free
    }

    /// Tasks given out and not yet applied.
    pub fn in_flight(&self) -> u64 {
        self.next_task - self.next_applied
    }

    /// Whether every slot holds a path: the light is as good as the pool's size makes it. A stream of fresh samples goes
    /// on from there; replayed samples are all traced.
    pub fn is_converged(&self) -> bool {
        self.pool.valid().iter().sum::<u32>() == self.pool.slots()
            && (self.sampling == Sampling::Fresh || self.in_flight() == 0)
    }

    /// Whether nothing is being traced and nothing is left to trace.
    pub fn is_done(&self) -> bool {
        self.in_flight() == 0 && self.sampling == Sampling::Replay && self.next_run == self.runs.len()
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
