//! Turns the numbers of a torus knot into a tube along it.

use super::{Mesh, sin_cos_turn};
use glam::DVec3;

/// A tube along the (p, q) knot on the torus of major radius `radius` and minor radius `radius`/2 around the y axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TorusKnot {
    /// Windings around the y axis.
    pub(crate) p: u32,
    /// Windings around the ring.
    pub(crate) q: u32,
    /// Major radius of the torus, m.
    pub(crate) radius: f64,
    /// Radius of the tube, m.
    pub(crate) tube_radius: f64,
    /// Divisions along the tube.
    pub(crate) segments: u32,
    /// Divisions around the tube.
    pub(crate) tube_segments: u32,
}

/// The mesh of a torus knot: 2 · `segments` · `tube_segments` triangles, closed.
///
/// Its cross sections are turned by the normal of the torus, which is perpendicular to any curve on the torus and
/// returns to itself: the tube closes without a twist.
pub(crate) fn torus_knot(shape: TorusKnot) -> Mesh {
    let TorusKnot { p, q, radius, tube_radius, segments, tube_segments } = shape;
    let (windings_p, windings_q) = (f64::from(p), f64::from(q));
    let minor = radius * 0.5;
    let mut vertices = Vec::with_capacity(segments as usize * tube_segments as usize);
    for k in 0..segments {
        let t = f64::from(k) / f64::from(segments);
        let (sin_p, cos_p) = sin_cos_turn((t * windings_p).fract());
        let (sin_q, cos_q) = sin_cos_turn((t * windings_q).fract());
        let ring = radius + minor * cos_q;
        let centre = DVec3::new(ring * cos_p, minor * sin_q, ring * sin_p);
        let outwards = DVec3::new(cos_q * cos_p, sin_q, cos_q * sin_p);
        let around_axis = DVec3::new(-sin_p, 0.0, cos_p) * (ring * windings_p);
        let around_ring = DVec3::new(-sin_q * cos_p, cos_q, -sin_q * sin_p) * (minor * windings_q);
        let sideways = (around_axis + around_ring).normalize().cross(outwards);
        vertices.extend((0..tube_segments).map(|a| {
            let (sin_a, cos_a) = sin_cos_turn(f64::from(a) / f64::from(tube_segments));
            centre + (outwards * cos_a + sideways * sin_a) * tube_radius
        }));
    }
    let vertex = |k: u32, a: u32| (k % segments) * tube_segments + a % tube_segments;
    let mut triangles = Vec::with_capacity(2 * vertices.len());
    for k in 0..segments {
        for a in 0..tube_segments {
            let quad = [vertex(k, a), vertex(k, a + 1), vertex(k + 1, a + 1), vertex(k + 1, a)];
            triangles.push([quad[0], quad[1], quad[3]]);
            triangles.push([quad[1], quad[2], quad[3]]);
        }
    }
    Mesh { vertices, triangles, ..Mesh::default() }
}
