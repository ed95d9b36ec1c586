//! Turns the distances between VPLs into the areas that they stand for.

use crate::vpl::Vpl;
use core::f32::consts::PI;

/// Sets the weights of all VPLs so that each stands for a disc that reaches half way to the closest other one:
/// w a = π (d_min/2)², with `area_per_weight` a in m². Time grows with the square of their number.
///
/// A VPL without another keeps its weight; where two stand in one place, neither has an area.
///
/// Source: paper B §5.1; §4.1 mentions the whole d_min as radius, which lets neighbours overlap.
pub fn automatic_weights(vpls: &mut [Vpl], area_per_weight: f32) {
    for i in 0..vpls.len() {
        let mut nearest_sq = f32::INFINITY;
        for j in 0..vpls.len() {
            if let Some(distance_sq) = distance_sq(vpls, i, j) {
                nearest_sq = nearest_sq.min(distance_sq);
            }
        }
        set_weight(&mut vpls[i], nearest_sq, area_per_weight);
    }
}

/// The same a little at a time, for VPLs that move: one comparison for each call.
///
/// It belongs to its set of VPLs, not to a light, and is stepped once for each update of the set whatever the number
/// of lights. N VPLs that stand still have the weights of [`automatic_weights`], bit for bit, after N² steps from the
/// beginning of a pass, and after [`AmortisedWeights::steps_until_whole`] where they have moved in the middle of one.
///
/// Source: paper B §5.1.
#[derive(Clone, Debug)]
pub struct AmortisedWeights {
    current: usize,
    other: usize,
    nearest_sq: f32,
}

impl Default for AmortisedWeights {
    fn default() -> Self {
        Self::new()
    }
}

impl AmortisedWeights {
    /// At the beginning of a pass.
    pub const fn new() -> Self {
        Self { current: 0, other: 0, nearest_sq: f32::INFINITY }
    }

    /// Steps after which `vpls` VPLs that stand still from now on have the weights of [`automatic_weights`]: N², and before
    /// them what is left of a comparison that has begun, at most N − 1.
    pub const fn steps_until_whole(&self, vpls: usize) -> usize {
        let begun = self.other > 0 && self.other < vpls && self.current < vpls;
        vpls * vpls + if begun { vpls - self.other } else { 0 }
    }

    /// Compares one pair of VPLs; at each N-th step one weight is set. A set that has become shorter starts anew.
    pub fn step(&mut self, vpls: &mut [Vpl], area_per_weight: f32) {
        if self.current >= vpls.len() || self.other >= vpls.len() {
            *self = Self::new();
        }
        if vpls.is_empty() {
            return;
        }
        if let Some(distance_sq) = distance_sq(vpls, self.current, self.other) {
            self.nearest_sq = self.nearest_sq.min(distance_sq);
        }
        self.other += 1;
        if self.other == vpls.len() {
            set_weight(&mut vpls[self.current], self.nearest_sq, area_per_weight);
            *self = Self { current: (self.current + 1) % vpls.len(), ..Self::new() };
        }
    }
}

/// Square of the distance of two VPLs in m²; none of one to itself.
#[inline]
fn distance_sq(vpls: &[Vpl], i: usize, j: usize) -> Option<f32> {
    (i != j).then(|| vpls[i].position.distance_squared(vpls[j].position))
}

#[inline]
fn set_weight(vpl: &mut Vpl, nearest_sq: f32, area_per_weight: f32) {
    let weight = PI * 0.25 * nearest_sq / area_per_weight;
    if weight.is_finite() {
        vpl.weight = weight;
    }
}

#[cfg(test)]
mod tests;
