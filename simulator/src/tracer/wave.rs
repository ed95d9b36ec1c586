//! Turns the memory of a tracer thread into photons that advance together, and what they leave into a batch.

use super::PathBatch;
use crate::{flux::Deposit, trail::Vertex};
use glam::Vec3;
use photonstream_scene::bvh::{Hit, Ray};
use photonstream_shading::{
    sampling::Vectors,
    sobol::{Sample, SampleBlock},
};

/// A path, a point that it passed, and its barycentric coordinates.
pub(super) type Point = (u32, Vertex, [f32; 2]);

/// A photon on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Photon {
    /// Which path of the batch it is.
    pub(super) path: u32,
    pub(super) throughput: Vec3,
    pub(super) ray: Ray,
}

/// A photon whose first hits are known: it joins the others when they have had as many.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) hits: u32,
    pub(super) photon: Photon,
    /// Of the last hit: its next direction is around it.
    pub(super) normal: Vec3,
    pub(super) sample: Sample,
}

/// Photons that advance together, and the memory they need: a tracer thread keeps one for all its work.
#[derive(Debug, Default)]
pub struct Wave {
    pub(super) photons: Vec<Photon>,
    pub(super) samples: SampleBlock,
    pub(super) spare_samples: SampleBlock,
    /// Photons that go on from a hit of an earlier version, those with the fewest hits last.
    pub(super) waiting: Vec<Waiting>,
    pub(super) hits: Vec<Option<Hit>>,
    /// Random numbers: for survival, and the first of a direction.
    pub(super) first: Vec<f32>,
    pub(super) second: Vec<f32>,
    /// Normals, which become directions.
    pub(super) directions: Vectors,
    /// Deposits of all paths as they happened.
    pub(super) events: Vec<(u32, Deposit)>,
    /// Points of all paths as they were passed.
    pub(super) points: Vec<Point>,
    /// Where each path's deposits go next.
    places: Vec<u32>,
}

impl Wave {
    /// Sorts deposits and points by path, each path's in their order, into the batch.
    pub(super) fn collect(&mut self, count: usize, batch: &mut PathBatch) {
        let paths = self.events.iter().map(|event| event.0);
        count_by_path(count, paths, &mut self.places, &mut batch.lengths);
        batch.deposits.resize(self.events.len(), Deposit::default());
        for &(path, deposit) in &self.events {
            batch.deposits[next_place(&mut self.places, path)] = deposit;
        }
        let paths = self.points.iter().map(|point| point.0);
        count_by_path(count, paths, &mut self.places, &mut batch.point_counts);
        batch.vertices.resize(self.points.len(), Vertex::default());
        batch.uvs.resize(self.points.len(), [0.0; 2]);
        for &(path, vertex, uv) in &self.points {
            let place = next_place(&mut self.places, path);
            (batch.vertices[place], batch.uvs[place]) = (vertex, uv);
        }
        batch.counters.deposits += self.events.len() as u64;
    }
}

/// Counts how often each path is named, and where the first of each belongs when all are sorted by path.
fn count_by_path(
    paths: usize,
    named: impl Iterator<Item = u32>,
    places: &mut Vec<u32>,
    counts: &mut Vec<u16>,
) {
    counts.clear();
    counts.resize(paths, 0);
    named.for_each(|path| counts[path as usize] += 1);
    places.clear();
    places.extend(counts.iter().scan(0, |end, &count| {
        let start = *end;
        *end += u32::from(count);
        Some(start)
    }));
}

#[inline]
fn next_place(places: &mut [u32], path: u32) -> usize {
    let place = &mut places[path as usize];
    *place += 1;
    *place as usize - 1
}
