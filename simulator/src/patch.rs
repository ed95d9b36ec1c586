//! Turns the cells of virtual surface lights into flat convex polygons with a few corners: what kernel `patch` shines from.
//!
//! A patch lies in the plane of its light's triangle: the convex hull of what the light owns, seen along the normal. On a flat
//! convex face it is the Voronoi cell itself; on a curved surface it is the cell flattened, and where a cell is not convex
//! the hull is larger. Its corners are barycentric offsets on the light's own triangle, so it moves and grows with its object.

mod hull;

use crate::{
    owner::OwnerTable,
    placement::Placement,
    vsl::{COMPATIBLE_COSINE, Surface, Vsl},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec3};
use photonstream_scene::{Geometry, Scene};
use photonstream_shading::{patch::MAX_CORNERS, surface};
use rayon::prelude::*;
use std::ops::Range;

/// Largest offset of a corner that is read from a file, in edges: these are at most 10⁹ m, and squares have to fit f32.
const MOST_OFFSET: f32 = 1e9;

/// The polygon of a virtual surface light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Patch {
    /// From the light to each corner, in units of the edges from the first vertex of its triangle to the second and third.
    corners: [[f32; 2]; MAX_CORNERS],
    /// Number of corners: 0 where no polygon could be made, else at least 3.
    count: u32,
}

impl Patch {
    /// Whether it is one that [`of_voronoi_cells`] could have made, as far as a patch alone tells.
    pub(crate) fn is_valid(&self) -> bool {
        let count = self.count as usize;
        let (used, unused) = self.corners.split_at(count.min(MAX_CORNERS));
        (count == 0 || (3..=MAX_CORNERS).contains(&count))
            && used.iter().flatten().all(|x| x.abs() <= MOST_OFFSET)
            && unused.iter().flatten().all(|x| x.to_bits() == 0)
    }

    /// The corners in the scene's space relative to the light, in m, counter-clockwise as the lit side sees them.
    pub fn corners_ws(&self, geometry: &Geometry, vsl: &Vsl) -> impl ExactSizeIterator<Item = Vec3> {
        let [a, b, c] = geometry.triangle(vsl.triangle);
        let (edge_u, edge_v) = (b - a, c - a);
        // Counted along the triangle's own normal: a lit back, or a mirrored object, sees them the other way round.
        let is_turned = edge_u.cross(edge_v).dot(vsl.normal_ws(geometry)) < 0.0;
        let (corners, count) = (self.corners, self.count as usize);
        (0..count).map(move |i| {
            let [u, v] = corners[if is_turned { count - 1 - i } else { i }];
            edge_u * u + edge_v * v
        })
    }
}

/// Area in m² and patch of the Voronoi cell of each light of `placement`, in their order; the same on any number of threads.
/// The areas of a surface's lights sum to its own in its object's rest space.
pub fn of_voronoi_cells(scene: &Scene, placement: &Placement, owners: &OwnerTable) -> Vec<(f64, Patch)> {
    let per_surface: Vec<Vec<(f64, Patch)>> = placement
        .surfaces
        .par_iter()
        .map(|(on, vsls)| on_surface(scene, placement, owners, *on, vsls.clone()))
        .collect();
    per_surface.concat()
}

fn on_surface(
    scene: &Scene,
    placement: &Placement,
    owners: &OwnerTable,
    on: Surface,
    vsls: Range<u32>,
) -> Vec<(f64, Patch)> {
    let geometry = &scene.geometry;
    let lights = &placement.vsls[vsls.start as usize..vsls.end as usize];
    let planes: Vec<Plane> = lights.iter().map(|vsl| Plane::of(geometry, vsl)).collect();
    let mut found: Vec<(f64, Vec<DVec2>)> = vec![(0.0, Vec::new()); lights.len()];
    for triangle in scene.objects[on.object.0 as usize].triangles.clone() {
        let corners = geometry.rest_triangle(triangle).map(DVec3::from);
        let (area, normal) =
            (surface::area(geometry.rest_triangle(triangle)), geometry.normals[triangle as usize]);
        owners.pieces(triangle, on.side, |owner, piece| {
            let local = (owner.0 - vsls.start) as usize;
            let (own_area, points) = &mut found[local];
            *own_area += share(piece) * area;
            // A light may own what no light of its direction is near: that is no part of a flat patch.
            if normal.dot(geometry.normals[lights[local].triangle as usize]) < COMPATIBLE_COSINE {
                return;
            }
            points.extend(piece.iter().map(|&[u, v]| {
                planes[local]
                    .across(corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v)
            }));
            if points.len() > MOST_POINTS {
                *points = hull::convex(std::mem::take(points));
            }
        });
    }
    let patch = |(plane, (area, points)): (Plane, (f64, Vec<DVec2>))| {
        let corners = hull::with_at_most(MAX_CORNERS, hull::convex(points));
        let mut patch = Patch::default();
        for (place, corner) in patch.corners.iter_mut().zip(&corners) {
            *place = plane.barycentric(*corner);
        }
        let is_usable = corners.len() >= 3 && patch.corners.iter().flatten().all(|x| x.is_finite());
        patch.count = if is_usable { corners.len() as u32 } else { 0 };
        (area, if is_usable { patch } else { Patch::default() })
    };
    planes.into_par_iter().zip(found).map(patch).collect()
}

/// Share of a triangle that a convex piece of it covers, from its corners in barycentric coordinates.
fn share(piece: &[[f64; 2]]) -> f64 {
    let [u0, v0] = piece[0];
    let twice = |[a, b]: [[f64; 2]; 2]| (a[0] - u0) * (b[1] - v0) - (a[1] - v0) * (b[0] - u0);
    piece[1..].array_windows().map(|&pair| twice(pair)).sum()
}

