//! Turns a scene's surfaces into virtual surface lights, spread as evenly as paper A's Algorithm 1 makes them.
//!
//! Each reflecting side of each object gets its share of the lights by area, at least one. Points are drawn on shrunken
//! triangles, more than needed; then the one whose two closest neighbours are closest is removed until the share is
//! met. Source: paper A §0.4.2, Algorithm 1. Deviates: the smallest pair of distances comes from a heap whose entries
//! are renewed when they surface, which is exact since distances only grow while points are removed, and neighbours
//! come from an R*-tree: O(n log n) instead of O(n) a removal; more points are drawn than paper A's 10 % more, see [`OVERSAMPLING`];
//! and triangles shrink less where lights are dense.
//!
//! Where lights move to where the light is ([`crate::budgets`]), those that stay do not stir: a surface that gets more keeps
//! all that it has, and one that gets fewer loses those with the closest neighbours.

mod draw;
mod retiring;
mod share;
mod thin;

use crate::{
    budgets::Densities,
    cancel::Cancel,
    change::has_same_mesh,
    owner::OwnerTable,
    patch::{self, Patch},
    vsl::{Surface, Vsl},
};
use photonstream_scene::Scene;
use rayon::prelude::*;
use share::Share;
use std::ops::Range;

/// How many points are drawn for each that stays. Paper A draws 1.1; 2 lower the relative RMSE of indirect light by 2 to
/// 7 % at 200 to 4 000 lights on the Cornell box, and 4 bring nothing more.
pub const OVERSAMPLING: f64 = 2.0;

/// The virtual surface lights of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Placement {
    /// All lights, ordered by surface; then those that are retiring, which own nothing.
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
        let shares = share::by_area(scene, settings.vsls, &Densities::default());
        let method = (settings.seed, settings.placement_scale, OVERSAMPLING);
        cancel.or(Self::of_shares(scene, &shares, method, cancel))
    }

    /// [`Placement::new`] with all parameters given: the number of lights, the seed, the scale of triangles about their
    /// centroid, and the points drawn for each that stays.
    pub fn with(scene: &Scene, vsls: u32, seed: u64, triangle_scale: f32, oversampling: f64) -> Self {
        let shares = share::by_area(scene, vsls, &Densities::default());
        Self::of_shares(scene, &shares, (seed, triangle_scale, oversampling), &Cancel::default())
    }

    /// Too many lights where it was cancelled.
    fn of_shares(
        scene: &Scene,
        shares: &[Share],
        (seed, triangle_scale, oversampling): (u64, f32, f64),
        cancel: &Cancel,
    ) -> Self {
        let placed = shares.par_iter().map(|share| {
            let drawn = (f64::from(share.vsls) * oversampling).ceil() as u32;
            let points = draw::points(scene, share.surface, share.vsls, drawn, seed, triangle_scale);
            (share.surface, thin::to(&scene.geometry, points, 0, share.vsls as usize, cancel))
        });
        Self::of_surfaces(placed.collect())
    }

    fn of_surfaces(placed: Vec<(Surface, Vec<Vsl>)>) -> Self {
        let mut surfaces = Vec::with_capacity(placed.len());
        let mut vsls = Vec::with_capacity(placed.iter().map(|(_, vsls)| vsls.len()).sum());
        for (surface, placed) in placed {
            let first = vsls.len() as u32;
            vsls.extend(placed);
            surfaces.push((surface, first..vsls.len() as u32));
        }
        Self { vsls, surfaces, patches: Vec::new() }
    }

    /// The number of lights of each surface, in their order.
    pub fn shares(&self) -> impl Iterator<Item = u32> {
        self.surfaces.iter().map(|(_, vsls)| vsls.end - vsls.start)
    }

    /// The same scene with other numbers of lights on its surfaces, in their order: a surface that gets more keeps all that
    /// it has, one that gets fewer loses those with the closest neighbours. `None` soon after it was cancelled.
    ///
    /// Areas are zero until [`Placement::measure_areas`], as with any new placement.
    ///
    /// # Panics
    /// If there are not as many shares as surfaces.
    pub fn with_shares_unless(&self, scene: &Scene, shares: &[u32], cancel: &Cancel) -> Option<Self> {
        assert_eq!(shares.len(), self.surfaces.len(), "one share for each surface");
        let placed = self.surfaces.par_iter().zip(shares).map(|((surface, lights), &vsls)| {
            let there = self.vsls[lights.start as usize..lights.end as usize].to_vec();
            (*surface, with_share(scene, Share { surface: *surface, vsls }, there, cancel))
        });
        cancel.or(Self::of_surfaces(placed.collect()))
    }

    /// The placement of another scene that is as dense as this one, of `before`, on what has the same name; where it has the
    /// same mesh, too, lights stay as in [`Placement::with_shares_unless`].
    pub(crate) fn followed_unless(&self, before: &Scene, scene: &Scene, cancel: &Cancel) -> Option<Self> {
        let shares = share::by_area(scene, scene.streaming.vsls, &Densities::of(before, self));
        let placed = shares.par_iter().map(|share| {
            let there = self.lights_of_same_mesh(before, scene, share.surface);
            (share.surface, with_share(scene, *share, there, cancel))
        });
        cancel.or(Self::of_surfaces(placed.collect()))
    }

    /// The lights on the surface of `before` that is called as `on` and has its mesh, on that; else none.
    fn lights_of_same_mesh(&self, before: &Scene, scene: &Scene, on: Surface) -> Vec<Vsl> {
        let new = &scene.objects[on.object.0 as usize];
        let Some(object) = before.object(&new.name) else { return Vec::new() };
        let old = &before.objects[object.0 as usize];
        let was = Surface { object, side: on.side };
        let found = self.surfaces.iter().find(|(surface, _)| *surface == was);
        let Some((_, lights)) = found.filter(|_| has_same_mesh(before, old, scene, new)) else {
            return Vec::new();
        };
        let number = |triangle: u32| triangle - old.triangles.start + new.triangles.start;
        let lights = &self.vsls[lights.start as usize..lights.end as usize];
        lights.iter().map(|vsl| Vsl { surface: on, triangle: number(vsl.triangle), ..*vsl }).collect()
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

/// So many lights as `share` says, by adding to those that are `there`, or taking from them.
fn with_share(scene: &Scene, share: Share, mut there: Vec<Vsl>, cancel: &Cancel) -> Vec<Vsl> {
    let (settings, wanted) = (&scene.streaming, share.vsls as usize);
    there.iter_mut().for_each(|light| light.area = 0.0);
    let fixed = if wanted >= there.len() { there.len() } else { 0 };
    if wanted > there.len() {
        // Where a point was drawn before, its light is in the way: it is the first to go.
        let drawn = (f64::from(share.vsls) * OVERSAMPLING).ceil() as u32;
        let scale = settings.placement_scale;
        there.extend(draw::points(scene, share.surface, share.vsls, drawn, settings.seed, scale));
    }
    thin::to(&scene.geometry, there, fixed, wanted, cancel)
}
