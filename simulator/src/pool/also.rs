//! Turns paths into flux of the lights of another placement, beside those that own their deposits.

use crate::{
    flux::{Deposit, VslFlux},
    owner::OwnerTable,
    tracer::Path,
    trail::Event,
};
use std::sync::Arc;

/// Lights of another placement on the same surfaces, and their flux.
#[derive(Clone, Debug)]
pub(super) struct OtherLights {
    owners: Arc<OwnerTable>,
    flux: VslFlux,
    /// Room for the deposits of a path.
    room: Vec<Deposit>,
}

impl OtherLights {
    pub(super) fn new(owners: Arc<OwnerTable>, flux: VslFlux) -> Self {
        Self { owners, flux, room: Vec::new() }
    }

    pub(super) fn flux(&self) -> &VslFlux {
        &self.flux
    }

    pub(super) fn add(&mut self, column: u32, path: &Path<'_>, birth_ms: u32) {
        self.own(path);
        self.flux.add(column, &self.room, birth_ms);
    }

    /// Takes back what [`OtherLights::add`] added for the same path: exactly.
    pub(super) fn subtract(&mut self, column: u32, path: &Path<'_>, birth_ms: u32) {
        self.own(path);
        self.flux.subtract(column, &self.room, birth_ms);
    }

    /// The deposits of `path`, each to its owner here.
    fn own(&mut self, path: &Path<'_>) {
        self.room.clear();
        let mut deposits = path.deposits.iter();
        for (vertex, [u, v]) in path.vertices.iter().zip(path.uvs) {
            let Event::Hit { triangle, side, deposited: true } = vertex.event() else { continue };
            let Some(deposit) = deposits.next() else { break };
            if let Some(owner) = self.owners.owner(triangle, side, *u, *v) {
                self.room.push(Deposit { vsl: owner.0, ..*deposit });
            }
        }
    }
}
