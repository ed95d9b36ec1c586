//! Turns placed lights into the table of their owners: for each cell the lights that can be nearest within it.

use super::{
    CROWD, Candidate, Cell, Grid, NOBODY, OwnerTable,
    choices::{Choices, Chosen, Reader},
};
use crate::{
    cancel::Cancel,
    placement::Placement,
    vsl::{COMPATIBLE_COSINE, Surface},
};
use glam::{Vec3, Vec4};
use photonstream_scene::{Geometry, Scene};
use photonstream_shading::surface;
use rayon::prelude::*;
use rstar::{RTree, primitives::GeomWithData};
use std::ops::Range;

/// Edge of a cell as a share of the mean distance between lights: smaller cells have fewer candidates and more memory.
pub(super) const CELL_PER_SPACING: f32 = 0.5;
/// Most cells along one edge of a triangle.
pub(super) const MOST_CELLS: f32 = 4096.0;
/// Triangles in one unit of parallel work.
pub(super) const TRIANGLES_PER_TASK: u32 = 1024;

impl OwnerTable {
    /// The table of `placement` on `scene`; the same on any number of threads.
    pub fn new(scene: &Scene, placement: &Placement) -> Self {
        Self::build(scene, placement, &Cancel::default()).0
    }

    /// [`OwnerTable::new`], or `None` soon after it was cancelled.
    pub fn new_unless(scene: &Scene, placement: &Placement, cancel: &Cancel) -> Option<Self> {
        cancel.or(Self::build(scene, placement, cancel).0)
    }

    /// The table, and which lights were found for its cells; with cells missing where it was cancelled.
    pub(super) fn build(scene: &Scene, placement: &Placement, cancel: &Cancel) -> (Self, Choices) {
        Self::with(scene, placement, None, cancel).expect("invariant: what is searched for is found")
    }

    /// The table of the lights that `choices` name for its cells; `None` if these cannot be of this placement.
    pub(super) fn of_choices(scene: &Scene, placement: &Placement, choices: Choices) -> Option<Self> {
        Some(Self::with(scene, placement, Some(&choices), &Cancel::default())?.0)
    }

    fn with(
        scene: &Scene,
        placement: &Placement,
        known: Option<&Choices>,
        cancel: &Cancel,
    ) -> Option<(Self, Choices)> {
        let none = Grid { first: NOBODY, columns: 0, rows: 0 };
        let mut table =
            Self { grids: vec![[none; 2]; scene.geometry.triangles.len()], cells: vec![], crowds: vec![] };
        let mut choices = Choices::default();
        for (surface, vsls) in &placement.surfaces {
            if vsls.is_empty() {
                continue;
            }
            let lights = Lights::new(&scene.geometry, placement, vsls.clone(), known.is_none());
            let triangles = scene.objects[surface.object.0 as usize].triangles.clone();
            let spacing = lights.spacing(&scene.geometry, triangles.clone());
            let starts: Vec<u32> = triangles.clone().step_by(TRIANGLES_PER_TASK as usize).collect();
            let first_task = choices.tasks();
            let parts: Vec<Option<Part>> = starts
                .into_par_iter()
                .enumerate()
                .map(|(task, start)| {
                    let end = start.saturating_add(TRIANGLES_PER_TASK).min(triangles.end);
                    let mut source = match known {
                        Some(choices) => Source::Known(choices.of_task(first_task + task)?),
                        None => Source::Search,
                    };
                    let mut part = Part::default();
                    for triangle in start..end {
                        let edge = spacing * CELL_PER_SPACING;
                        part.add_triangle(&scene.geometry, &lights, triangle, edge, &mut source, cancel)?;
                    }
                    source.is_at_its_end().then_some(part)
                })
                .collect();
            for (part, start) in parts.into_iter().zip(triangles.step_by(TRIANGLES_PER_TASK as usize)) {
                choices.append(table.append(*surface, start, part?));
            }
        }
        let is_whole = known.is_none_or(|known| known.tasks() == choices.tasks());
        is_whole.then_some((table, choices))
    }

    fn append(&mut self, surface: Surface, start: u32, part: Part) -> Chosen {
        let (first_cell, first_crowd) = (self.cells.len() as u32, self.crowds.len() as u32);
        for (offset, mut grid) in part.grids.into_iter().enumerate() {
            grid.first += if grid.columns > 0 { first_cell } else { 0 };
            self.grids[start as usize + offset][surface.side as usize] = grid;
        }
        self.cells.extend(part.cells.into_iter().map(|mut cell| {
            let crowd = cell.vsl[0] & CROWD != 0;
            cell.vsl[0] += if crowd { first_crowd } else { 0 };
            cell
        }));
        self.crowds.extend(part.crowds);
        part.chosen
    }
}

