//! Turns all virtual surface lights into the few that can light a tile, packed for the gathering loop.

use crate::tile::Tile;
use core::f32::consts::PI;
use glam::Vec3;
use photonstream_renderer::{Patch, VslSet};
use photonstream_shading::{
    culling,
    kernel::{Kernel, range_sq},
};

/// A virtual surface light as the gathering loop reads it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emitter {
    pub(crate) position: Vec3,
    /// The negated normal: cos θ_s is its product with the vector *to* the light.
    pub(crate) inverse_normal: Vec3,
    pub(crate) flux: Vec3,
    /// Its number.
    pub(crate) index: u32,
    /// What the kernel adds to π r², in m².
    pub(crate) area_term: f32,
    /// Beyond this squared distance the light is skipped: its range, or the one it has drawn.
    pub(crate) range_sq: f32,
    /// What it adds is multiplied by this times r² where that is more than 1, in m⁻²; 0 where it has drawn no range.
    pub(crate) weight_slope: f32,
    /// Bound of the radiance that is lost beyond the range, times r²; 0 where it has drawn the range: nothing is.
    pub(crate) bound: f32,
}

impl Emitter {
    /// What it adds at a squared distance of `r_sq` m², within its range, is multiplied by this.
    #[inline]
    pub(crate) fn weight(&self, r_sq: f32) -> f32 {
        (r_sq * self.weight_slope).max(1.0)
    }
}

/// The lights that can reach a tile.
#[derive(Default)]
pub(crate) struct Selection {
    /// Lights whose range holds the whole tile.
    pub(crate) near: Vec<Emitter>,
    /// Lights whose range ends within the tile.
    pub(crate) partial: Vec<Emitter>,
    /// Lights whose polygons some of the tile may see.
    pub(crate) patched: Vec<(Emitter, Patch)>,
    /// Whether lights have drawn their ranges by lot.
    pub(crate) by_lot: bool,
    /// Sum over receivers of the upper bounds of what was skipped with whole tiles, in W m⁻² sr⁻¹.
    pub(crate) skipped: f64,
    /// Sum over receivers of the upper bounds of the variance that lots bring, in (W m⁻² sr⁻¹)².
    pub(crate) variance: f64,
}

/// What is the same for every tile of a picture.
pub(crate) struct Culling {
    pub(crate) kernel: Kernel,
    pub(crate) epsilon: f32,
    /// Whether lights beyond their range are drawn by lot.
    pub(crate) stochastic: bool,
    /// Largest reflectance in the scene.
    pub(crate) albedo_max: f32,
    /// Largest coordinate in the scene, in metres.
    pub(crate) magnitude: f32,
}

impl Culling {
    /// Selects into `selection` the lights of `vsls` that can light `tile`.
    ///
    /// A light is left out if it is dark, if the whole tile lies behind it (within the rounding of positions: a light
    /// adds nothing to its own plane), or if the tile is beyond its range or the one that it has drawn, for which the lots
    /// of the lights begin at `first_lot`.
    pub(crate) fn select(&self, vsls: &VslSet, tile: &Tile, first_lot: u32, selection: &mut Selection) {
        selection.near.clear();
        selection.partial.clear();
        selection.patched.clear();
        let by_lot = self.stochastic && self.epsilon > 0.0;
        (selection.skipped, selection.variance, selection.by_lot) = (0.0, 0.0, by_lot);
        if tile.receivers == 0 {
            return;
        }
        let flux_of_range = if by_lot { culling::flux_of_range(self.albedo_max, self.epsilon) } else { 0.0 };
        let mut variances = 0.0;
        let on_plane = 4.0 * f32::EPSILON * self.magnitude;
        for index in 0..vsls.len() {
            let (position, normal, flux) = (vsls.position()[index], vsls.normal()[index], vsls.flux()[index]);
            let flux_max = flux.max_element();
            let (lo, hi) = (tile.lo - position, tile.hi - position);
            let highest = (normal * lo).max(normal * hi).element_sum();
            if flux_max == 0.0 || highest <= on_plane {
                continue;
            }
            let certain_sq = range_sq(flux_max, self.albedo_max, self.epsilon);
            let nearest_sq = (lo.max(Vec3::ZERO) - hi.min(Vec3::ZERO)).length_squared();
            let farthest_sq = lo.abs().max(hi.abs()).length_squared();
            let (mut range_sq, mut bound) = (certain_sq, flux_max * self.albedo_max / (PI * PI));
            if by_lot {
                variances += f64::from(culling::greatest_variance(certain_sq, nearest_sq, farthest_sq));
                (range_sq, bound) = (certain_sq / culling::lot(index as u32, first_lot), 0.0);
            }
            if nearest_sq > range_sq {
                selection.skipped += f64::from(bound / nearest_sq) * tile.receivers as f64;
                continue;
            }
            let emitter = Emitter {
                position,
                inverse_normal: -normal,
                flux,
                index: index as u32,
                area_term: self.kernel.area_term(vsls.area()[index]),
                range_sq,
                weight_slope: culling::weight_slope(flux_max, flux_of_range),
                bound,
            };
            if let Some(patch) = vsls.patch(index).filter(|p| self.kernel.is_near(nearest_sq, p.area)) {
                selection.patched.push((emitter, *patch));
                continue;
            }
            // A tile that ends just at the range, within rounding, is treated pixel by pixel.
            if farthest_sq < certain_sq * (1.0 - 1e-5) {
                selection.near.push(emitter);
            } else {
                selection.partial.push(emitter);
            }
        }
        selection.variance =
            variances * f64::from(self.epsilon) * f64::from(self.epsilon) * tile.receivers as f64;
    }
}
