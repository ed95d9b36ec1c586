//! Turns what is still true of paths that met a change into photons that go on from there.
//!
//! The points before the first segment that met the change are those of the new path, too. What a photon needs to go on
//! follows from them: its origin from the triangle and the barycentric coordinates of its last hit, its throughput from
//! the light and the reflections so far, its next direction from the sample's own numbers, counted by bounces. Every
//! operation is that of tracing the path from its light, so that the bits are the same; only the rays are saved.

use super::{Tracer, wave};
use crate::{
    flux::Deposit,
    trail::{Event, Vertex},
};
use glam::Vec3;
use photonstream_scene::bvh::Ray;
use photonstream_shading::{sobol::Sample, surface};
use wave::{Photon, Waiting, Wave};

/// The first points of each path of a batch, as far as they are known; none at all where every path is to be traced from
/// its light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beginnings {
    counts: Vec<u8>,
    vertices: Vec<Vertex>,
    uvs: Vec<[f32; 2]>,
}

/// What is known of one path: where it began, and its first hits. Empty where nothing is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known<'a> {
    vertices: &'a [Vertex],
    uvs: &'a [[f32; 2]],
}

impl Known<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }
}

impl Beginnings {
    /// Adds the next path of the batch, of which the points and their barycentric coordinates are known, at least one hit;
    /// `None` where nothing is. Returns the number of rays that this saves.
    pub(crate) fn push(&mut self, known: Option<(&[Vertex], &[[f32; 2]])>) -> u64 {
        let (vertices, uvs) = known.unwrap_or_default();
        debug_assert!(vertices.len() == uvs.len() && vertices.len() <= usize::from(u8::MAX));
        self.counts.push(vertices.len() as u8);
        self.vertices.extend_from_slice(vertices);
        self.uvs.extend_from_slice(uvs);
        (vertices.len() as u64).saturating_sub(1)
    }

    pub(super) fn paths(&self) -> impl Iterator<Item = Known<'_>> {
        let (mut vertices, mut uvs) = (&self.vertices[..], &self.uvs[..]);
        self.counts.iter().map(move |&count| {
            let (known, rest) = (vertices.split_at(usize::from(count)), uvs.split_at(usize::from(count)));
            (vertices, uvs) = (known.1, rest.1);
            Known { vertices: known.0, uvs: rest.0 }
        })
    }
}

impl Tracer {
    /// The photon of `path`, with the given throughput at birth, after the hits that are known; they and what it left there
    /// are put into the wave.
    pub(super) fn go_on(
        &self,
        path: u32,
        birth: Vec3,
        known: Known<'_>,
        sample: Sample,
        wave: &mut Wave,
    ) -> Waiting {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::ZERO, t_max: f32::INFINITY };
        let mut photon = Photon { path, throughput: birth, ray };
        let (mut normal, mut hits) = (Vec3::ZERO, 0);
        for (&vertex, &uv) in known.vertices.iter().zip(known.uvs) {
            wave.points.push((path, vertex, uv));
            let Event::Hit { triangle, side, deposited } = vertex.event() else { continue };
            let reflection = self.reflection(triangle, uv);
            let throughput = photon.throughput * reflection.albedo;
            if deposited && let Some(owner) = self.owners.owner(triangle, side, uv[0], uv[1]) {
                wave.events.extend(Deposit::new(owner.0, throughput).map(|deposit| (path, deposit)));
            }
            photon.throughput = throughput / reflection.survival;
            normal = self.geometry.normals[triangle as usize] * side.sign();
            let corners = self.geometry.triangle(triangle);
            photon.ray.origin = surface::offset(corners, vertex.position(), normal);
            hits += 1;
        }
        Waiting { hits, photon, normal, sample }
    }
}
