//! Turns what the paths in the pool have left into a better split of the pool among the lights.

use super::{Ledger, Migration};
use crate::{simulation::Simulation, split};
use photonstream_scene::Scene;

/// From fewer paths little is learnt about all of them.
const LEAST_PATHS: u32 = 1024;

impl Ledger {
    /// The number of slots of each light by which the variance of all flux together becomes smaller by so much that paths
    /// are worth moving for it, as measured from the paths there are; `None` where there is no such split, or too few
    /// paths are there.
    pub fn better_split(&self, scene: &Scene) -> Option<Vec<u32>> {
        let paths: u32 = self.pool.valid().iter().sum();
        if paths < LEAST_PATHS {
            return None;
        }
        let scales = self.scales(scene);
        let errors = self.pool.flux().errors(self.refinement.flux(), &scales);
        let of_path = errors.variances.iter().zip(&scales).map(|(v, scale)| v * f64::from(scale.paths));
        split::by_variance(scene, &self.emitters, &of_path.collect::<Vec<_>>())
    }

    /// Goes on with the pool split as in `new`, the same version of the scene as `old`: each light keeps its first paths.
    pub fn resplit(self, old: &Simulation, new: &Simulation) -> Self {
        let savings = self.savings;
        let mut next = self.migrate(&Migration::between(old, new), new, None);
        // Nothing has changed for which paths would have had to be traced again.
        next.savings = savings;
        next
    }
}
