//! Turns slots that have to be traced into tasks: what is stale or empty first, then a stream's oldest paths, or samples
//! beyond the pool.

use super::{FILLED, Ledger, PATHS_PER_TASK, STALE, Task, UNDER_WAY};
use crate::tracer::{Beginnings, Draw};
use glam::Vec3;
use photonstream_scene::Sampling;

impl Ledger {
    pub(super) fn queue_open_slots(&mut self) {
        self.queue.clear();
        if self.empty + self.stale_paths == 0 {
            return;
        }
        for (index, light) in self.emitters.lights.iter().enumerate() {
            for slot in light.slots.start..light.slots.start + self.active[index] {
                let mark = self.slots[slot as usize];
                if mark & UNDER_WAY == 0 && mark & (FILLED | STALE) != FILLED {
                    self.queue.push(index, slot, self.weight(light.column, slot));
                }
            }
        }
        self.queue.sort();
    }

    /// How bright the path in `slot` is; `None` where there is none.
    pub(super) fn weight(&self, column: u32, slot: u32) -> Option<f32> {
        let deposits = self.pool.path(slot)?;
        let sum = deposits.iter().fold([0i64; 3], |sum, d| [0, 1, 2].map(|i| sum[i] + i64::from(d.rgb[i])));
        let [r, g, b] = sum.map(|x| x as f32);
        let paths = self.pool.valid()[column as usize].max(1) as f32;
        Some((Vec3::new(r, g, b) * self.watts[column as usize]).element_sum() / paths)
    }

    /// What to trace next; `None` where everything that is worth tracing has been given out.
    pub fn next_task(&mut self) -> Option<Task> {
        if let Some(task) = self.next_open_task(false) {
            return Some(task);
        }
        let is_settled = self.empty == 0 && self.stale_paths == 0 && self.queue.is_empty();
        if is_settled && !self.is_full() {
            self.grow();
            return self.next_open_task(false);
        }
        if self.sampling == Sampling::Fresh {
            return self.next_of_ring();
        }
        if !is_settled || self.holds {
            return None;
        }
        let scales = self.all_scales();
        let (light, draws) = self.refinement.next(self.pool.flux(), &scales, &self.emitters)?;
        Some(self.task(light, draws, true))
    }

    /// As [`Ledger::next_task`], for paths of an older version alone.
    pub fn next_stale_task(&mut self) -> Option<Task> {
        self.next_open_task(true)
    }

    fn next_open_task(&mut self, only_stale: bool) -> Option<Task> {
        let (mut slots, marks) = (Vec::new(), &mut self.slots);
        let light = self.queue.take(PATHS_PER_TASK, only_stale, |slot| {
            marks[slot as usize] |= UNDER_WAY;
            slots.push(slot);
        })?;
        let begun = self.beginnings(&slots);
        let draws = slots.into_iter().map(|slot| self.draw(slot)).collect();
        Some(Task { begun, ..self.task(light, draws, false) })
    }

    /// What is still true of the stale paths in `slots`: of a replayed sample the path is the same again up to what it met.
    fn beginnings(&mut self, slots: &[u32]) -> Beginnings {
        let mut begun = Beginnings::default();
        let is_stale = |slot: u32| self.slots[slot as usize] & STALE != 0;
        if self.sampling == Sampling::Replay && slots.iter().any(|&slot| is_stale(slot)) {
            for &slot in slots {
                let points = if is_stale(slot) { self.kept[slot as usize] } else { 0 };
                // Where nothing is known the path is not looked up: most lookups miss the cache.
                let known = (points >= 2).then(|| self.pool.beginning(slot, points)).flatten();
                self.savings.rays_saved += begun.push(known);
            }
        }
        begun
    }

    /// The next task of a stream of fresh samples: of the light that is behind, its oldest paths.
    fn next_of_ring(&mut self) -> Option<Task> {
        let lights = &self.emitters.lights;
        let progress = |i: usize| self.rings[i].progress(self.active[i]);
        let light =
            (0..lights.len()).reduce(|best, i| if progress(i) < progress(best) { i } else { best })?;
        let first = lights[light].slots.start;
        let slots = first..first + self.active[light];
        let marks = &self.slots;
        let taken =
            self.rings[light].take(slots, PATHS_PER_TASK, |slot| marks[slot as usize] & UNDER_WAY == 0);
        if taken.is_empty() {
            return None;
        }
        for &slot in &taken {
            self.slots[slot as usize] |= UNDER_WAY;
        }
        let draws = taken.into_iter().map(|slot| self.draw(slot)).collect();
        Some(self.task(light, draws, false))
    }

    fn draw(&mut self, slot: u32) -> Draw {
        let mut generation = 0;
        if let Some(given) = self.given.get_mut(slot as usize) {
            generation = *given;
            *given = given.wrapping_add(1);
        }
        Draw { slot, generation }
    }

    fn task(&mut self, light: usize, draws: Vec<Draw>, beyond_pool: bool) -> Task {
        let (number, version, structure) = (self.next_task, self.version, self.structure);
        self.next_task += 1;
        self.under_way.push_back(version);
        Task { number, draws, begun: Beginnings::default(), version, light, beyond_pool, structure }
    }
}
