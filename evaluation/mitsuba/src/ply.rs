//! Turns the triangles of an object into a binary PLY mesh.

use glam::Vec2;
use photonstream_scene::Geometry;
use std::{collections::HashMap, ops::Range};

/// The mesh of `triangles`: their vertices in the scene's space as f32 (m), each once, in the order of their first use, with their texture
/// coordinates if the scene has any;
/// windings as in the scene.
pub(crate) fn encode(geometry: &Geometry, triangles: Range<u32>) -> Vec<u8> {
    let triangles = &geometry.triangles[triangles.start as usize..triangles.end as usize];
    let mut index_of = HashMap::new();
    let (mut vertices, mut uvs) = (Vec::new(), Vec::<Vec2>::new());
    let mut faces = Vec::with_capacity(triangles.len() * 13);
    for triangle in triangles {
        faces.push(3);
        for &vertex in triangle {
            let index = *index_of.entry(vertex).or_insert_with(|| {
                vertices.push(geometry.vertices[vertex as usize]);
                uvs.extend(geometry.uvs.get(vertex as usize).copied());
                vertices.len() as i32 - 1
            });
            faces.extend(index.to_le_bytes());
        }
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n{}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        if uvs.is_empty() { "" } else { "property float u\nproperty float v\n" },
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    for (index, vertex) in vertices.iter().enumerate() {
        bytes.extend(vertex.to_array().into_iter().flat_map(f32::to_le_bytes));
        bytes.extend(uvs.get(index).into_iter().flat_map(|uv| uv.to_array()).flat_map(f32::to_le_bytes));
    }
    bytes.append(&mut faces);
    bytes
}
