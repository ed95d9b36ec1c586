//! Turns a radius and a number of divisions into a tessellated sphere around the origin.

use super::{Mesh, sin_cos_turn};
use glam::DVec3;

/// The sphere of `radius` with its poles on the y axis, `segments` divisions around and from pole to pole; its corners
/// lie on the radius. 2 n (n - 1) triangles, none degenerate: the poles are fans.
pub(crate) fn sphere(radius: f64, segments: u32) -> Mesh {
    let n = segments;
    let mut vertices = vec![DVec3::Y * radius];
    for i in 1..n {
        let (sin_theta, cos_theta) = sin_cos_turn(f64::from(i) / f64::from(2 * n));
        vertices.extend((0..n).map(|j| {
            let (sin_phi, cos_phi) = sin_cos_turn(f64::from(j) / f64::from(n));
            DVec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi) * radius
        }));
    }
    vertices.push(DVec3::NEG_Y * radius);
    let south = vertices.len() as u32 - 1;
    let vertex = |i: u32, j: u32| match i {
        0 => 0,
        i if i == n => south,
        i => 1 + (i - 1) * n + j % n,
    };
    let mut triangles = Vec::with_capacity((2 * n * (n - 1)) as usize);
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            if i > 0 {
                triangles.push([a, b, d]);
            }
            if i + 1 < n {
                triangles.push([b, c, d]);
            }
        }
    }
    Mesh { vertices, triangles, ..Mesh::default() }
}
