//! Turns a ray and a proxy into where the one meets the other.

use crate::scene::ObjectId;
use glam::{DAffine3, DVec3};

/// A simple body in the place of the scene, for the axes of spots.
///
/// Source: paper B §4.3, its collision proxies.
#[derive(Clone, Debug, PartialEq)]
pub struct Proxy {
    /// Rigid map from the proxy's own space to that which [`crate::Scene::world_from_anchor`] leads from, m.
    pub anchor_from_own: DAffine3,
    /// Its shape.
    pub shape: ProxyShape,
    /// The object with which it moves.
    pub object: Option<ObjectId>,
}

/// The shape of a proxy around its own origin.
#[derive(Clone, Debug, PartialEq)]
pub enum ProxyShape {
    /// A cuboid.
    Cuboid {
        /// Its middle, m.
        centre: DVec3,
        /// Half its edges, m.
        half: DVec3,
    },
    /// A sphere.
    Sphere {
        /// Its radius, m.
        radius: f64,
    },
    /// The convex hull of points.
    Hull {
        /// The points, m.
        points: Vec<DVec3>,
        /// Outward unit normals n and offsets d: n·x ≤ d within, m.
        planes: Vec<(DVec3, f64)>,
    },
}

impl ProxyShape {
    /// The distance along a ray in the proxy's own space, in lengths of `direction`, to where it enters the body, or
    /// leaves it where it begins inside: a room may be a box. `None` for a miss.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (enter, leave) = match self {
            Self::Cuboid { centre, half } => {
                let faces = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| {
                    [axis, -axis].map(|normal| (normal, normal.dot(*centre) + axis.dot(*half)))
                });
                between(faces, origin, direction)
            }
            Self::Hull { planes, .. } => between(planes.iter().copied(), origin, direction),
            Self::Sphere { radius } => {
                let (a, b) = (direction.length_squared(), origin.dot(direction));
                let closest = origin - direction * (b / a);
                let half_sq = (radius * radius - closest.length_squared()) / a;
                // NaN where there is no direction: a miss.
                (half_sq >= 0.0).then(|| (-b / a - half_sq.sqrt(), -b / a + half_sq.sqrt()))
            }
        }?;
        let at = if enter > 0.0 { enter } else { leave };
        (at > 0.0 && at.is_finite()).then_some(at)
    }
}

/// Where a ray enters and leaves the space below all `planes`.
fn between(
    planes: impl Iterator<Item = (DVec3, f64)>,
    origin: DVec3,
    direction: DVec3,
) -> Option<(f64, f64)> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for (normal, offset) in planes {
        let (height, climb) = (offset - normal.dot(origin), normal.dot(direction));
        if climb < 0.0 {
            enter = enter.max(height / climb);
        } else if climb > 0.0 {
            leave = leave.min(height / climb);
        } else if height < 0.0 {
            return None;
        }
    }
    (enter <= leave).then_some((enter, leave))
}

#[cfg(test)]
mod tests {
    use super::super::hull;
    use super::*;

    fn cube() -> ProxyShape {
        ProxyShape::Cuboid { centre: DVec3::Y, half: DVec3::new(1.0, 2.0, 3.0) }
    }

    /// By hand: the box reaches from (−1, −1, −3) to (1, 3, 3).
    #[test]
    fn boxes_are_entered_from_outside_and_left_from_inside() {
        assert_eq!(cube().intersect(DVec3::X * 5.0, -DVec3::X), Some(4.0));
        assert_eq!(cube().intersect(DVec3::X * 5.0, -DVec3::X * 2.0), Some(2.0));
        assert_eq!(cube().intersect(DVec3::ZERO, DVec3::Y), Some(3.0));
        assert_eq!(cube().intersect(DVec3::ZERO, DVec3::NEG_Y), Some(1.0));
        assert_eq!(cube().intersect(DVec3::X * 5.0, DVec3::X), None);
        assert_eq!(cube().intersect(DVec3::new(5.0, 9.0, 0.0), -DVec3::X), None);
        assert_eq!(cube().intersect(DVec3::ZERO, DVec3::ZERO), None);
    }