/// Where it is known from which lights can be nearest in a cell.
enum Source<'c> {
    /// From their positions.
    Search,
    /// From a search of before.
    Known(Reader<'c>),
}

impl Source<'_> {
    fn is_at_its_end(&self) -> bool {
        match self {
            Self::Search => true,
            Self::Known(reader) => reader.is_at_its_end(),
        }
    }
}

/// The lights of one surface, to be searched.
struct Lights {
    first: u32,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tree: RTree<GeomWithData<[f32; 3], u32>>,
}

impl Lights {
    fn new(geometry: &Geometry, placement: &Placement, range: Range<u32>, are_searched: bool) -> Self {
        let vsls = &placement.vsls[range.start as usize..range.end as usize];
        let positions: Vec<Vec3> = vsls.iter().map(|v| v.position_rest(geometry)).collect();
        let normals = vsls.iter().map(|v| geometry.normals[v.triangle as usize]).collect();
        let items = positions.iter().enumerate().filter(|_| are_searched);
        let items = items.map(|(i, p)| GeomWithData::new(p.to_array(), i as u32)).collect();
        Self { first: range.start, positions, normals, tree: RTree::bulk_load(items) }
    }

    fn count(&self) -> u32 {
        self.positions.len() as u32
    }

    /// The mean distance between lights: the edge of a square with a light's mean area.
    fn spacing(&self, geometry: &Geometry, triangles: Range<u32>) -> f32 {
        let area: f64 = triangles.map(|t| surface::area(geometry.rest_triangle(t))).sum();
        (area / self.positions.len() as f64).sqrt() as f32
    }

    /// All lights that can be the nearest compatible one of a point within `radius` of `centre`, with their squared
    /// distances from `centre`, nearest first.
    fn near(&self, centre: Vec3, radius: f32, normal: Vec3) -> Vec<(f32, u32)> {
        let found =
            self.nearest_first(centre, radius, |i| normal.dot(self.normals[i as usize]) >= COMPATIBLE_COSINE);
        if found.is_empty() { self.nearest_first(centre, radius, |_| true) } else { found }
    }

    fn nearest_first(&self, centre: Vec3, radius: f32, accept: impl Fn(u32) -> bool) -> Vec<(f32, u32)> {
        let mut found = Vec::new();
        let mut limit_sq = f32::INFINITY;
        for item in self.tree.nearest_neighbor_iter(centre.to_array()) {
            let distance_sq = centre.distance_squared(self.positions[item.data as usize]);
            if distance_sq > limit_sq {
                break;
            }
            if accept(item.data) {
                if found.is_empty() {
                    // At distance d from the centre, the nearest is within d + r of any point of the cell, hence
                    // within d + 2r of the centre; the factor covers the rounding of squares and roots.
                    limit_sq = (distance_sq.sqrt() + 2.0 * radius).powi(2) * 1.000_01;
                }
                found.push((distance_sq, item.data));
            }
        }
        // The tree yields equal distances in any order.
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }
}

/// The table of a run of triangles; indices count from its own start.
#[derive(Default)]
struct Part {
    grids: Vec<Grid>,
    cells: Vec<Cell>,
    crowds: Vec<Candidate>,
    chosen: Chosen,
}

