//! Turns a hit (triangle, side, barycentric coordinates) into the virtual surface light that owns it.
//!
//! The owner is the nearest light of the same object and side whose normal is compatible with the triangle's, or the
//! nearest of any normal where none is; distances are in the object's rest space, so moving an object changes no owner.
//!
//! Each triangle is cut into a grid of cells in (u, v). A cell keeps the lights that can be nearest somewhere in it, at
//! most four in all but a few: for each the squared distance as a function of (u, v) without the part that all
//! candidates share (the square of the point's own position). What remains is linear: three numbers a light, sixteen
//! for a cell in one line of the cache, and the least of four at once, without a branch to mispredict.

mod build;
mod choices;
pub(crate) mod kept;
mod pieces;

use crate::vsl::VslId;
use glam::Vec4;
use photonstream_scene::Side;

/// Answers who owns a hit, in a few nanoseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnerTable {
    /// Per triangle: its front and back.
    grids: Vec<[Grid; 2]>,
    cells: Vec<Cell>,
    /// The candidates of cells with more than four, in runs.
    crowds: Vec<Candidate>,
}

/// The cells of one side of a triangle: `columns` × `rows` over (u, v) in the unit square. Without columns, all of the
/// triangle has the same owner: `first`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grid {
    /// Index of the first cell, or the owner; [`NOBODY`] where the side has no lights.
    first: u32,
    columns: u16,
    rows: u16,
}

const NOBODY: u32 = u32::MAX;

/// Marks an entry of [`Cell::vsl`] that is not a light but the start of a run in [`OwnerTable::crowds`].
const CROWD: u32 = 1 << 31;

/// Four candidates side by side, by light; empty places are infinitely far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Cell {
    vsl: [u32; 4],
    /// Squared distance from the cell's centre.
    at_centre: Vec4,
    /// Its change per unit of u and v.
    per_u: Vec4,
    per_v: Vec4,
}

/// A light that is nearest somewhere in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    vsl: u32,
    /// Number of candidates of the cell, in the first of them.
    run: u32,
    at_centre: f32,
    per_u: f32,
    per_v: f32,
}

impl OwnerTable {
    /// The light that owns the point (u, v) of a side of a triangle; `None` only where the side has no lights.
    #[inline]
    pub fn owner(&self, triangle: u32, side: Side, u: f32, v: f32) -> Option<VslId> {
        let grid = self.grids[triangle as usize][side as usize];
        if grid.columns == 0 {
            return (grid.first != NOBODY).then_some(VslId(grid.first));
        }
        let (columns, rows) = (f32::from(grid.columns), f32::from(grid.rows));
        // `as` saturates: barycentric coordinates that rounding has put below 0 are in the first cell.
        let column = ((u * columns) as u32).min(u32::from(grid.columns) - 1);
        let row = ((v * rows) as u32).min(u32::from(grid.rows) - 1);
        let cell = &self.cells[(grid.first + row * u32::from(grid.columns) + column) as usize];
        let du = u - (column as f32 + 0.5) / columns;
        let dv = v - (row as f32 + 0.5) / rows;
        let distances = cell.at_centre + cell.per_u * du + cell.per_v * dv;
        // The first of the nearest: of lights equally near the one with the lowest number.
        let nearest = distances.cmpeq(Vec4::splat(distances.min_element())).bitmask().trailing_zeros();
        let vsl = cell.vsl[nearest as usize & 3];
        if vsl & CROWD == 0 { Some(VslId(vsl)) } else { Some(self.owner_in_crowd(vsl & !CROWD, du, dv)) }
    }

    #[cold]
    fn owner_in_crowd(&self, first: u32, du: f32, dv: f32) -> VslId {
        let crowd = &self.crowds[first as usize..];
        let mut nearest = (f32::INFINITY, crowd[0].vsl);
        for candidate in &crowd[..crowd[0].run as usize] {
            let distance = candidate.at_centre + candidate.per_u * du + candidate.per_v * dv;
            if distance < nearest.0 {
                nearest = (distance, candidate.vsl);
            }
        }
        VslId(nearest.1)
    }

    /// Number of cells of a side of a triangle; 0 where it has no lights.
    pub fn cells(&self, triangle: u32, side: Side) -> u32 {
        match self.grids[triangle as usize][side as usize] {
            Grid { columns: 0, first: NOBODY, .. } => 0,
            Grid { columns: 0, .. } => 1,
            Grid { columns, rows, .. } => u32::from(columns) * u32::from(rows),
        }
    }

    /// Bytes the table takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.grids) + size_of_val(&*self.cells) + size_of_val(&*self.crowds)
    }
}
