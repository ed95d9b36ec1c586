//! Turns the time in which nothing changes into more samples than the pool holds, until the light is exact enough.
//!
//! Samples beyond the pool are summed and not kept: what changes the light of a column drops all of them. Rounds are whole
//! generations of one column, and which column is next is decided between rounds from exact sums, so that the refined
//! light is the same on any number of threads.

use super::PATHS_PER_TASK;
use crate::{
    emitters::Emitters,
    flux::{ColumnScale, VslFlux},
    tracer::{Draw, PathBatch},
};
use std::{collections::VecDeque, ops::Range};

/// Most samples of all columns together: the flux sums of so many paths cannot overflow.
const MOST_PATHS: u64 = photonstream_scene::StreamingSettings::MAX_POOL_PATHS as u64;

/// The samples beyond the pool.
#[derive(Clone, Debug)]
pub(super) struct Refinement {
    /// Relative standard error at which it ends; 0: none at all.
    pub(super) target: f64,
    flux: VslFlux,
    /// The present round, until it is whole: lights of one column are traced one after another.
    of_round: VslFlux,
    paths_of_round: u32,
    columns: Vec<ColumnState>,
    /// The rest of the present round.
    round: VecDeque<Range<u32>>,
    round_column: usize,
    round_generation: u32,
    /// Tasks of the present round that are under way.
    under_way: u32,
    /// The error of pool and refinement together, until something changes it.
    error: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct ColumnState {
    /// Paths summed.
    paths: u32,
    /// Generations begun.
    generations: u32,
    /// Batches of an older version are dropped.
    valid_since: u64,
}

impl Refinement {
    pub(super) fn new(target: f64, vsls: usize, emitters: &Emitters) -> Self {
        let columns = emitters.columns.len();
        Self {
            target,
            flux: VslFlux::new(if target > 0.0 { vsls } else { 0 }, columns),
            of_round: VslFlux::new(if target > 0.0 { vsls } else { 0 }, 1),
            paths_of_round: 0,
            columns: vec![ColumnState::default(); columns],
            round: VecDeque::new(),
            round_column: 0,
            round_generation: 0,
            under_way: 0,
            error: None,
        }
    }

    /// Its sums; `None` where there are none.
    pub(super) fn flux(&self) -> Option<&VslFlux> {
        self.columns.iter().any(|column| column.paths > 0).then_some(&self.flux)
    }

    /// Paths summed in each column.
    pub(super) fn paths(&self, column: usize) -> u32 {
        self.columns[column].paths
    }

    /// Paths summed in all columns.
    pub(super) fn all_paths(&self) -> u64 {
        self.columns.iter().map(|column| u64::from(column.paths)).sum()
    }

    /// Drops what was summed in `column`; batches under way of versions before `version` are dropped when they come.
    pub(super) fn reset(&mut self, column: usize, version: u64) {
        let state = &mut self.columns[column];
        if state.paths > 0 {
            self.flux.clear(column as u32);
        }
        *state = ColumnState { valid_since: version, ..ColumnState::default() };
        if self.round_column == column {
            self.round.clear();
            self.forget_round();
        }
        self.error = None;
    }

    /// The error is another one: powers have changed, or paths of the pool.
    pub(super) fn forget_error(&mut self) {
        self.error = None;
    }

    /// The relative standard error of the light, weighted by flux, as it was measured last.
    pub(super) fn measured_error(&self) -> Option<f64> {
        self.error
    }

    /// Whether there is nothing to be gained, or it is not to be.
    pub(super) fn is_done(&self) -> bool {
        self.target <= 0.0
            || (self.round.is_empty() && self.under_way == 0 && self.error.is_some_and(|e| self.is_enough(e)))
    }

    fn is_enough(&self, error: f64) -> bool {
        error <= self.target || self.all_paths() >= MOST_PATHS / 2
    }

    /// The next task, where everything else is done: `pool` is complete, and `scales` are those of pool and refinement.
    pub(super) fn next(
        &mut self,
        pool: &VslFlux,
        scales: &[ColumnScale],
        emitters: &Emitters,
    ) -> Option<(usize, Vec<Draw>)> {
        if self.target <= 0.0 {
            return None;
        }
        if self.round.is_empty() {
            if self.under_way > 0 {
                return None;
            }
            let sums = pool.errors(self.flux(), scales);
            let error = sums.relative();
            self.error = Some(error);
            if self.is_enough(error) {
                return None;
            }
            self.begin_round(&sums.variances, scales, emitters)?;
        }
        let slots = self.round.pop_front()?;
        self.under_way += 1;
        let generation = self.round_generation;
        let light = emitters.light_of(slots.start).light.0 as usize;
        Some((light, slots.map(|slot| Draw { slot, generation }).collect()))
    }

    /// Begins a generation of the column in which a path takes most off the variance.
    fn begin_round(&mut self, variances: &[f64], scales: &[ColumnScale], emitters: &Emitters) -> Option<()> {
        let gain = |column: usize| {
            let (paths, more) = (f64::from(scales[column].paths), f64::from(emitters.columns[column].slots));
            variances[column] / (paths + more)
        };
        let best = (0..variances.len()).reduce(|best, i| if gain(i) > gain(best) { i } else { best })?;
        if gain(best) <= 0.0 {
            return None;
        }
        self.columns[best].generations += 1;
        (self.round_column, self.round_generation) = (best, self.columns[best].generations);
        for light in emitters.lights.iter().filter(|light| light.column as usize == best) {
            let starts = light.slots.clone().step_by(PATHS_PER_TASK as usize);
            self.round.extend(starts.map(|start| start..light.slots.end.min(start + PATHS_PER_TASK)));
        }
        Some(())
    }

    /// Takes in a finished batch of `column`, traced in `version`.
    pub(super) fn apply(&mut self, column: usize, version: u64, batch: &PathBatch, birth_ms: u32) {
        self.under_way -= 1;
        if version < self.columns[column].valid_since {
            return;
        }
        self.paths_of_round += batch.slots.len() as u32;
        self.of_round.add(0, &batch.deposits, birth_ms);
        if self.round.is_empty() && self.under_way == 0 {
            self.flux.merge(column as u32, &self.of_round);
            self.columns[column].paths += self.paths_of_round;
            self.forget_round();
        }
    }

    fn forget_round(&mut self) {
        if self.paths_of_round > 0 {
            self.of_round.clear(0);
            self.paths_of_round = 0;
        }
    }
}
