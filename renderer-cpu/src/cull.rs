//! Turns all virtual surface lights into the few that can light a tile, packed for the gathering loop.

use crate::tile::Tile;
use core::f32::consts::PI;
use glam::Vec3;
use photonstream_renderer::{Patch, VslSet};
use photonstream_shading::kernel::{Kernel, range_sq};

/// A virtual surface light as the gathering loop reads it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emitter {
    pub(crate) position: Vec3,
    /// The negated normal: cos θ_s is its product with the vector *to* the light.
    pub(crate) inverse_normal: Vec3,
    pub(crate) flux: Vec3,
    /// What the kernel adds to π r², in m².
    pub(crate) area_term: f32,
    /// Beyond this squared distance the light is skipped.
    pub(crate) range_sq: f32,
    /// Bound of the radiance that it adds, times r².
    pub(crate) bound: f32,
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
    /// Sum over receivers of the upper bounds of what was skipped with whole tiles, in W m⁻² sr⁻¹.
    pub(crate) skipped: f64,
}

/// What is the same for every tile of a picture.
pub(crate) struct Culling {
    pub(crate) kernel: Kernel,
    pub(crate) epsilon: f32,
    /// Largest reflectance in the scene.
    pub(crate) albedo_max: f32,
    /// Largest coordinate in the scene, in metres.
    pub(crate) magnitude: f32,
}

impl Culling {
    /// Selects into `selection` the lights of `vsls` that can light `tile`.
    ///
    /// A light is left out if it is dark, if the whole tile lies behind it (within the rounding of positions: a light
    /// adds nothing to its own plane), or if the tile is beyond its range.
    pub(crate) fn select(&self, vsls: &VslSet, tile: &Tile, selection: &mut Selection) {
        selection.near.clear();
        selection.partial.clear();
        selection.patched.clear();
        selection.skipped = 0.0;
        if tile.receivers == 0 {
            return;
        }
        let on_plane = 4.0 * f32::EPSILON * self.magnitude;
        for index in 0..vsls.len() {
            let (position, normal, flux) = (vsls.position()[index], vsls.normal()[index], vsls.flux()[index]);
            let flux_max = flux.max_element();
            let (lo, hi) = (tile.lo - position, tile.hi - position);
            let highest = (normal * lo).max(normal * hi).element_sum();
            if flux_max == 0.0 || highest <= on_plane {
                continue;
            }
            let range_sq = range_sq(flux_max, self.albedo_max, self.epsilon);
            let nearest_sq = (lo.max(Vec3::ZERO) - hi.min(Vec3::ZERO)).length_squared();
            let bound = flux_max * self.albedo_max / (PI * PI);
            if nearest_sq > range_sq {
                selection.skipped += f64::from(bound / nearest_sq) * tile.receivers as f64;
                continue;
            }
            let emitter = Emitter {
                position,
                inverse_normal: -normal,
                flux,
                area_term: self.kernel.area_term(vsls.area()[index]),
                range_sq,
                bound,
            };
            if let Some(patch) = vsls.patch(index).filter(|p| self.kernel.is_near(nearest_sq, p.area)) {
                selection.patched.push((emitter, *patch));
                continue;
            }
            let farthest_sq = lo.abs().max(hi.abs()).length_squared();
            // A tile that ends just at the range, within rounding, is treated pixel by pixel.
            if farthest_sq < range_sq * (1.0 - 1e-5) {
                selection.near.push(emitter);
            } else {
                selection.partial.push(emitter);
            }
        }
    }
}
