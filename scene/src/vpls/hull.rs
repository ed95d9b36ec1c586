//! Turns points into the planes of their convex hull.

use glam::DVec3;

/// Most points of a hull: every three of them are looked at.
pub(crate) const MOST_POINTS: usize = 64;

/// Relative to the extent of the points: closer to a plane is in it.
const FLAT: f64 = 1e-9;

/// The planes of the hull, outward unit normals n and offsets d with n·x ≤ d within; `None` where all points are in one
/// plane.
pub(crate) fn hull(points: &[DVec3]) -> Option<Vec<(DVec3, f64)>> {
    let (low, high) = points
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    let extent = (high - low).length();
    let near = FLAT * extent;
    let mut planes: Vec<(DVec3, f64)> = Vec::new();
    let mut has_volume = false;
    for (i, &a) in points.iter().enumerate() {
        for (j, &b) in points.iter().enumerate().skip(i + 1) {
            for &c in &points[j + 1..] {
                let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
                // Three points nearly in a line name no plane.
                if (b - a).cross(c - a).length() <= near * extent {
                    continue;
                }
                let sides = points.iter().map(|&p| normal.dot(p - a));
                let (below, above) =
                    sides.fold((0.0f64, 0.0f64), |(below, above), s| (below.min(s), above.max(s)));
                has_volume |= below < -near || above > near;
                let outward = match (below < -near, above > near) {
                    (true, true) => continue,
                    (false, true) => -normal,
                    _ => normal,
                };
                let plane = (outward, outward.dot(a));
                let is_known =
                    |&(n, d): &(DVec3, f64)| n.dot(plane.0) > 1.0 - 1e-12 && (d - plane.1).abs() <= near;
                if !planes.iter().any(is_known) {
                    planes.push(plane);
                }
            }
        }
    }
    has_volume.then_some(planes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube with points inside and on its faces has six planes, each half a metre from its middle.
    #[test]
    fn a_cube_has_six_planes() {
        let mut points: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
            .collect();
        points.extend([DVec3::ZERO, DVec3::new(0.5, 0.1, 0.2), DVec3::new(0.1, 0.2, 0.3)]);
        let planes = hull(&points).unwrap();
        assert_eq!(planes.len(), 6);
        assert!(planes.iter().all(|(n, d)| (d - 0.5).abs() < 1e-12 && n.abs().max_element() > 0.999_999));
    }

    #[test]
    fn a_tetrahedron_has_four_planes_and_a_square_none() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert_eq!(hull(&corners).unwrap().len(), 4);
        assert_eq!(hull(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]), None);
        assert_eq!(hull(&[DVec3::ZERO; 5]), None);
    }
}
