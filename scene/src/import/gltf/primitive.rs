//! Turns a primitive of a glTF mesh into a surface of its own vertices, and that into a part of a group.

use super::{Group, accessor::Accessors};
use crate::{bake::EmitterFace, import::polygons::is_parallelogram};
use glam::DVec3;
use gltf::json::{
    accessor::Type,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
use std::collections::HashMap;

/// The triangles of a primitive and the vertices that they use.
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many were looked at, those that only turn a strip included.
    pub(super) read: usize,
}

/// Reads the triangles of a primitive, at most `most` of them; `None` for points and lines.
///
/// # Errors
/// A sentence on what is wrong with it.
pub(super) fn read(
    primitive: &Primitive,
    accessors: &Accessors<'_>,
    most: usize,
) -> Result<Option<Surface>, String> {
    let mode = primitive.mode.unwrap();
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let positions =
        primitive.attributes.get(&Checked::Valid(Semantic::Positions)).ok_or("it has no POSITION")?;
    let positions = accessors.elements::<3>(*positions, Type::Vec3)?;
    let indices =
        primitive.indices.map(|indices| accessors.elements::<1>(indices, Type::Scalar)).transpose()?;
    if indices.as_ref().is_some_and(|indices| !indices.are_whole()) {
        return Err("its indices are not whole numbers".into());
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
                surface.vertices.len() as u32 - 1
            })
        }));
    }
    Ok(Some(surface))
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
    group.mesh.vertices.extend(surface.vertices);
    let triangles = surface.triangles.into_iter().map(|t| t.map(|i| i + first));
    let start = group.mesh.triangles.len();
    group.mesh.triangles.extend(triangles);
    if emits {
        let Group { mesh, faces } = group;
        emitter_faces(&mesh.vertices, &mesh.triangles[start..], faces);
    }
}

/// The faces that lights would cover: two triangles in a row that make a parallelogram are one.
fn emitter_faces(vertices: &[DVec3], triangles: &[[u32; 3]], faces: &mut Vec<EmitterFace>) {
    let mut rest = triangles;
    while let [first, others @ ..] = rest {
        rest = others;
        let pair = others.first().and_then(|second| parallelogram(vertices, *first, *second));
        if let Some(corners) = pair {
            faces.push(EmitterFace::Parallelogram(corners));
            rest = &others[1..];
        } else {
            faces.push(EmitterFace::Triangle(*first));
        }
    }
}

/// A corner of the first triangle and the ends of the edges from it, if the second triangle makes it a parallelogram.
fn parallelogram(vertices: &[DVec3], first: [u32; 3], second: [u32; 3]) -> Option<[u32; 3]> {
    let at = |i: u32| vertices[i as usize];
    (0..3).find_map(|i| {
        let [corner, u, v] = [first[i], first[(i + 1) % 3], first[(i + 2) % 3]];
        // The second triangle has the edge from u to v the other way round.
        (0..3).find_map(|j| {
            let [v2, u2, far] = [second[j], second[(j + 1) % 3], second[(j + 2) % 3]];
            let shared = at(v2) == at(v) && at(u2) == at(u);
            (shared && is_parallelogram(at(corner), at(u), at(far), at(v))).then_some([corner, u, v])
        })
    })
}
