//! Turns the polygons of a file into triangles, and into faces that a light would cover.

use super::Group;
use crate::bake::EmitterFace;
use glam::DVec3;

/// Cuts a polygon into triangles, and notes how a light would cover it: whole if it is a parallelogram.
pub(super) fn push_polygon(group: &mut Group, face: &[u32]) {
    if face.len() < 3 {
        return;
    }
    let vertex = |i: usize| group.mesh.vertices[face[i] as usize];
    let start =
        if face.len() == 4 && !is_convex_at(vertex(0), vertex(1), vertex(2), vertex(3)) { 1 } else { 0 };
    let n = face.len();
    let fan: Vec<[u32; 3]> =
        (1..n - 1).map(|i| [face[start], face[(start + i) % n], face[(start + i + 1) % n]]).collect();
    if n == 4 && is_parallelogram(vertex(0), vertex(1), vertex(2), vertex(3)) {
        group.faces.push(EmitterFace::Parallelogram([face[0], face[1], face[3]]));
    } else {
        group.faces.extend(fan.iter().map(|&t| EmitterFace::Triangle(t)));
    }
    group.mesh.triangles.extend(fan);
}

/// Whether the diagonal from `a` to `c` cuts the quadrilateral into two triangles that look the same way.
fn is_convex_at(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> bool {
    (b - a).cross(c - a).dot((c - a).cross(d - a)) > 0.0
}

/// Whether opposite edges are equal to 1e-5 of the diagonals: as close as the file's f32 positions allow.
pub(super) fn is_parallelogram(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> bool {
    let size = (c - a).length().max((d - b).length());
    (a - b + c - d).length() <= 1e-5 * size
}

/// The faces that lights would cover: two triangles in a row that make a parallelogram are one.
pub(crate) fn emitter_faces(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<EmitterFace> {
    let mut faces = Vec::new();
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
    faces
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
