//! Turns scenes that need other virtual surface lights into simulations, while the present one goes on.

use crate::{cancel::Cancel, simulation::Simulation};
use photonstream_scene::Scene;
use std::sync::Arc;

/// A scene to be made ready.
pub(super) struct Order {
    /// The simulation in whose place it comes.
    pub(super) base: Simulation,
    pub(super) scene: Arc<Scene>,
    /// It is that of a config, which may come again.
    pub(super) is_kept: bool,
    pub(super) cancel: Cancel,
}

/// Follows orders until nobody gives any, or takes the result; the answer to a cancelled one is `None`.
pub(super) fn run(orders: &flume::Receiver<Order>, placed: &flume::Sender<Option<Box<Simulation>>>) {
    while let Ok(Order { base, scene, is_kept, cancel }) = orders.recv() {
        let place = || match is_kept {
            true => base.reloaded_and_kept_unless(scene, &cancel).map(Box::new),
            false => base.reloaded_unless(scene, &cancel).map(Box::new),
        };
        // On threads of its own: the ledger's work, which shares those of the process, does not wait behind it.
        let simulation = match rayon::ThreadPoolBuilder::new().build() {
            Ok(threads) => threads.install(place),
            Err(error) => {
                tracing::debug!("lights are placed on the threads of the process: {error}");
                place()
            }
        };
        if placed.send(simulation).is_err() {
            return;
        }
    }
}
