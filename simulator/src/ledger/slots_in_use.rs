//! Turns a budget of paths into the number of slots of each light that are in use: the first of each, as many as fit.

use super::{FILLED, Ledger, STALE, UNDER_WAY};
use crate::change::Change;

/// A light's part of the pool is never made smaller than this for the sake of speed.
const LEAST_ACTIVE: u32 = 256;

/// Paths of a light from which it is guessed how many of all are concerned.
const LOOKED_AT: u32 = 1024;

impl Ledger {
    /// About how many paths would have to be traced after `change`, from the first of each light.
    pub(super) fn estimate(&self, change: &Change) -> f64 {
        let mut open = 0.0;
        for (index, light) in self.emitters.lights.iter().enumerate() {
            let count = self.active[index].min(LOOKED_AT);
            let slots = light.slots.start..light.slots.start + count;
            let is_open = |slot: &u32| {
                self.slots[*slot as usize] & (FILLED | STALE) != FILLED
                    || change.concerns(index, self.pool.trail(*slot).unwrap_or_default())
            };
            let share = slots.filter(is_open).count() as f64 / f64::from(count.max(1));
            open += share * f64::from(self.active[index]);
        }
        open
    }

    pub(super) fn open_slots(&self) -> f64 {
        f64::from(self.empty + self.stale_paths)
    }

    /// As [`Ledger::fit`], of all lights that have slots to be traced.
    pub(super) fn fit_open(&mut self, budget: u32) {
        let is_open = |slot: u32| self.slots[slot as usize] & (FILLED | STALE) != FILLED;
        let lights = self.emitters.lights.iter();
        let concerned: Vec<bool> = lights.map(|light| light.slots.clone().any(is_open)).collect();
        self.fit(budget, &concerned, Self::open_slots);
    }

    /// Takes slots of the lights that are `concerned` out of use until no more than `budget` of those that `count` says have to be traced.
    pub(super) fn fit(&mut self, budget: u32, concerned: &[bool], count: impl Fn(&Self) -> f64) {
        // The first slots of a light may have more than their share of them.
        let mut before = u32::MAX;
        while self.active_slots() < before {
            let open = count(self);
            if open <= f64::from(budget) {
                return;
            }
            before = self.active_slots();
            self.shrink(f64::from(budget) / open, concerned);
        }
    }

    /// Leaves a share of the slots of each light in use that is `concerned`.
    fn shrink(&mut self, share: f64, concerned: &[bool]) {
        for (index, &is_concerned) in concerned.iter().enumerate() {
            let light = &self.emitters.lights[index];
            let column = &self.emitters.columns[light.column as usize];
            // In a shared column a path's weight is that of its light's share of the slots.
            if column.shared_watts.is_some() || !is_concerned {
                continue;
            }
            let slots = light.slots.start..light.slots.start + self.active[index];
            let fewer = (f64::from(self.active[index]) * share) as u32;
            let fewer = fewer.max(LEAST_ACTIVE).min(self.active[index]);
            for mark in &mut self.slots[(slots.start + fewer) as usize..slots.end as usize] {
                self.empty -= u32::from(*mark & FILLED == 0);
                self.stale_paths -= u32::from(*mark & STALE != 0);
                *mark &= UNDER_WAY;
            }
            self.refinement.reset(light.column as usize, self.version);
            self.pool.truncate(slots, fewer);
            self.active[index] = fewer;
        }
    }

    /// Takes twice as many slots into use, as far as there are.
    pub(super) fn grow(&mut self) {
        for (index, active) in self.active.iter_mut().enumerate() {
            let slots = &self.emitters.lights[index].slots;
            let more = active.saturating_mul(2).min(slots.end - slots.start);
            self.empty += more - *active;
            *active = more;
        }
        self.queue_open_slots();
    }

    /// Whether all slots are in use.
    pub fn is_full(&self) -> bool {
        self.emitters
            .lights
            .iter()
            .zip(&self.active)
            .all(|(l, &active)| l.slots.end - l.slots.start == active)
    }
}
