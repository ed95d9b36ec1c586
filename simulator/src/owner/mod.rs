//! Turns a hit (triangle, side, barycentric coordinates) into the virtual surface light that owns it.
//!
//! The owner is the nearest light of the same object and side whose normal is compatible with the triangle's, or the
//! nearest of any normal where none is; distances are in the object's rest space, so moving an object changes no owner.
//! Each triangle is cut into a grid of cells in (u, v) with the lights that can be nearest somewhere in the cell; most
//! cells have one, and the answer is one table read. The others keep for each candidate s its squared distance as a
//! function of (u, v), from which the part all candidates share (the square of the point's own position) is left out:
//! what remains is linear, three numbers, and the smallest wins.

mod build;

use crate::vsl::VslId;
use photonstream_scene::Side;

/// Answers who owns a hit, in a few nanoseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnerTable {
    /// Per triangle: where its front and back grids are.
    grids: Vec<[Grid; 2]>,
    /// Per cell: a light, or the first of its candidates in `candidates` if [`SEVERAL`] is set.
    cells: Vec<u32>,
    /// Runs of candidates; the first of a run holds the run's length.
    candidates: Vec<Candidate>,
}

/// The cells of one side of a triangle: `columns` × `rows` over (u, v) in the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grid {
    /// Index of the first cell; [`NO_CELLS`] where the side has no lights.
    first: u32,
    columns: u16,
    rows: u16,
}

const NO_CELLS: u32 = u32::MAX;
const SEVERAL: u32 = 1 << 31;

/// A light that is nearest somewhere in a cell. Its squared distance from the point at (du, dv) from the cell's centre,
/// less what all candidates share, is `at_centre + du · per_u + dv · per_v`.
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
        if grid.first == NO_CELLS {
            return None;
        }
        let (columns, rows) = (f32::from(grid.columns), f32::from(grid.rows));
        // `as` saturates: barycentric coordinates that rounding has put below 0 are in the first cell.
        let column = ((u * columns) as u32).min(u32::from(grid.columns) - 1);
        let row = ((v * rows) as u32).min(u32::from(grid.rows) - 1);
        let cell = self.cells[(grid.first + row * u32::from(grid.columns) + column) as usize];
        if cell & SEVERAL == 0 {
            return Some(VslId(cell));
        }
        let first = (cell & !SEVERAL) as usize;
        let run = &self.candidates[first..first + self.candidates[first].run as usize];
        let du = u - (column as f32 + 0.5) / columns;
        let dv = v - (row as f32 + 0.5) / rows;
        let mut best = (f32::INFINITY, run[0].vsl);
        for candidate in run {
            let distance = candidate.at_centre + du * candidate.per_u + dv * candidate.per_v;
            if distance < best.0 {
                best = (distance, candidate.vsl);
            }
        }
        Some(VslId(best.1))
    }

    /// Number of cells of a side of a triangle; 0 where it has no lights.
    pub fn cells(&self, triangle: u32, side: Side) -> u32 {
        let grid = self.grids[triangle as usize][side as usize];
        if grid.first == NO_CELLS { 0 } else { u32::from(grid.columns) * u32::from(grid.rows) }
    }

    /// Bytes the table takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.grids) + size_of_val(&*self.cells) + size_of_val(&*self.candidates)
    }
}
