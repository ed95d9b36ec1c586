//! Turns two placements on the same surfaces into one that has the lights of both, of which some only fade out.

use super::Placement;
use crate::simulation::Simulation;
use std::{collections::HashMap, sync::Arc};

impl Placement {
    /// Number of lights that own something: all but those that are retiring, which come last.
    pub fn owning(&self) -> usize {
        self.surfaces.last().map_or(0, |(_, lights)| lights.end as usize)
    }
}

impl Simulation {
    /// This simulation with those lights of `old` besides that it does not have, with the same patch: they own nothing, and
    /// are there to fade out. Returns also the number that each light of `old` has here; those that were retiring there
    /// already are gone.
    pub fn with_retiring(&self, old: &Self) -> (Self, Vec<u32>) {
        let mut placement = Placement::clone(&self.placement);
        let mut exposed = self.exposed.to_vec();
        let there: HashMap<_, u32> = placement.vsls.iter().map(|vsl| vsl.place()).zip(0..).collect();
        let was = &old.placement;
        let mut numbers = Vec::with_capacity(was.owning());
        for (index, vsl) in was.vsls[..was.owning()].iter().enumerate() {
            let is_same = |&now: &u32| {
                let now = now as usize;
                placement.vsls[now].area == vsl.area
                    && placement.patches[now] == was.patches[index]
                    && exposed[now] == old.exposed[index]
            };
            let number = there.get(&vsl.place()).copied().filter(is_same).unwrap_or_else(|| {
                placement.vsls.push(*vsl);
                placement.patches.push(was.patches[index]);
                exposed.push(old.exposed[index]);
                placement.vsls.len() as u32 - 1
            });
            numbers.push(number);
        }
        (Self { placement: Arc::new(placement), exposed: exposed.into(), ..self.clone() }, numbers)
    }

    /// This simulation without lights that are retiring.
    pub fn without_retiring(&self) -> Self {
        let mut placement = Placement::clone(&self.placement);
        let owning = placement.owning();
        placement.vsls.truncate(owning);
        placement.patches.truncate(owning);
        Self { placement: Arc::new(placement), exposed: self.exposed[..owning].into(), ..self.clone() }
    }
}
