//! Turns owners of surface points into the area that each virtual surface light owns.

use crate::{owner::OwnerTable, vsl::Surface};
use photonstream_scene::Scene;
use photonstream_shading::{sampling, surface};
use rayon::prelude::*;
use std::ops::Range;

/// Points a triangle is sampled with for each cell of its owner table: about 32 for each light.
const POINTS_PER_CELL: u32 = 4;

/// The area of each light's Voronoi cell in m², in the order of the lights; each triangle's area is split among the
/// owners of a stratified grid of points on it, so that the areas of a surface sum to its own.
pub(super) fn of_voronoi_cells(
    scene: &Scene,
    surfaces: &[(Surface, Range<u32>)],
    owners: &OwnerTable,
) -> Vec<f64> {
    let per_surface: Vec<Vec<f64>> = surfaces
        .par_iter()
        .map(|(on, vsls)| {
            let mut areas = vec![0.0; vsls.len()];
            for triangle in scene.objects[on.object.0 as usize].triangles.clone() {
                let area = surface::area(scene.geometry.rest_triangle(triangle));
                let cells = owners.cells(triangle, on.side);
                let side = f64::from(cells * POINTS_PER_CELL).sqrt().ceil() as u32;
                let share = area / f64::from(side * side);
                for index in 0..side * side {
                    let square = [index % side, index / side].map(|x| (x as f32 + 0.5) / side as f32);
                    let [u, v] = sampling::triangle(square);
                    if let Some(owner) = owners.owner(triangle, on.side, u, v) {
                        areas[(owner.0 - vsls.start) as usize] += share;
                    }
                }
            }
            areas
        })
        .collect();
    per_surface.concat()
}
