//! Turns a scene's surfaces into virtual surface lights, spread as evenly as paper A's Algorithm 1 makes them.
//!
//! Each reflecting side of each object gets its share of the lights by area, at least one. Points are drawn on shrunken
//! triangles, more than needed; then the one whose two closest neighbours are closest is removed until the share is
//! met. Source: paper A §0.4.2, Algorithm 1. Deviates: the smallest pair of distances comes from a heap whose entries
//! are renewed when they surface, which is exact since distances only grow while points are removed, and neighbours
//! come from an R*-tree: O(n log n) instead of O(n) a removal; more points are drawn than paper A's 10 % more, see [`OVERSAMPLING`];
//! and triangles shrink less where lights are dense.

mod draw;
mod share;
mod thin;

use crate::{
    cancel::Cancel,
    owner::OwnerTable,
    patch::{self, Patch},
    vsl::{Surface, Vsl},
};
use photonstream_scene::Scene;
use rayon::prelude::*;
use std::ops::Range;

/// How many points are drawn for each that stays. Paper A draws 1.1; 2 lower the relative RMSE of indirect light by 2 to
/// 7 % at 200 to 4 000 lights on the Cornell box, and 4 bring nothing more.
pub const OVERSAMPLING: f64 = 2.0;

/// The virtual surface lights of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// All lights, ordered by surface.
    pub vsls: Vec<Vsl>,
    /// The lights of each surface, ordered by surface.
    pub surfaces: Vec<(Surface, Range<u32>)>,
    /// The polygon of each light; empty until [`Placement::measure_areas`].
    pub patches: Vec<Patch>,
}

impl Placement {
    /// Places `scene.streaming.vsls` lights, more where there are more surfaces than that; the same for the same seed on
    /// any number of threads. An empty scene gets none.
    ///
    /// The lights' areas are zero until [`Placement::measure_areas`].
    pub fn new(scene: &Scene) -> Self {
        let settings = &scene.streaming;
        Self::with(scene, settings.vsls, settings.seed, settings.placement_scale, OVERSAMPLING)
    }

    /// [`Placement::new`], or `None` soon after it was cancelled.
    pub fn new_unless(scene: &Scene, cancel: &Cancel) -> Option<Self> {
        let settings = &scene.streaming;
        let scale = settings.placement_scale;
        cancel.or(Self::place(scene, settings.vsls, settings.seed, scale, OVERSAMPLING, cancel))
    }

    /// [`Placement::new`] with all parameters given: the number of lights, the seed, the scale of triangles about their
    /// centroid, and the points drawn for each that stays.
    pub fn with(scene: &Scene, vsls: u32, seed: u64, triangle_scale: f32, oversampling: f64) -> Self {
        Self::place(scene, vsls, seed, triangle_scale, oversampling, &Cancel::default())
    }

    /// Too many lights where it was cancelled.
    fn place(
        scene: &Scene,
        vsls: u32,
        seed: u64,
        triangle_scale: f32,
        oversampling: f64,
        cancel: &Cancel,
    ) -> Self {
        let shares = share::by_area(scene, vsls);
        let placed: Vec<Vec<Vsl>> = shares
            .par_iter()
            .map(|share| {
                let drawn = (f64::from(share.vsls) * oversampling).ceil() as u32;
                let points = draw::points(scene, share.surface, share.vsls, drawn, seed, triangle_scale);
                thin::to(&scene.geometry, points, share.vsls as usize, cancel)
            })
            .collect();
        let mut surfaces = Vec::with_capacity(shares.len());
        let mut vsls = Vec::with_capacity(placed.iter().map(Vec::len).sum());
        for (share, placed) in shares.iter().zip(placed) {
            let first = vsls.len() as u32;
            vsls.extend(placed);
            surfaces.push((share.surface, first..vsls.len() as u32));
        }
        Self { vsls, surfaces, patches: Vec::new() }
    }

    /// Gives each light the area of its Voronoi cell on its surface, the set of points that it owns, and the polygon that
    /// stands for it.
    ///
    /// The areas of a surface's lights sum to its area.
    pub fn measure_areas(&mut self, scene: &Scene, owners: &OwnerTable) {
        let cells = patch::of_voronoi_cells(scene, self, owners);
        for (vsl, (area, _)) in self.vsls.iter_mut().zip(&cells) {
            vsl.area = *area as f32;
        }
        self.patches = cells.into_iter().map(|(_, patch)| patch).collect();
    }
}
