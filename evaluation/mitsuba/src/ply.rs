//! Turns the triangles of an object into a binary PLY mesh.

use photonstream_scene::Geometry;
use std::{collections::HashMap, ops::Range};

/// The mesh of `triangles`: their vertices in the scene's space as f32 (m), each once, in the order of their first use;
/// windings as in the scene.
pub(crate) fn encode(geometry: &Geometry, triangles: Range<u32>) -> Vec<u8> {
    let triangles = &geometry.triangles[triangles.start as usize..triangles.end as usize];
    let mut index_of = HashMap::new();
    let mut vertices = Vec::new();
    let mut faces = Vec::with_capacity(triangles.len() * 13);
    for triangle in triangles {
        faces.push(3);
        for &vertex in triangle {
            let index = *index_of.entry(vertex).or_insert_with(|| {
                vertices.push(geometry.vertices[vertex as usize]);
                vertices.len() as i32 - 1
            });
            faces.extend(index.to_le_bytes());
        }
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    bytes.extend(vertices.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes));
    bytes.append(&mut faces);
    bytes
}
