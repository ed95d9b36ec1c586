//! Turns a corner and two edges into a parallelogram of two triangles.

use super::Mesh;
use glam::DVec3;

/// The parallelogram between `edge_u` and `edge_v` at `corner`; its front looks along `edge_u × edge_v`.
pub(crate) fn quad(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Mesh {
    Mesh {
        vertices: vec![corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}