    /// By hand: 3-4-5 beside the middle of a sphere of radius 5.
    #[test]
    fn spheres_are_met_where_they_are() {
        let sphere = ProxyShape::Sphere { radius: 5.0 };
        assert_eq!(sphere.intersect(DVec3::new(-10.0, 4.0, 0.0), DVec3::X), Some(7.0));
        assert_eq!(sphere.intersect(DVec3::new(0.0, 4.0, 0.0), DVec3::X), Some(3.0));
        assert_eq!(sphere.intersect(DVec3::new(-10.0, 5.5, 0.0), DVec3::X), None);
        assert_eq!(sphere.intersect(DVec3::X * 10.0, DVec3::X), None);
        assert_eq!(sphere.intersect(DVec3::X * 10.0, DVec3::ZERO), None);
    }

    /// A proxy rides with its object, turned and moved, but neither stretched nor mirrored with it.
    #[test]
    fn proxies_ride_rigidly() {
        let text = r#"
            origin_m = [0, 0, 0]
            camera = { position_m = [0, 1, 9], target_m = [0, 1, 0], vertical_fov_deg = 40 }
            material.m.albedo = 0.5
            object.crate = { material = "m", box = { size_m = [1, 1, 1] } }
            proxy = [{ object = "crate", position_m = [1, 0, 0], rotation_deg = [0, 0, 30], box = { size_m = [1, 2, 3] } }]
        "#;
        let scene =
            crate::SceneConfig::from_text(text, std::path::Path::new("a.toml")).unwrap().build().unwrap();
        for scale in [[1.0, 1.0, 1.0], [2.0, 0.5, 1.0], [-2.0, 1.0, 1.0]] {
            let mut edit = scene.edit();
            let to =
                serde_json::json!({ "position_m": [0, 5, 0], "rotation_deg": [0, 90, 0], "scale": scale });
            edit.move_object("crate", to.as_object().unwrap()).unwrap();
            let map = edit.finish();
            let map = map.world_from_proxy(&map.vpls.proxies[0]);
            let unit = map.matrix3.transpose() * map.matrix3;
            assert!(unit.abs_diff_eq(glam::DMat3::IDENTITY, 1e-12), "{scale:?}: {unit}");
            assert!((map.matrix3.determinant() - 1.0).abs() < 1e-12, "{scale:?}");
            // What was at x = 1 is at z = -1, times the stretch along x.
            let expected = DVec3::new(0.0, 5.0, -scale[0]);
            assert!(map.translation.abs_diff_eq(expected, 1e-9), "{scale:?}: {}", map.translation);
        }
    }

    /// The hull of a box's corners is met where the box is: 500 rays. Tolerance: a few roundings of f64.
    #[test]
    fn a_hull_of_corners_is_the_box() {
        let corner = |i: i32| {
            let sign = |bit: i32| f64::from(i >> bit & 1) * 2.0 - 1.0;
            DVec3::new(sign(0), 1.0 + 2.0 * sign(1), 3.0 * sign(2))
        };
        let points: Vec<DVec3> = (0..8).map(corner).collect();
        let planes = hull(&points).unwrap();
        let hull = ProxyShape::Hull { points, planes };
        let mut hits = 0;
        for i in 0..500 {
            let angle = |k: f64| (f64::from(i) * k).sin();
            let origin = DVec3::new(angle(1.1), angle(2.3), angle(3.7)) * 6.0;
            let towards = DVec3::new(angle(5.1) * 2.0, 1.0 + 3.0 * angle(7.3), angle(9.7) * 4.0);
            let direction = towards - origin;
            let (a, b) = (cube().intersect(origin, direction), hull.intersect(origin, direction));
            assert_eq!(a.is_some(), b.is_some(), "{origin} {direction}");
            if let (Some(a), Some(b)) = (a, b) {
                assert!((a - b).abs() < 1e-9 * a.max(1.0), "{a} {b}");
                hits += 1;
            }
        }
        assert!(hits > 100 && hits < 400, "{hits}");
    }
}
