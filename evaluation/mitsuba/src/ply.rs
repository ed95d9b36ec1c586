//! Turns the triangles of an object into a binary PLY mesh.

use glam::{Vec2, Vec3};
use photonstream_scene::Scene;
use photonstream_shading::surface::SHADING_COS;
use std::{collections::HashMap, ops::Range};

/// The mesh of `triangles`: their vertices in the scene's space as f32 (m), each once, in the order of their first use, with
/// their shading normals if any of these triangles has some (a vertex with several is several), and their texture coordinates
/// if the scene has any; windings as in the scene.
pub(crate) fn encode(scene: &Scene, triangles: Range<u32>) -> Vec<u8> {
    let geometry = &scene.geometry;
    let smooth = is_smooth(scene, triangles.clone());
    let mut index_of = HashMap::new();
    let (mut vertices, mut uvs) = (Vec::<[Vec3; 2]>::new(), Vec::<Vec2>::new());
    let mut faces = Vec::with_capacity(triangles.len() * 13);
    let number = triangles.len();
    for id in triangles {
        let normals = if smooth { corner_normals(scene, id) } else { [Vec3::ZERO; 3] };
        faces.push(3);
        for (vertex, normal) in geometry.triangles[id as usize].into_iter().zip(normals) {
            let key = (vertex, normal.to_array().map(f32::to_bits));
            let index = *index_of.entry(key).or_insert_with(|| {
                vertices.push([geometry.vertices[vertex as usize], normal]);
                uvs.extend(geometry.uvs.get(vertex as usize).copied());
                vertices.len() as i32 - 1
            });
            faces.extend(index.to_le_bytes());
        }
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n{}{}element face {number}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        if smooth { "property float nx\nproperty float ny\nproperty float nz\n" } else { "" },
        if uvs.is_empty() { "" } else { "property float u\nproperty float v\n" },
    );
    let mut bytes = header.into_bytes();
    for (index, [vertex, normal]) in vertices.iter().enumerate() {
        bytes.extend(vertex.to_array().into_iter().flat_map(f32::to_le_bytes));
        if smooth {
            bytes.extend(normal.to_array().into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend(uvs.get(index).into_iter().flat_map(|uv| uv.to_array()).flat_map(f32::to_le_bytes));
    }
    bytes.append(&mut faces);
    bytes
}

/// Whether any of the triangles has shading normals.
pub(crate) fn is_smooth(scene: &Scene, mut triangles: Range<u32>) -> bool {
    triangles.any(|id| scene.corner_normals(id).is_some())
}

/// The normals of a triangle's corners; its own where it is flat, or where one of them is too far off it to be followed.
fn corner_normals(scene: &Scene, id: u32) -> [Vec3; 3] {
    let flat = scene.geometry.normals[id as usize];
    let bent = scene.corner_normals(id).filter(|bent| bent.iter().all(|n| n.dot(flat) > SHADING_COS));
    // Without negative zeros: equal normals have equal bits.
    bent.unwrap_or([flat; 3]).map(|normal| normal + Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_scene::{AssetRoots, SceneConfig};
    use std::path::Path;

    /// Two triangles of four corners: smooth; one of them flat, for a normal is too far off it; both flat, from six vertices.
    #[test]
    fn a_vertex_with_two_normals_is_two() {
        let folder = tempfile::tempdir().unwrap();
        let faces = [
            ("f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n", 4, [0.6, 0.8]),
            ("f 1//1 2//1 3//1\nf 1//1 3//1 4//2\n", 6, [0.6, 0.8]),
            ("f 1//2 2//1 3//1\nf 1 3 4\n", 6, [0.0, 1.0]),
        ];
        for (faces, expected, [x, y]) in faces {
            let obj = format!("v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvn 0.6 0.8 0\nvn 1 0.1 0\n{faces}");
            std::fs::write(folder.path().join("a.obj"), obj).unwrap();
            let text = "origin_m = [0, 0, 0]\ncamera = { position_m = [0, 1, 9], target_m = [0, 1, 0], vertical_fov_deg = 40 }\n\
                        object.it.obj.path = \"a.obj\"\n";
            let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
            let scene =
                SceneConfig::from_text(text, Path::new("x.toml")).unwrap().build_with(&roots).unwrap();
            let bytes = encode(&scene, 0..2);
            let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
            let header = std::str::from_utf8(&bytes[..end]).unwrap();
            assert!(
                header.contains(&format!("vertex {expected}\n")) && header.contains("float nx"),
                "{header}"
            );
            assert_eq!(bytes.len(), end + expected * 24 + 2 * 13);
            let float = |at: usize| f32::from_le_bytes(bytes[end + at..end + at + 4].try_into().unwrap());
            assert_eq!([float(12), float(16)], [x, y].map(|v: f64| v as f32));
        }
    }
}
