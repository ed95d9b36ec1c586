//! Turns three edge lengths and a middle into a cuboid.

use super::Mesh;
use glam::DVec3;

/// The cuboid of edge lengths `size` around `centre`: 12 triangles, 8 shared corners.
pub(crate) fn cuboid(size: DVec3, centre: DVec3) -> Mesh {
    let half = size * 0.5;
    // Corner i has bit 0 for +x, bit 1 for +y, bit 2 for +z.
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let vertices = (0..8).map(|i| centre + half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let faces: [[u32; 4]; 6] =
        [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { vertices, triangles, ..Mesh::default() }
}
