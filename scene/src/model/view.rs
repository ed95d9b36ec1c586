//! Turns the extent and the rooms of a scene into a camera that shows them.

use super::enclosure::Surroundings;
use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;
use photonstream_shading::Camera;

/// From bottom to top, degrees: of a view from outside.
const OUTSIDE_FOV_DEG: f32 = 40.0;
/// The same of a view in a room.
const INSIDE_FOV_DEG: f32 = 60.0;
/// Places in a room that are tried along each horizontal axis, and heights from which floors are looked for.
const PLACES: u32 = 15;
const HEIGHTS: u32 = 3;
/// Rays of a view that is tried.
const VIEW: (u32, u32) = (16, 12);

/// A camera in the space of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    pub(super) position: Vec3,
    pub(super) target: Vec3,
    pub(super) up: Vec3,
    pub(super) vertical_fov_deg: f32,
    /// Picture, pixels.
    pub(super) size: (u32, u32),
}

/// Width and height of pictures where a file does not say what their shape is.
pub(super) const SIZE: (u32, u32) = (800, 600);

impl View {
    pub(super) fn camera(&self) -> Option<Camera> {
        Camera::look_at(self.position, self.target, self.up, self.vertical_fov_deg)
    }

    /// The directions of a coarse grid of `columns` × `rows` pixels.
    pub(super) fn directions(&self, columns: u32, rows: u32) -> Vec<Vec3> {
        let Some(camera) = self.camera() else { return Vec::new() };
        let pixel = |i: u32| {
            let (x, y) = ((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5);
            let (width, height) = self.size;
            let scale = (width as f32 / columns as f32, height as f32 / rows as f32);
            camera.direction(x * scale.0, y * scale.1, width, height)
        };
        (0..columns * rows).map(pixel).collect()
    }
}

/// All of a scene from outside: 30° right of its front (+z) and 20° from above.
pub(super) fn outside(bounds: (Vec3, Vec3)) -> View {
    let (azimuth, elevation) = (30f32.to_radians(), 20f32.to_radians());
    let back = Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    from(bounds, back)
}

/// Into a room that is open to one side, from there; `None` where most of it is hidden by what stands in between.
pub(super) fn through_opening(scene: &Scene, opening: Vec3) -> Option<View> {
    let (low, high) = scene.bvh.bounds();
    let back = opening.with_y(0.0).try_normalize()?;
    let view = from((low, high), back);
    // Some way into the room.
    let near = view.position.distance((low + high) * 0.5) - 0.3 * ((high - low) * back).length();
    let directions = view.directions(VIEW.0, VIEW.1);
    let hits = directions.iter().filter_map(|&direction| {
        let hit = scene.bvh.closest(&Ray { origin: view.position, direction, t_max: f32::INFINITY })?;
        let faces = scene.geometry.normals[hit.triangle as usize].dot(direction) < 0.0;
        Some(faces && hit.t > near)
    });
    let (deep, all) = hits.fold((0, 0), |(deep, all), is_deep| (deep + u32::from(is_deep), all + 1));
    (2 * deep > all).then_some(view)
}

/// All of a box from `back`, of unit length.
fn from((low, high): (Vec3, Vec3), back: Vec3) -> View {
    let centre = (low + high) * 0.5;
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let tan = (OUTSIDE_FOV_DEG.to_radians() * 0.5).tan() / 1.1;
    let tan_across = tan * SIZE.0 as f32 / SIZE.1 as f32;
    let corners = (0..8).map(|i| {
        let pick = |bit: u32, low: f32, high: f32| if i & bit == 0 { low } else { high };
        Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z)) - centre
    });
    // So far that each corner is within the picture.
    let distance = corners
        .map(|c| (c.dot(right).abs() / tan_across).max(c.dot(up).abs() / tan) + c.dot(back))
        .fold(f32::MIN_POSITIVE, f32::max);
    View {
        position: centre + back * distance,
        target: centre,
        up: Vec3::Y,
        vertical_fov_deg: OUTSIDE_FOV_DEG,
        size: SIZE,
    }
}

