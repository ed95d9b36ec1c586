//! Turns points into cells of a grid, so that what is near a place is found without looking at all.

use glam::Vec3;
use std::collections::HashMap;

/// Numbers by the cell of a point; cells are cubes.
#[derive(Debug)]
pub(super) struct Grid {
    edge_m: f32,
    cells: HashMap<[i32; 3], Vec<u32>>,
}

impl Grid {
    /// An empty grid of cells of this edge, m.
    pub(super) fn new(edge_m: f32) -> Self {
        Self { edge_m, cells: HashMap::new() }
    }

    fn cell(&self, point: Vec3) -> [i32; 3] {
        // Saturates far out: what is there is looked at together.
        (point / self.edge_m).floor().to_array().map(|x| x as i32)
    }

    pub(super) fn insert(&mut self, point: Vec3, number: u32) {
        self.cells.entry(self.cell(point)).or_default().push(number);
    }

    /// Moves a number that was inserted at `from`.
    pub(super) fn relocate(&mut self, from: Vec3, to: Vec3, number: u32) {
        let (old, new) = (self.cell(from), self.cell(to));
        if old == new {
            return;
        }
        if let Some(numbers) = self.cells.get_mut(&old) {
            numbers.retain(|other| *other != number);
        }
        self.cells.entry(new).or_default().push(number);
    }

    /// The numbers of all points within an edge of `point`, and of some beyond, in a fixed order.
    pub(super) fn near(&self, point: Vec3) -> impl Iterator<Item = u32> {
        let [x, y, z] = self.cell(point);
        let around = (0..27).map(move |i| {
            [x.saturating_add(i % 3 - 1), y.saturating_add(i / 3 % 3 - 1), z.saturating_add(i / 9 - 1)]
        });
        around.filter_map(|cell| self.cells.get(&cell)).flatten().copied()
    }
}
