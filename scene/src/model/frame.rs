//! Turns the geometry of a file without axes and units, an OBJ or PLY, into the likely ones.

use super::survey::Survey;
use crate::{config::UpAxis, scene::Scene};
use glam::Vec3;
use photonstream_shading::surface;

/// Longest sides of models that are taken for metres, m.
const PLAUSIBLE_M: std::ops::RangeInclusive<f64> = 0.01..=200.0;

/// Metres in a unit: 1 where the longest side is then 1 cm to 200 m, else the power of ten that makes it 1 to 10 m.
pub(super) fn unit_m(longest: f64) -> f64 {
    if PLAUSIBLE_M.contains(&longest) || longest.is_nan() || longest <= 0.0 {
        return 1.0;
    }
    10f64.powf(-longest.log10().floor())
}

/// The axis that points up, and why, of a scene that was read with y up.
///
/// Y, but for interiors of mostly level and upright walls that are much flatter along z than along x and y, or that are
/// open towards +z alone and whose leaning faces turn about z unlike about x and y, which are alike: columns and arches.
pub(super) fn up_axis(scene: &Scene, survey: &Survey, is_interior: bool) -> (UpAxis, &'static str) {
    let (low, high) = scene.bvh.bounds();
    let extent = high - low;
    let Faces { aligned, about } = Faces::of(scene);
    if !is_interior || aligned < 0.5 {
        return (UpAxis::Y, "as most files have it");
    }
    if extent.z < 0.6 * extent.x.min(extent.y) {
        return (UpAxis::Z, "it is an interior, and flat along z");
    }
    let unlike = |a: f32, b: f32| (a - b).abs() / (a + b).max(1e-6);
    let horizontals_are_alike = unlike(about.x, about.y) < 0.2 && unlike(about.x, about.z) > 0.4;
    if survey.opening.z > 0.9 && horizontals_are_alike {
        return (UpAxis::Z, "it is open to the sky along z");
    }
    (UpAxis::Y, "as most files have it")
}

/// Shares of the area of all faces.
struct Faces {
    /// Of faces square to an axis.
    aligned: f32,
    /// Of faces that contain each axis, and are square to none.
    about: Vec3,
}

impl Faces {
    fn of(scene: &Scene) -> Self {
        let (mut all, mut aligned, mut about) = (0.0, 0.0, Vec3::ZERO);
        for (id, normal) in scene.geometry.normals.iter().enumerate() {
            let area = surface::area(scene.geometry.triangle(id as u32)) as f32;
            let n = normal.abs();
            all += area;
            if n.max_element() > 0.99 {
                aligned += area;
            } else {
                about += Vec3::select(n.cmplt(Vec3::splat(0.05)), Vec3::splat(area), Vec3::ZERO);
            }
        }
        Self { aligned: aligned / all, about: about / all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_are_no_metres_become_some() {
        for (longest, expected) in
            [(1.0, 1.0), (0.15, 1.0), (35.0, 1.0), (2953.0, 1e-3), (0.004, 1e3), (0.0, 1.0), (201.0, 1e-2)]
        {
            assert!((unit_m(longest) / expected - 1.0).abs() < 1e-12, "{longest}: {}", unit_m(longest));
        }
    }
}
