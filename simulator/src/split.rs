//! Turns the powers of lights, and how much their paths differ, into the number of paths that each gets.
//!
//! The flux of all lights together has the least variance where a light's paths are in proportion to its power times the
//! standard deviation of what one of them deposits: Neyman's allocation. What is measured is kept within bounds around
//! the split by power, so that no light starves that happened to leave little.

use crate::{
    apportion::apportion,
    emitters::{Emitters, watts},
    simulation::Simulation,
    tracer::Tracer,
};
use photonstream_scene::Scene;
use photonstream_shading::tone::luminance;
use std::sync::Arc;

/// The least share of the pool that a light gets, relative to an equal split: dark lights can be switched on, and their
/// paths must be there then.
const LEAST_SHARE: f64 = 1.0 / 16.0;

/// A light gets at most so many times what it would by power, and at least that part of it.
pub const MOST_TIMES: f64 = 4.0;

/// A split is not worth moving paths for if it takes less than this share off the variance. Measured deviations differ by
/// less than that from one split to the next, so that the first one stays.
const LEAST_GAIN: f64 = 0.1;

/// Shares of the pool by emitted power; the sum is 1, or a little more where dark lights get their least.
fn shares_by_power(scene: &Scene) -> Vec<f64> {
    let watts: Vec<f64> = watts(scene).into_iter().map(|w| f64::from(luminance(w))).collect();
    let total: f64 = watts.iter().sum();
    let equal = 1.0 / watts.len() as f64;
    let share = |w: &f64| if total > 0.0 { (w / total).max(equal * LEAST_SHARE) } else { equal };
    watts.iter().map(share).collect()
}

/// Splits `scene.streaming.pool_paths` slots by emitted power; at least one for each light.
pub(crate) fn by_power(scene: &Scene) -> Vec<u32> {
    apportion(&shares_by_power(scene), scene.streaming.pool_paths)
}

/// Splits the slots of `emitters` by measured variance, too; `variances` are those of the flux of each column that one of
/// its paths says, in W². `None` where the present split is about as good.
///
/// Lights that share a column keep their slots: a path's weight there is that of its light's share.
pub(crate) fn by_variance(scene: &Scene, emitters: &Emitters, variances: &[f64]) -> Option<Vec<u32>> {
    let mut slots = emitters.slot_counts();
    let own: Vec<usize> = (0..slots.len())
        .filter(|&light| emitters.columns[emitters.lights[light].column as usize].shared_watts.is_none())
        .collect();
    let variance = |light: usize| variances[emitters.lights[light].column as usize];
    let by_power = shares_by_power(scene);
    let (deviations, powers): (Vec<f64>, Vec<f64>) =
        own.iter().map(|&light| (variance(light).sqrt(), by_power[light])).unzip();
    let total = own.iter().map(|&light| slots[light]).sum();
    let next = apportion(&within_bounds(&deviations, &powers), total);
    let of_split = |slots: &mut dyn Iterator<Item = u32>| -> f64 {
        slots.zip(&own).map(|(slots, &light)| variance(light) / f64::from(slots.max(1))).sum()
    };
    let shared: f64 = emitters
        .columns
        .iter()
        .zip(variances)
        .filter(|(column, _)| column.shared_watts.is_some())
        .map(|(column, variance)| variance / f64::from(column.slots.max(1)))
        .sum();
    let before = shared + of_split(&mut own.iter().map(|&light| slots[light]));
    let after = shared + of_split(&mut next.iter().copied());
    if after >= (1.0 - LEAST_GAIN) * before {
        return None;
    }
    for (&light, next) in own.iter().zip(next) {
        slots[light] = next;
    }
    Some(slots)
}

/// Shares in proportion to `deviations` where that is within the bounds around the shares by power, and at the bound
/// where it is not.
fn within_bounds(deviations: &[f64], powers: &[f64]) -> Vec<f64> {
    let total: f64 = powers.iter().sum();
    let least = LEAST_SHARE / powers.len().max(1) as f64;
    let at = |scale: f64| -> Vec<f64> {
        let bounded = |(deviation, power): (&f64, &f64)| {
            let power = power / total;
            (scale * deviation).clamp((power / MOST_TIMES).max(least.min(power)), power * MOST_TIMES)
        };
        deviations.iter().zip(powers).map(bounded).collect()
    };
    // Where all have reached their bound the scale no longer matters.
    let (mut low, mut high) = (0.0, f64::MAX.sqrt());
    let sum = |scale: f64| at(scale).into_iter().sum::<f64>();
    // The scale by halving its exponent's range, then its own.
    for _ in 0..200 {
        let middle = if high > 4.0 * low { (low.max(1e-150) * high).sqrt() } else { 0.5 * (low + high) };
        if sum(middle) < 1.0 { low = middle } else { high = middle }
    }
    at(high)
}

impl Simulation {
    /// The same simulation with the pool split otherwise: each light has the given number of slots.
    pub fn with_split(&self, slots: &[u32]) -> Self {
        let emitters = Arc::new(Emitters::with_slots(&self.scene, slots));
        let tracer = Tracer::new(Arc::clone(&self.scene), Arc::clone(&self.owners), Arc::clone(&emitters));
        Self { emitters, tracer, ..self.clone() }
    }

    /// The same simulation with the pool split as in `other`, where the lights and the size of the pool are the same.
    pub fn with_split_of(self, other: &Self) -> Self {
        let names = |scene: &Scene| scene.lights.iter().map(|light| light.name.clone()).collect::<Vec<_>>();
        let (scene, like) = (&self.scene, &other.scene);
        let are_streamed = self.is_streaming() && other.is_streaming();
        let is_alike = are_streamed
            && names(scene) == names(like)
            && scene.streaming.pool_paths == like.streaming.pool_paths;
        let slots = other.emitters.slot_counts();
        if is_alike && slots != self.emitters.slot_counts() { self.with_split(&slots) } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn shares_follow_deviations_within_bounds() {
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close(&within_bounds(&[1.0, 3.0], &[0.5, 0.5]), &[0.25, 0.75]));
        // Neither less than a quarter of the share by power, nor more than four times it.
        assert!(close(&within_bounds(&[0.0, 3.0], &[0.8, 0.2]), &[0.2, 0.8]));
        assert!(close(&within_bounds(&[1.0, 99.0], &[0.9, 0.1]), &[0.6, 0.4]));
        assert!(close(&within_bounds(&[5.0, 5.0, 5.0], &[1.0, 1.0, 1.0]), &[1.0 / 3.0; 3]));
    }

    proptest! {
        /// Whole shares, all of them within the bounds, whatever is measured: to 1e-6, the rounding of sums of f64.
        #[test]
        fn nobody_starves(lights in prop::collection::vec((0.0f64..1e3, 0.01f64..10.0), 1..12)) {
            let (deviations, powers): (Vec<f64>, Vec<f64>) = lights.into_iter().unzip();
            let shares = within_bounds(&deviations, &powers);
            let total: f64 = powers.iter().sum();
            for (share, power) in shares.iter().zip(&powers) {
                let times = share / (power / total);
                prop_assert!((1.0 / MOST_TIMES - 1e-6..=MOST_TIMES + 1e-6).contains(&times), "{times}");
            }
            let sum: f64 = shares.iter().sum();
            prop_assert!(sum <= 1.0 + 1e-6, "{sum}");
            let most: f64 = deviations
                .iter()
                .zip(&powers)
                .map(|(d, p)| p / total * if *d > 0.0 { MOST_TIMES } else { 1.0 / MOST_TIMES })
                .sum();
            prop_assert!(sum >= most.min(1.0) - 1e-6, "{sum}");
        }
    }
}
