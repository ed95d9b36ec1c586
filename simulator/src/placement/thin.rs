//! Turns too many points into an even spread: removes the one with the closest two neighbours until enough are gone.

use crate::{
    cancel::Cancel,
    vsl::{COMPATIBLE_COSINE, Vsl},
};
use glam::Vec3;
use photonstream_scene::Geometry;
use rstar::{RTree, primitives::GeomWithData};
use std::{cmp::Reverse, collections::BinaryHeap};

type Tree = RTree<GeomWithData<[f32; 3], u32>>;

/// Removes points, one at a time, the one with the smallest (d_min1, d_min2) first, until `keep` remain; keeps order.
///
/// Distances are in rest space and count between points with compatible normals only. Of equal pairs the lowest index
/// goes first. The first `fixed` points stay in any case. Where it is cancelled, more remain.
pub(super) fn to(
    geometry: &Geometry,
    points: Vec<Vsl>,
    fixed: usize,
    keep: usize,
    cancel: &Cancel,
) -> Vec<Vsl> {
    if points.len() <= keep {
        return points;
    }
    let spread = Spread::new(geometry, &points);
    let mut alive = vec![true; points.len()];
    let mut heap: BinaryHeap<Reverse<Entry>> = (fixed as u32..points.len() as u32)
        .take_while(|_| !cancel.is_cancelled())
        .map(|i| Reverse(spread.entry(i, &alive)))
        .collect();
    let mut count = points.len();
    while count > keep && !cancel.is_cancelled() {
        let Some(Reverse(entry)) = heap.pop() else { break };
        // A stale entry is too small, never too large: distances only grow as points go. So the renewed entries alone
        // decide, and the first one that is still true is the smallest.
        if entry.neighbours.iter().all(|&n| n == NONE || alive[n as usize]) {
            alive[entry.point as usize] = false;
            count -= 1;
        } else {
            heap.push(Reverse(spread.entry(entry.point, &alive)));
        }
    }
    points.into_iter().zip(alive).filter_map(|(point, alive)| alive.then_some(point)).collect()
}

const NONE: u32 = u32::MAX;

/// A point with its two closest neighbours; ordered by distances, then index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// Squared distances as bits: for non-negative floats the order is the same.
    distances_sq: [u32; 2],
    point: u32,
    neighbours: [u32; 2],
}

struct Spread {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tree: Tree,
}

impl Spread {
    fn new(geometry: &Geometry, points: &[Vsl]) -> Self {
        let positions: Vec<Vec3> = points.iter().map(|p| p.position_rest(geometry)).collect();
        // Normals are compared with each other only, so those of the scene's space serve.
        let normals = points.iter().map(|p| geometry.normals[p.triangle as usize]).collect();
        let items =
            positions.iter().enumerate().map(|(i, p)| GeomWithData::new(p.to_array(), i as u32)).collect();
        Self { positions, normals, tree: RTree::bulk_load(items) }
    }

    /// The two closest living neighbours of `point`.
    fn entry(&self, point: u32, alive: &[bool]) -> Entry {
        let at = self.positions[point as usize];
        let normal = self.normals[point as usize];
        let mut entry = Entry { distances_sq: [f32::INFINITY.to_bits(); 2], point, neighbours: [NONE; 2] };
        let compatible = self.tree.nearest_neighbor_iter(at.to_array()).filter(|other| {
            let other = other.data as usize;
            other != point as usize && alive[other] && normal.dot(self.normals[other]) >= COMPATIBLE_COSINE
        });
        for (slot, other) in compatible.take(2).enumerate() {
            entry.neighbours[slot] = other.data;
            entry.distances_sq[slot] = at.distance_squared(self.positions[other.data as usize]).to_bits();
        }
        entry
    }
}
