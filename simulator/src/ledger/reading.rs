//! Turns the sums of pool and refinement into the flux of every virtual surface light.

use super::{FILLED, Ledger, refinement::Refinement};
use crate::{
    emitters::LightSlots,
    flux::{ColumnScale, FluxReading},
};
use glam::Vec3;
use photonstream_scene::Scene;

impl Ledger {
    /// What a unit of each column stands for with the lights' present powers.
    pub fn scales(&self, scene: &Scene) -> Vec<ColumnScale> {
        self.scales_of(&self.emitters.column_watts(scene))
    }

    pub(super) fn all_scales(&self) -> Vec<ColumnScale> {
        self.scales_of(&self.watts)
    }

    fn scales_of(&self, watts: &[Vec3]) -> Vec<ColumnScale> {
        let columns = watts.iter().zip(self.pool.valid()).enumerate();
        columns
            .map(|(column, (&watts, &valid))| {
                let paths = self.paths_of(column, valid) + self.refinement.paths(column);
                ColumnScale { watts, paths }
            })
            .collect()
    }

    /// The number of paths by which the deposits of a column are divided, of which `valid` are in the pool.
    ///
    /// In a shared column the paths of a light stand for its share of the slots: where one light has more of its slots
    /// filled than another, that is counted as if all had, so that none carries the light of another. What is missing
    /// of the others is dark until it is traced.
    fn paths_of(&self, column: usize, valid: u32) -> u32 {
        let column = &self.emitters.columns[column];
        if column.shared_watts.is_none() || valid == column.slots || valid == 0 {
            return valid;
        }
        let lights = &self.emitters.lights[column.lights.start as usize..column.lights.end as usize];
        let share = |light: &LightSlots| {
            let marks = &self.slots[light.slots.start as usize..light.slots.end as usize];
            let filled = marks.iter().filter(|&&mark| mark & FILLED != 0).count();
            filled as f64 / marks.len().max(1) as f64
        };
        let most = lights.iter().map(share).fold(0.0, f64::max);
        ((most * f64::from(column.slots)).round() as u32).max(1)
    }

    /// The flux of every virtual surface light with the lights' present powers, in their order.
    pub fn readings(&self, scene: &Scene) -> impl Iterator<Item = FluxReading> {
        let scales = self.scales(scene);
        let (flux, more) = (self.pool.flux(), self.refinement.flux());
        (0..flux.vsls() as u32).map(move |vsl| flux.read_with(more, vsl, &scales))
    }

    /// The flux of the lights from which those of this ledger fade ([`super::Migration::fading_from`]), in their order, with
    /// what had been refined of it; `None` where they do not.
    pub fn readings_before(&self, scene: &Scene) -> Option<impl Iterator<Item = FluxReading>> {
        let flux = self.pool.also()?;
        let refined = self.refined_before.as_ref();
        let mut scales = self.pool_scales(scene);
        for (column, scale) in scales.iter_mut().enumerate() {
            scale.paths += refined.map_or(0, |refined| refined.paths(column));
        }
        let more = refined.and_then(Refinement::flux);
        Some((0..flux.vsls() as u32).map(move |vsl| flux.read_with(more, vsl, &scales)))
    }

    /// Sums no other lights' flux any more.
    pub fn end_fade(&mut self) {
        self.pool.forget_also();
        self.refined_before = None;
    }

    /// As [`Ledger::scales`], of the paths in the pool alone.
    pub(super) fn pool_scales(&self, scene: &Scene) -> Vec<ColumnScale> {
        let mut scales = self.scales(scene);
        for (column, scale) in scales.iter_mut().enumerate() {
            scale.paths -= self.refinement.paths(column);
        }
        scales
    }
}
