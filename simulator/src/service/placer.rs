//! Turns scenes that need other virtual surface lights into simulations, while the present one goes on.

use crate::{
    cancel::Cancel,
    distance_maps::{self, Map},
    simulation::Simulation,
};
use photonstream_scene::Scene;
use std::sync::Arc;

/// A scene to be made ready.
pub(super) struct Order {
    /// The simulation in whose place it comes.
    pub(super) base: Simulation,
    pub(super) scene: Arc<Scene>,
    /// It is that of a config, which may come again.
    pub(super) is_kept: bool,
    /// The numbers of lights on the surfaces of `base`; `None`: place all lights anew.
    pub(super) shares: Option<Vec<u32>>,
    pub(super) cancel: Cancel,
}

/// A scene made ready.
pub(super) struct Placed {
    pub(super) simulation: Simulation,
    /// The lights were to move.
    pub(super) moved: Option<Moved>,
}

/// Lights that have moved, of which most are those of the base.
pub(super) struct Moved {
    /// The number that each light of the base has now; `None` where it has come to rest before, and only lights that had
    /// faded out are gone.
    pub(super) numbers: Option<Vec<u32>>,
    /// Distance maps of lights that the base does not have, by number.
    pub(super) maps: Vec<(u32, Map)>,
    /// As these are seen.
    pub(super) scene: Arc<Scene>,
}

/// Follows orders until nobody gives any, or takes the result; the answer to a cancelled one is `None`.
pub(super) fn run(orders: &flume::Receiver<Order>, placed: &flume::Sender<Option<Box<Placed>>>) {
    while let Ok(order) = orders.recv() {
        // On threads of its own: the ledger's work, which shares those of the process, does not wait behind it.
        let ready = match rayon::ThreadPoolBuilder::new().build() {
            Ok(threads) => threads.install(|| order.follow()),
            Err(error) => {
                tracing::debug!("lights are placed on the threads of the process: {error}");
                order.follow()
            }
        };
        if placed.send(ready.map(Box::new)).is_err() {
            return;
        }
    }
}

impl Order {
    fn follow(self) -> Option<Placed> {
        let Self { base, scene, shares, is_kept, cancel } = self;
        // An animation may have changed a mesh since the shares were chosen.
        let Some(shares) = shares.filter(|_| base.has_lights_of(&scene)) else {
            let simulation = match is_kept {
                true => base.reloaded_and_kept_unless(scene, &cancel)?,
                false => base.reloaded_unless(scene, &cancel)?,
            };
            return Some(Placed { simulation, moved: None });
        };
        let base = base.with_scene(Arc::clone(&scene));
        if base.placement.shares().eq(shares.iter().copied()) {
            let moved = Moved { numbers: None, maps: Vec::new(), scene };
            return Some(Placed { simulation: base.without_retiring(), moved: Some(moved) });
        }
        let next = base.with_shares_unless(&shares, &cancel)?;
        let maps = distance_maps::of_new_lights(&scene, &next.placement, &base.placement, &cancel);
        let (simulation, numbers) = next.with_retiring(&base);
        cancel.or(Placed { simulation, moved: Some(Moved { numbers: Some(numbers), maps, scene }) })
    }
}