/// The farthest view in a room: along one of the axes, from a third of the height above a floor; `None` where none is
/// found.
pub(super) fn inside(scene: &Scene) -> Option<View> {
    let (low, high) = scene.bvh.bounds();
    let size = (high - low).length();
    let along = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
    let places = (0..PLACES * PLACES * HEIGHTS).filter_map(|i| {
        let share = Vec3::new(
            along(i % PLACES, PLACES),
            along(i / (PLACES * PLACES), HEIGHTS),
            along(i / PLACES % PLACES, PLACES),
        );
        eye_above_floor(scene, low + (high - low) * share)
    });
    let views = places.flat_map(|(eye, escape)| {
        [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].map(|forward| {
            let target = eye + forward * (0.1 * size);
            let (up, vertical_fov_deg) = (Vec3::Y, INSIDE_FOV_DEG);
            (escape, View { position: eye, target, up, vertical_fov_deg, size: SIZE })
        })
    });
    // Rather in a hall than in a street between houses.
    let score = |escape: f32, view: &View| reach(scene, view, size) * (1.0 - escape);
    let scored = views.map(|(escape, view)| (score(escape, &view), view));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(best.1)
}

/// An eye in the room around `point` and the share of rays that leave from there, or nothing where there is no room or no
/// space for it.
fn eye_above_floor(scene: &Scene, point: Vec3) -> Option<(Vec3, f32)> {
    let (low, high) = scene.bvh.bounds();
    let height = high.y - low.y;
    let hit = |direction| {
        let hit = scene.bvh.closest(&Ray { origin: point, direction, t_max: f32::INFINITY });
        hit.map(|hit| hit.t)
    };
    let down = hit(Vec3::NEG_Y)?;
    let up = hit(Vec3::Y).unwrap_or(high.y - point.y);
    if down + up < 0.1 * height {
        return None;
    }
    let eye = point - Vec3::Y * (down - (down + up) / 3.0);
    let around = Surroundings::of(scene, eye);
    (around.is_room() && around.nearest > 0.01 * (high - low).length()).then_some((eye, around.escape))
}

/// How far a view reaches: the mean square root of the distances of what faces it, in shares of `size`; what is close
/// counts against it.
fn reach(scene: &Scene, view: &View, size: f32) -> f32 {
    let directions = view.directions(VIEW.0, VIEW.1);
    let sum: f32 = directions
        .iter()
        .map(|&direction| {
            let ray = Ray { origin: view.position, direction, t_max: f32::INFINITY };
            match scene.bvh.closest(&ray) {
                None => 0.0,
                Some(hit) if hit.t < 0.04 * size => -0.5,
                Some(hit) => {
                    let faces = scene.geometry.normals[hit.triangle as usize].dot(direction) < 0.0;
                    (hit.t / size).sqrt() * if faces { 1.0 } else { 0.5 }
                }
            }
        })
        .sum();
    sum / directions.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Boxes of any shape, their corners projected: all within the picture, and one near its edge.
    #[test]
    fn a_view_from_outside_holds_all_corners() {
        for size in
            [Vec3::ONE, Vec3::new(10.0, 0.0, 10.0), Vec3::new(0.1, 5.0, 0.1), Vec3::new(3.0, 1.0, 0.0)]
        {
            let view = outside((Vec3::splat(4.0), Vec3::splat(4.0) + size));
            let camera = view.camera().unwrap();
            let mut farthest = 0f32;
            for i in 0..8 {
                let share = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
                let to = Vec3::splat(4.0) + size * share - view.position;
                let depth = to.dot(camera.forward);
                assert!(depth > 0.0);
                let across = to.dot(camera.right) / depth / (camera.tan_half_fov * 4.0 / 3.0);
                farthest =
                    farthest.max(across.abs()).max((to.dot(camera.up) / depth / camera.tan_half_fov).abs());
            }
            assert!(farthest < 1.0 && farthest > 0.6, "{size}: {farthest}");
        }
    }
}
