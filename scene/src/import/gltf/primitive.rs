//! Turns a primitive of a glTF mesh into a surface of its own vertices, and that into a part of a group.

use super::{Group, accessor::Accessors};
use crate::import::{emitter_faces, unit};
use glam::{DAffine2, DVec2, DVec3, Vec2, Vec3};
use gltf::json::{
    accessor::Type,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
use std::collections::HashMap;

/// Largest texture coordinate: beyond it f32 has no fraction to speak of.
pub(in crate::import) const MAX_UV: f32 = 1e5;

/// Which of a primitive's texture coordinates a material uses, and the map from them to those of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Uvs {
    pub(super) set: u32,
    pub(super) map: DAffine2,
}

impl Uvs {
    fn of(&self, uv: [f64; 2]) -> Vec2 {
        self.map.transform_point2(DVec2::from_array(uv)).as_vec2()
    }
}

/// The triangles of a primitive and the vertices that they use.
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the vertices, where they were asked for.
    pub(super) uvs: Vec<Vec2>,
    /// Normals of the vertices as the file has them, where it has them.
    pub(super) normals: Vec<DVec3>,
    /// The numbers of the vertices in the primitive.
    pub(super) sources: Vec<u32>,
    /// How many were looked at, those that only turn a strip included.
    pub(super) read: usize,
}

/// Whether a primitive has triangles, no points or lines.
pub(super) fn is_surface(primitive: &Primitive) -> bool {
    matches!(primitive.mode.unwrap(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
}

/// Reads the triangles of a primitive, at most `most` of them, with the texture coordinates `uvs`.
///
/// # Errors
/// A sentence on what is wrong with it.
pub(super) fn read(
    primitive: &Primitive,
    accessors: &Accessors<'_>,
    most: usize,
    uvs: Option<Uvs>,
) -> Result<Surface, String> {
    let mode = primitive.mode.unwrap();
    let positions =
        primitive.attributes.get(&Checked::Valid(Semantic::Positions)).ok_or("it has no POSITION")?;
    let positions = accessors.elements::<3>(*positions, Type::Vec3)?;
    let indices =
        primitive.indices.map(|indices| accessors.elements::<1>(indices, Type::Scalar)).transpose()?;
    if indices.as_ref().is_some_and(|indices| !indices.are_whole()) {
        return Err("its indices are not whole numbers".into());
    }
    let coordinates = uvs.and_then(|uvs| {
        let accessor = primitive.attributes.get(&Checked::Valid(Semantic::TexCoords(uvs.set)))?;
        Some((accessors.elements::<2>(*accessor, Type::Vec2), uvs))
    });
    let coordinates = match coordinates {
        Some((elements, uvs)) => {
            let elements = elements?;
            if elements.count < positions.count {
                return Err(format!(
                    "{} texture coordinates for {} vertices",
                    elements.count, positions.count
                ));
            }
            Some((elements, uvs))
        }
        None => None,
    };
    let normals = primitive.attributes.get(&Checked::Valid(Semantic::Normals));
    let normals = normals.map(|normals| accessors.elements::<3>(*normals, Type::Vec3)).transpose()?;
    if let Some(normals) = normals.as_ref().filter(|normals| normals.count < positions.count) {
        return Err(format!("{} normals for {} vertices", normals.count, positions.count));
    }
    let corners = indices.as_ref().map_or(positions.count, |indices| indices.count);
    let number = match mode {
        Mode::Triangles => corners / 3,
        _ => corners.saturating_sub(2),
    };
    if number > most {
        return Err(format!("the file has more than {} triangles", super::MAX_TRIANGLES));
    }
    // Exporters share one list of positions among many primitives: only those used are taken.
    let mut own: HashMap<u32, u32> = HashMap::new();
    let mut surface = Surface { read: number, ..Surface::default() };
    for i in 0..number {
        let [a, b, c] = corners_of(mode, i).map(|corner| match &indices {
            Some(indices) => indices.get(corner as u32)[0],
            None => corner as f64,
        });
        if let Some(bad) = [a, b, c].into_iter().find(|n| !(*n >= 0.0 && *n < positions.count as f64)) {
            return Err(format!("it names vertex {bad}, but there are {}, counted from 0", positions.count));
        }
        let triangle = [a, b, c].map(|n| n as u32);
        // Strips turn corners by triangles without area.
        if triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0] {
            continue;
        }
        surface.triangles.push(triangle.map(|n| {
            *own.entry(n).or_insert_with(|| {
                surface.vertices.push(DVec3::from_array(positions.get(n)));
                surface.sources.push(n);
                if let Some((elements, uvs)) = &coordinates {
                    surface.uvs.push(uvs.of(elements.get(n)));
                }
                surface.normals.extend(normals.as_ref().map(|normals| DVec3::from_array(normals.get(n))));
                surface.vertices.len() as u32 - 1
            })
        }));
    }
    let is_usable = |uv: &Vec2| uv.is_finite() && uv.abs().max_element() <= MAX_UV;
    if let Some(bad) = surface.uvs.iter().find(|uv| !is_usable(uv)) {
        return Err(format!("texture coordinates {bad}, expected at most {MAX_UV}"));
    }
    Ok(surface)
}

/// The corners of triangle `i`.
fn corners_of(mode: Mode, i: usize) -> [usize; 3] {
    match mode {
        Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
        Mode::TriangleFan => [i + 1, i + 2, 0],
        _ => [3 * i, 3 * i + 1, 3 * i + 2],
    }
}

/// Adds a surface to a group, with its faces if it emits.
pub(super) fn append(group: &mut Group, surface: Surface, emits: bool) {
    let first = group.mesh.vertices.len() as u32;
    // Primitives without texture coordinates have texel (0, 0) everywhere, those without normals are flat.
    let normals: Vec<Vec3> = surface.normals.into_iter().map(unit).collect();
    group.mesh.append(surface.vertices, &surface.uvs, &normals);
    let triangles = surface.triangles.into_iter().map(|t| t.map(|i| i + first));
    let start = group.mesh.triangles.len();
    group.mesh.triangles.extend(triangles);
    if emits {
        let Group { mesh, faces } = group;
        faces.extend(emitter_faces(&mesh.vertices, &mesh.triangles[start..]));
    }
}
