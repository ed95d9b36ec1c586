//! Turns the table of owners into the pieces of each triangle that one virtual surface light owns.

use super::{CROWD, Candidate, Cell, NOBODY, OwnerTable};
use crate::vsl::VslId;
use photonstream_scene::Side;

/// Barycentric coordinates (u, v).
type Point = [f64; 2];

impl OwnerTable {
    /// Gives `take` the light and the corners, in barycentric coordinates, of every convex piece of a side of a triangle
    /// that one light owns. The pieces cover the triangle, but for rounding.
    pub(crate) fn pieces(&self, triangle: u32, side: Side, mut take: impl FnMut(VslId, &[Point])) {
        let grid = self.grids[triangle as usize][side as usize];
        if grid.columns == 0 {
            if grid.first != NOBODY {
                take(VslId(grid.first), &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
            }
            return;
        }
        let (columns, rows) = (f64::from(grid.columns), f64::from(grid.rows));
        let mut candidates = Vec::new();
        let (mut piece, mut spare) = (Vec::new(), Vec::new());
        for row in 0..grid.rows {
            for column in 0..grid.columns {
                let (u0, v0) = (f64::from(column) / columns, f64::from(row) / rows);
                if u0 + v0 >= 1.0 {
                    break;
                }
                let (u1, v1) = (u0 + 1.0 / columns, v0 + 1.0 / rows);
                let centre = [0.5 * (u0 + u1), 0.5 * (v0 + v1)];
                let index = grid.first as usize + usize::from(row) * usize::from(grid.columns);
                self.candidates(&self.cells[index + usize::from(column)], &mut candidates);
                for one in &candidates {
                    piece.clear();
                    piece.extend([[u0, v0], [u1, v0], [u1, v1], [u0, v1]]);
                    cut(&mut piece, &mut spare, |[u, v]| u + v - 1.0);
                    for other in candidates.iter().filter(|o| o.vsl != one.vsl) {
                        let [at, u, v] = difference(one, other);
                        cut(&mut piece, &mut spare, |p| at + u * (p[0] - centre[0]) + v * (p[1] - centre[1]));
                    }
                    if piece.len() >= 3 {
                        take(VslId(one.vsl), &piece);
                    }
                }
            }
        }
    }

    fn candidates(&self, cell: &Cell, into: &mut Vec<Candidate>) {
        into.clear();
        if cell.vsl[0] & CROWD != 0 {
            let crowd = &self.crowds[(cell.vsl[0] & !CROWD) as usize..];
            into.extend_from_slice(&crowd[..crowd[0].run as usize]);
            return;
        }
        for i in 0..4 {
            // Empty places are infinitely far.
            if cell.at_centre[i].is_finite() {
                let (at_centre, per_u, per_v) = (cell.at_centre[i], cell.per_u[i], cell.per_v[i]);
                into.push(Candidate { vsl: cell.vsl[i], run: 0, at_centre, per_u, per_v });
            }
        }
    }
}

/// By how much `one` is farther than `other`: at the cell's centre, and per unit of u and v.
fn difference(one: &Candidate, other: &Candidate) -> [f64; 3] {
    let less = |a: f32, b: f32| f64::from(a) - f64::from(b);
    [less(one.at_centre, other.at_centre), less(one.per_u, other.per_u), less(one.per_v, other.per_v)]
}

/// Keeps the part of a convex polygon where `beyond` is not positive.
fn cut(piece: &mut Vec<Point>, spare: &mut Vec<Point>, beyond: impl Fn(Point) -> f64) {
    let Some(&last) = piece.last() else { return };
    spare.clear();
    let mut from = (last, beyond(last));
    for &to in piece.iter() {
        let to = (to, beyond(to));
        if (from.1 > 0.0) != (to.1 > 0.0) {
            let t = from.1 / (from.1 - to.1);
            spare.push([0, 1].map(|i| from.0[i] + (to.0[i] - from.0[i]) * t));
        }
        if to.1 <= 0.0 {
            spare.push(to.0);
        }
        from = to;
    }
    std::mem::swap(piece, spare);
}
