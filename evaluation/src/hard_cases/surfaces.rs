//! Turns normals and directions, evaluated in f32 and in f64, into error bounds in ulps of 1.

use super::{EPS, Figure, Worst};
use glam::Vec3;
use photonstream_shading::{camera::Camera, octahedral, sampling, sobol::Sequence, surface};

/// Normals of slivers (1 : 10⁶) far from the origin: cross products are taken in f64, so that the normal is right to an ulp
/// of 1 though the f32 cross product has none of its digits left: its error is at least ten times as large, or slivers were
/// not hard enough to tell. Seed 12, a tenth of the samples.
pub(super) fn slivers(samples: u64) -> Vec<Figure> {
    let (mut worst, mut plain) = (Worst::default(), Worst::default());
    for i in 0..samples.div_ceil(10) {
        let mut sample = Sequence::new(12, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d());
        let (a, along) = (direction() * 500.0, direction());
        let b = a + along;
        let c = a + along * 0.5 + direction() * 1e-3;
        let t = [a, b, c];
        let Some(normal) = surface::normal(t) else { continue };
        let [a, b, c] = t.map(Vec3::as_dvec3);
        let exact = (b - a).cross(c - a).normalize();
        worst.take((normal.as_dvec3() - exact).length() / EPS);
        let in_f32 = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        plain.take((in_f32.as_dvec3() - exact).length() / EPS);
    }
    vec![
        Figure::new("normals of slivers, ulps of 1", worst, 1.0),
        Figure::new("their error over that of f32 cross products", Worst(worst.0 / plain.0), 0.1),
    ]
}

/// Octahedral directions and camera rays: 4 ulps of 1. Seed 13.
pub(super) fn directions(samples: u64) -> Vec<Figure> {
    let (mut there_and_back, mut length) = (Worst::default(), Worst::default());
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0);
    for i in 0..samples {
        let mut sample = Sequence::new(13, 0).sample(i);
        let n = sampling::sphere(sample.next_2d()).normalize();
        there_and_back.take(f64::from((octahedral::decode(octahedral::encode(n)) - n).length()) / EPS);
        let [x, y] = sample.next_2d();
        let ray = camera.as_ref().map(|c| c.direction(x * 800.0, y * 600.0, 800, 600).as_dvec3());
        length.take(ray.map_or(f64::NAN, |ray| (ray.length() - 1.0).abs() / EPS));
    }
    vec![
        Figure::new("octahedral there and back, ulps of 1", there_and_back, 4.0),
        Figure::new("length of camera rays, ulps of 1", length, 4.0),
    ]
}
