//! Turns smoothing groups into normals for the corners of polygons that have none.

use super::statements::{Faces, NONE};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Gives each corner without a normal, in a polygon with a smoothing group, the mean of the normals that the group's polygons
/// have at its position, weighed by their angles there; `normals` grows by these. Groups reach across objects and materials,
/// as positions do.
///
/// # Errors
/// If there are more normals than can be numbered.
///
/// Source: G. Thürmer & C. A. Wüthrich, "Computing Vertex Normals from Polygonal Facets", JGT 3(1), 1998.
pub(super) fn fill(
    positions: &[DVec3],
    normals: &mut Vec<DVec3>,
    faces: &mut BTreeMap<(String, String), Faces>,
) -> Result<(), String> {
    if faces.values().flat_map(|faces| &faces.corners).all(|corner| corner[2] != NONE) {
        return Ok(());
    }
    // The number of a group's normal at a position.
    let mut of: HashMap<(u32, u32), u32> = HashMap::new();
    for faces in faces.values_mut() {
        let mut start = 0;
        for (&arity, &group) in faces.arities.iter().zip(&faces.smoothing) {
            let face = &mut faces.corners[start..start + arity as usize];
            start += arity as usize;
            if group == 0 || face.len() < 3 {
                continue;
            }
            let normal = face_normal(positions, face);
            for i in 0..face.len() {
                let [position, _, given] = face[i];
                let next = u32::try_from(normals.len()).ok().filter(|n| *n != NONE);
                let next = next.ok_or("it has more normals than can be numbered")?;
                let number = *of.entry((group, position)).or_insert_with(|| {
                    normals.push(DVec3::ZERO);
                    next
                });
                normals[number as usize] += normal * angle(positions, face, i);
                if given == NONE {
                    face[i][2] = number;
                }
            }
        }
    }
    Ok(())
}

/// The unit normal of a polygon, zero where it has no area. Source: Newell's method.
fn face_normal(positions: &[DVec3], face: &[[u32; 3]]) -> DVec3 {
    let at = |i: usize| positions[face[i % face.len()][0] as usize];
    let first = at(0);
    let sum: DVec3 = (1..face.len() - 1).map(|i| (at(i) - first).cross(at(i + 1) - first)).sum();
    sum.normalize_or_zero()
}

/// The angle of a polygon at corner `i`, radians.
fn angle(positions: &[DVec3], face: &[[u32; 3]], i: usize) -> f64 {
    let (n, at) = (face.len(), |i: usize| positions[face[i % face.len()][0] as usize]);
    let (before, after) = (at(i + n - 1) - at(i), at(i + 1) - at(i));
    before.angle_between(after).max(0.0)
}