impl Part {
    /// `None` if the source has no lights for it, or none that there are.
    fn add_triangle(
        &mut self,
        geometry: &Geometry,
        lights: &Lights,
        triangle: u32,
        cell_edge: f32,
        source: &mut Source<'_>,
        cancel: &Cancel,
    ) -> Option<()> {
        let [a, b, c] = geometry.rest_triangle(triangle);
        let (edge_u, edge_v) = (b - a, c - a);
        let count = |edge: Vec3| (edge.length() / cell_edge).ceil().clamp(1.0, MOST_CELLS);
        // A sliver has long edges and hardly any area: cells by its edges alone would be thousands, all but a few outside.
        let (columns, rows) = (count(edge_u), count(edge_v));
        let area = edge_u.cross(edge_v).length() / (cell_edge * cell_edge);
        let most = (4.0 * area + 2.0 * (columns + rows)).max(1.0);
        let fewer = (most / (columns * rows)).min(1.0).sqrt();
        let (columns, rows) = ((columns * fewer).ceil(), (rows * fewer).ceil());
        let grid = Grid { first: self.cells.len() as u32, columns: columns as u16, rows: rows as u16 };
        let (step_u, step_v) = (edge_u / columns, edge_v / rows);
        let radius = 0.5 * (step_u + step_v).length().max((step_u - step_v).length());
        let normal = geometry.normals[triangle as usize];
        if let Source::Known(reader) = source
            && let Some(owner) = reader.owner_of_all(lights.count())?
        {
            self.chosen.push_owner(owner);
            self.grids.push(Grid { first: lights.first + owner, columns: 0, rows: 0 });
            return Some(());
        }
        let mark = self.chosen.mark();
        for row in 0..grid.rows {
            if cancel.is_cancelled() {
                return Some(());
            }
            for column in 0..grid.columns {
                let (u, v) = ((f32::from(column) + 0.5) / columns, (f32::from(row) + 0.5) / rows);
                let outside = f32::from(column) / columns + f32::from(row) / rows > 1.0;
                let cell = if outside {
                    // Never hit but by rounding: the neighbour's answer serves.
                    *self.cells.last().expect("invariant: the first cell of a grid touches the triangle")
                } else {
                    let centre = a + edge_u * u + edge_v * v;
                    let chosen = match source {
                        Source::Search => {
                            chosen(lights, centre, [step_u, step_v], &lights.near(centre, radius, normal))
                        }
                        Source::Known(reader) => reader.list(lights.count())?,
                    };
                    self.chosen.push_list(&chosen);
                    self.cell(&candidates(lights, centre, [edge_u, edge_v], &chosen))
                };
                self.cells.push(cell);
            }
        }
        let cells = &self.cells[grid.first as usize..];
        let owner = cells[0].vsl[0];
        if owner & CROWD == 0 && cells.iter().all(|cell| cell.vsl == [owner; 4]) {
            self.cells.truncate(grid.first as usize);
            self.grids.push(Grid { first: owner, columns: 0, rows: 0 });
            self.chosen.replace_since(mark, owner - lights.first);
        } else {
            self.grids.push(grid);
        }
        Some(())
    }

    fn cell(&mut self, candidates: &[Candidate]) -> Cell {
        let mut cell = Cell {
            // Empty places repeat the first light: they are never nearest, and a lone light fills all four.
            vsl: [candidates[0].vsl; 4],
            at_centre: Vec4::INFINITY,
            per_u: Vec4::ZERO,
            per_v: Vec4::ZERO,
        };
        if candidates.len() > 4 {
            cell.vsl[0] = CROWD | self.crowds.len() as u32;
            cell.at_centre[0] = 0.0;
            self.crowds.extend(candidates);
        } else {
            for (place, candidate) in candidates.iter().enumerate() {
                cell.vsl[place] = candidate.vsl;
                cell.at_centre[place] = candidate.at_centre;
                cell.per_u[place] = candidate.per_u;
                cell.per_v[place] = candidate.per_v;
            }
        }
        cell
    }
}

/// The lights of `near` that are nearest somewhere in a cell, in order: leaves out each that another beats in all four
/// corners, hence, the difference of squared distances being linear, everywhere in the cell.
fn chosen(lights: &Lights, centre: Vec3, steps: [Vec3; 2], near: &[(f32, u32)]) -> Vec<u32> {
    let corners = |&(distance_sq, index): &(f32, u32)| {
        let to_light = lights.positions[index as usize] - centre;
        let [half_u, half_v] = steps.map(|step| -to_light.dot(step));
        [half_u + half_v, half_u - half_v, half_v - half_u, -half_u - half_v].map(|x| distance_sq + x)
    };
    let at_corners: Vec<[f32; 4]> = near.iter().map(corners).collect();
    // Beaten by a clear margin, so that rounding drops nobody who could win.
    let margin = near[0].0.max(steps[0].length_squared() + steps[1].length_squared()) * 1e-5;
    let beaten =
        |i: usize| at_corners.iter().any(|other| (0..4).all(|c| other[c] + margin < at_corners[i][c]));
    let mut chosen: Vec<u32> = (0..near.len()).filter(|&i| !beaten(i)).map(|i| near[i].1).collect();
    // Ties go to the lowest number, whatever the cell.
    chosen.sort_unstable();
    chosen
}

/// The lights `chosen` for a cell with their distances.
fn candidates(lights: &Lights, centre: Vec3, edges: [Vec3; 2], chosen: &[u32]) -> Vec<Candidate> {
    let candidate = |&index: &u32| {
        let position = lights.positions[index as usize];
        let [per_u, per_v] = edges.map(|edge| -2.0 * (position - centre).dot(edge));
        let at_centre = centre.distance_squared(position);
        Candidate { vsl: lights.first + index, run: 0, at_centre, per_u, per_v }
    };
    let mut candidates: Vec<Candidate> = chosen.iter().map(candidate).collect();
    candidates[0].run = candidates.len() as u32;
    candidates
}
