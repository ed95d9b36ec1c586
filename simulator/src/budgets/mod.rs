//! Turns the light that leaves each surface into its number of virtual surface lights.
//!
//! A light stands for a patch of diameter h = √(A/n) that emits Φ/n watts, where n lights share a surface of area A and flux
//! Φ. What it does wrong elsewhere is in proportion to Φ/n · h, and independent of what others do wrong: n lights err by
//! Φ √A / n. The sum of squares over all surfaces is least, for a given number of lights, where n is in proportion to
//! (Φ² A)^⅓: where lights lie as dense as the radiosity to the power of ⅔. Of Φ only that counts which reaches another
//! surface: a roof in the sun lights nobody.
//!
//! Nothing of this depends on a camera: there may be several, or none.

mod density;

pub(crate) use density::Densities;

use crate::{apportion::apportion, placement::Placement};
use photonstream_scene::{ObjectId, Scene};
use photonstream_shading::surface;

/// Lights lie at most so many times as dense as their mean, and at least that part of it: where it is dark now, light may
/// come.
pub const MOST_TIMES: f64 = 8.0;

/// Lights move where that takes this share off the error.
const LEAST_GAIN: f64 = 0.05;

/// The area of each side of an object in m²; objects do not change it by moving.
pub(crate) fn area(scene: &Scene, object: ObjectId) -> f64 {
    let triangles = scene.objects[object.0 as usize].triangles.clone();
    triangles.map(|t| surface::area(scene.geometry.rest_triangle(t))).sum()
}

/// The numbers of lights of a placement's surfaces, as they are and as they should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Budgets {
    /// As they are.
    pub present: Vec<u32>,
    /// As they should be; the same sum.
    pub wanted: Vec<u32>,
    /// The share of the error that goes if they become so, in [0, 1): of the model at the head of this file.
    pub gain: f64,
}

impl Budgets {
    /// Of a placement from whose surfaces `reaching` watts reach others, in their order. Without any light, all is well.
    pub fn new(scene: &Scene, placement: &Placement, reaching: &[f64]) -> Self {
        let areas: Vec<f64> = placement.surfaces.iter().map(|(on, _)| area(scene, on.object)).collect();
        let present: Vec<u32> = placement.shares().collect();
        let lights: u32 = present.iter().sum();
        let wanted = match densities(&areas, reaching) {
            Some(densities) => {
                let weights: Vec<f64> = areas.iter().zip(densities).map(|(area, d)| area * d).collect();
                apportion(&weights, lights)
            }
            None => present.clone(),
        };
        let error = |shares: &[u32]| error(&areas, reaching, shares);
        let before = error(&present);
        let gain = if before > 0.0 { 1.0 - error(&wanted) / before } else { 0.0 };
        Self { present, wanted, gain }
    }

    /// What is wanted, where that is worth moving lights for.
    pub fn next(&self) -> Option<&[u32]> {
        (self.gain > LEAST_GAIN).then_some(&*self.wanted)
    }
}

/// How dense lights should lie on each surface, relative to the mean over their area; `None` where no light is.
fn densities(areas: &[f64], reaching: &[f64]) -> Option<Vec<f64>> {
    let raw: Vec<f64> = areas
        .iter()
        .zip(reaching)
        .map(|(&area, &watts)| if area > 0.0 { (watts / area).powf(2.0 / 3.0) } else { 0.0 })
        .collect();
    let sum: f64 = raw.iter().zip(areas).map(|(density, area)| density * area).sum();
    let mean = sum / areas.iter().sum::<f64>();
    (mean.is_normal() && mean > 0.0)
        .then(|| raw.iter().map(|density| (density / mean).clamp(1.0 / MOST_TIMES, MOST_TIMES)).collect())
}

/// The error of the model, in W m: √Σ Φ² A / n².
fn error(areas: &[f64], reaching: &[f64], shares: &[u32]) -> f64 {
    let surfaces = areas.iter().zip(reaching).zip(shares);
    surfaces.map(|((area, watts), &n)| watts * watts * area / f64::from(n).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn budgets(areas: &[f64], reaching: &[f64], lights: u32) -> Budgets {
        let present = apportion(areas, lights);
        let wanted = densities(areas, reaching).map_or(present.clone(), |densities| {
            let weights: Vec<f64> = areas.iter().zip(densities).map(|(a, d)| a * d).collect();
            apportion(&weights, lights)
        });
        let before = error(areas, reaching, &present);
        let gain = if before > 0.0 { 1.0 - error(areas, reaching, &wanted) / before } else { 0.0 };
        Budgets { present, wanted, gain }
    }

    /// Two surfaces of equal area, one with eight times the light: four times as many lights, 8^⅔.
    #[test]
    fn lights_lie_as_dense_as_the_radiosity_to_the_power_of_two_thirds() {
        let two = budgets(&[3.0, 3.0], &[8.0, 1.0], 1000);
        assert_eq!(two.wanted, [800, 200]);
        // √(64/500² + 1/500²) against √(64/800² + 1/200²), times √3 each.
        let gain = 1.0 - (64.0f64 / 640_000.0 + 1.0 / 40_000.0).sqrt() / (65.0f64 / 250_000.0).sqrt();
        assert!((two.gain - gain).abs() < 1e-12, "{} instead of {gain}", two.gain);
        // Equal radiosity: as by area; and what is dark keeps some.
        assert_eq!(budgets(&[3.0, 1.0], &[6.0, 2.0], 100).wanted, [75, 25]);
        assert_eq!(budgets(&[1.0, 1.0], &[1.0, 0.0], 170).wanted, [160, 10]);
    }

    #[test]
    fn lights_without_light_and_small_gains_stay() {
        let dark = budgets(&[1.0, 2.0], &[0.0, 0.0], 30);
        assert_eq!((dark.next(), dark.gain), (None, 0.0));
        let little = budgets(&[1.0, 1.0], &[1.0, 1.2], 1000);
        assert!(little.gain > 0.0 && little.next().is_none());
        assert!(budgets(&[1.0, 1.0], &[1.0, 9.0], 1000).next().is_some());
    }

    proptest! {
        /// Whatever the light: no virtual surface light gets lost, and no surface goes without.
        #[test]
        fn shares_are_whole(
            surfaces in prop::collection::vec((0.01f64..1e3, 0.0f64..1e3), 1..60),
            lights in 1u32..5000,
        ) {
            let (areas, reaching): (Vec<f64>, Vec<f64>) = surfaces.into_iter().unzip();
            let Budgets { present, wanted, gain } = budgets(&areas, &reaching, lights);
            prop_assert_eq!(wanted.iter().sum::<u32>(), present.iter().sum::<u32>());
            prop_assert!(wanted.iter().all(|&n| n >= 1) && gain < 1.0);
                    }
    }
}