/// Points of a light that are kept before the hull of them replaces them.
pub(crate) const MOST_POINTS: usize = 64;

/// The plane of a light's triangle in its object's rest space, with the light in its origin.
struct Plane {
    origin: DVec3,
    across: [DVec3; 2],
    /// Takes a point of the plane to barycentric offsets: rows.
    inverse: [DVec2; 2],
}

impl Plane {
    fn of(geometry: &Geometry, vsl: &Vsl) -> Self {
        let corners = geometry.rest_triangle(vsl.triangle);
        let [a, b, c] = corners.map(DVec3::from);
        let (edge_u, edge_v) = (b - a, c - a);
        let along = edge_u.normalize_or_zero();
        let up = edge_u.cross(edge_v).normalize_or_zero().cross(along);
        let (u, v) = (DVec2::new(edge_u.length(), 0.0), DVec2::new(edge_v.dot(along), edge_v.dot(up)));
        let determinant = u.x * v.y;
        let inverse = [DVec2::new(v.y, -v.x) / determinant, DVec2::new(0.0, u.x) / determinant];
        let origin = surface::point(corners, vsl.barycentric[0], vsl.barycentric[1]).into();
        Self { origin, across: [along, up], inverse }
    }

    fn across(&self, point: DVec3) -> DVec2 {
        let d = point - self.origin;
        DVec2::new(d.dot(self.across[0]), d.dot(self.across[1]))
    }

    fn barycentric(&self, point: DVec2) -> [f32; 2] {
        self.inverse.map(|row| row.dot(point) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;
    use photonstream_scene::SceneConfig;
    use std::{path::Path, sync::Arc};

    fn simulation(text: &str) -> Simulation {
        let text =
            format!("[camera]\nposition_m = [0, 0, 9]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n{text}");
        let scene = SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap();
        Simulation::new(Arc::new(scene))
    }

    fn area(corners: &[Vec3], normal: Vec3) -> f32 {
        let mut sum = Vec3::ZERO;
        for (i, corner) in corners.iter().enumerate() {
            sum += corner.cross(corners[(i + 1) % corners.len()]);
        }
        0.5 * sum.dot(normal)
    }

    /// On flat convex faces the patches are the Voronoi cells: they tile each face, whatever the side and the object's
    /// scale, turn, mirror; each holds its light. A box of 1 × 2 × 0.5 m and a quad lit on its back; 300 lights.
    #[test]
    fn patches_tile_flat_faces() {
        let text = |more: &str| {
            format!(
                "[material.m]\nalbedo = [0.5, 0.5, 0.5]\n[object.box]\nmaterial = \"m\"\n{more}\nbox = {{ size_m = [1, 2, 0.5] }}\n\
                 [object.quad]\nmaterial = \"m\"\nposition_m = [3, 0, 0]\nquad = {{ corner_m = [0, 0, 0], edge_u_m = [1, 0, 0], \
                 edge_v_m = [0, 1, 0] }}\n[light.l]\npower_w = 1\npoint = {{ position_m = [0, 5, 0] }}\n[streaming]\nvsls = 300\n"
            )
        };
        for more in ["", "rotation_deg = [20, 30, 40]", "scale = [2, 1, 0.5]", "scale = [-1, 1, 1]"] {
            let simulation = simulation(&text(more));
            let scene = &simulation.scene;
            let patches = &simulation.placement.patches;
            assert_eq!(patches.len(), simulation.placement.vsls.len());
            let mut sums = std::collections::BTreeMap::new();
            for (patch, vsl) in patches.iter().zip(&simulation.placement.vsls) {
                let normal = vsl.normal_ws(&scene.geometry);
                let corners: Vec<Vec3> = patch.corners_ws(&scene.geometry, vsl).collect();
                assert!(corners.len() >= 3, "{more}");
                let own = area(&corners, normal);
                assert!(own > 0.0, "{more}: counter-clockwise as the lit side sees it");
                for (i, &corner) in corners.iter().enumerate() {
                    let next = corners[(i + 1) % corners.len()];
                    assert!(
                        (next - corner).cross(-corner).dot(normal) > -1e-6,
                        "{more}: the light is outside"
                    );
                    assert!(corner.dot(normal).abs() < 1e-5);
                }
                *sums.entry(vsl.surface).or_insert(0.0) += f64::from(own);
            }
            for (surface, sum) in sums {
                let triangles = scene.objects[surface.object.0 as usize].triangles.clone();
                let exact: f64 = triangles.map(|t| surface::area(scene.geometry.triangle(t))).sum();
                // Cells with more than eight corners lose some and are scaled back to their area.
                assert!((sum / exact - 1.0).abs() < 1e-4, "{more}, {surface:?}: {sum} of {exact}");
            }
        }
    }

    /// On a sphere of 100 lights patches are flattened cells: smaller than the surface by the bulge of each, by no more than
    /// a tenth in all.
    #[test]
    fn patches_of_a_sphere_are_flattened_cells() {
        let simulation = simulation(
            "[material.m]\nalbedo = [0.5, 0.5, 0.5]\n[object.ball]\nmaterial = \"m\"\nsphere = { radius_m = 1, segments = 64 }\n\
             [light.l]\npower_w = 1\npoint = { position_m = [0, 5, 0] }\n[streaming]\nvsls = 100\n",
        );
        let geometry = &simulation.scene.geometry;
        let sum: f32 = simulation
            .placement
            .patches
            .iter()
            .zip(&simulation.placement.vsls)
            .map(|(p, v)| area(&p.corners_ws(geometry, v).collect::<Vec<_>>(), v.normal_ws(geometry)))
            .sum();
        let sphere = 4.0 * core::f32::consts::PI;
        assert!(sum < sphere && sum > 0.9 * sphere, "{sum} of {sphere}");
    }
}
