//! Turns the form factor of polygons (kernel `patch`), evaluated in f32 and in f64, into error bounds in ulps.
//!
//! The sum of edges (METHODS §2) has an absolute error, not a relative one: what remains of a polygon seen edge-on is a
//! difference of angles. An edge of angle θ adds n · (a × b)/|a × b| · θ/(2π). Each component of a × b is wrong by at most
//! one ulp of |a||b|, which is 1/sin θ ulps of |a × b|; its direction and its length so by 2 √3/sin θ together; the product
//! with n by 3, the angle by 2.5 (3e-7). A point where the horizon cuts the edge from a to b is a mean of both with weights
//! u and v; its place is wrong by some ulps of κ = (u|a| + v|b|)/|u a + v b| of its distance, which turns both its edges by
//! κ/sin θ as much. (Along the edge it is wrong by more where that grazes the horizon, but what is there arrives with a
//! cosine of 0.) So the factor is within 6.5 ulps of S = Σ ((1 + κ_a + κ_b) θ/sin θ + 1)/(2π), κ = 0 for given corners: half
//! an ulp for each edge that is neither very short nor seen along its length; without bound where an edge runs through the
//! receiver, whose side of it the given numbers then do not tell. `exact` returns S beside the factor.

use super::{EPS, Figure, Worst};
use glam::{DVec3, Vec3};
use photonstream_shading::{basis, patch, sampling, sobol::Sequence};
use std::f64::consts::PI;

/// Ulps of S: see above.
const LIMIT: f64 = 6.5;

/// The form factor in f64, its angles by the library's arc tangent; and S.
fn exact(corners: &[Vec3], n: Vec3) -> (f64, f64) {
    let n = n.as_dvec3();
    let mut kept: Vec<(DVec3, f64)> = Vec::new();
    for (i, to) in corners.iter().enumerate() {
        let (from, to) = (corners[(i + corners.len() - 1) % corners.len()].as_dvec3(), to.as_dvec3());
        let (height_from, height) = (n.dot(from), n.dot(to));
        if (height > 0.0) != (height_from > 0.0) {
            let whole = height_from - height;
            let (a, b) = (from * (-height / whole), to * (height_from / whole));
            kept.push((a + b, (a.length() + b.length()) / (a + b).length()));
        }
        if height > 0.0 {
            kept.push((to, 0.0));
        }
    }
    let (mut factor, mut condition) = (0.0, 0.0);
    for (i, &(to, cut_to)) in kept.iter().enumerate() {
        let (from, cut_from) = kept[(i + kept.len() - 1) % kept.len()];
        let across = from.cross(to);
        let sine = across.length();
        if sine > 0.0 {
            let angle = sine.atan2(from.dot(to));
            factor -= n.dot(across) / sine * angle / (2.0 * PI);
            let slender = angle * from.length() * to.length() / sine;
            condition += ((1.0 + cut_from + cut_to) * slender + 1.0) / (2.0 * PI);
        }
    }
    (factor.clamp(0.0, 1.0), condition)
}

/// The same in f32 with Lambert's own arc cosines, to show what they cost.
fn by_arc_cosines(corners: &[Vec3], n: Vec3) -> f32 {
    let from = |i: usize| corners[(i + corners.len() - 1) % corners.len()];
    let edge = |(i, to): (usize, &Vec3)| {
        let angle = from(i).normalize().dot(to.normalize()).clamp(-1.0, 1.0).acos();
        n.dot(from(i).cross(*to).normalize_or_zero()) * angle
    };
    -corners.iter().enumerate().map(edge).sum::<f32>() / (2.0 * std::f32::consts::PI)
}

/// Errors of many polygons.
#[derive(Default)]
struct Errors {
    /// In ulps of S.
    by_edges: Worst,
    /// In ulps of 1.
    absolute: Worst,
    arc_cosines: Worst,
    count: u64,
}

impl Errors {
    fn take(&mut self, corners: &[Vec3], n: Vec3) {
        let mut middle = Vec3::ZERO;
        let found = patch::form_factor(corners, n, &mut middle);
        let (factor, condition) = exact(corners, n);
        let error = (f64::from(found) - factor).abs() / EPS;
        let is_bounded = (0.0..=1.0).contains(&found);
        self.by_edges.take(if is_bounded && condition > 0.0 {
            error / condition
        } else if is_bounded {
            error
        } else {
            f64::NAN
        });
        self.absolute.take(error);
        self.arc_cosines.take((f64::from(by_arc_cosines(corners, n)) - factor).abs() / EPS);
        self.count += 1;
    }

    fn figures(&self, what: &str) -> Vec<Figure> {
        // Nothing measured is nothing shown.
        let by_edges = if self.count > 0 { self.by_edges } else { Worst(f64::INFINITY) };
        vec![Figure::new(format!("kernel patch, {what}, ulps of its edges' bound"), by_edges, LIMIT)]
    }
}

/// A regular polygon of 3 to 8 corners around `centre`, counter-clockwise around `normal`.
fn polygon(centre: Vec3, normal: Vec3, radius: f32, corners: usize) -> Vec<Vec3> {
    let (u, v) = basis::tangents(normal);
    let at = |k: usize| {
        let turn = (k as f32 + 0.3) / corners as f32 * std::f32::consts::TAU;
        centre + (u * turn.cos() + v * turn.sin()) * radius
    };
    (0..corners).map(at).collect()
}

/// A polygon seen by a receiver in the origin, from before: its centre 1 m away, its radius 0.2 to 1.5 m (kernel `patch` is
/// a polygon up to 3.2 √A away); and the receiver's normal.
fn seen(seed: u64, i: u64) -> Option<(Vec<Vec3>, Vec3)> {
    let mut sample = Sequence::new(seed, 0).sample(i);
    let mut direction = || sampling::sphere(sample.next_2d()).normalize();
    let (centre, normal, n) = (direction(), direction(), direction());
    let radius = 0.2 + 1.3 * sample.next_1d();
    let is_before = normal.dot(centre) < -0.1;
    is_before.then(|| (polygon(centre, normal, radius, 3 + i as usize % 6), n))
}

/// Polygons whole above the horizon. Seed 14; some eighth of the samples is such.
pub(super) fn random_polygons(samples: u64) -> Vec<Figure> {
    let mut errors = Errors::default();
    for (corners, n) in (0..samples).filter_map(|i| seen(14, i)) {
        if corners.iter().all(|c| n.dot(*c) > 0.0) {
            errors.take(&corners, n);
        }
    }
    errors.figures("above the horizon")
}

/// Polygons of which some corners lie below the horizon. Seed 15.
pub(super) fn across_the_horizon(samples: u64) -> Vec<Figure> {
    let mut errors = Errors::default();
    for (corners, n) in (0..samples).filter_map(|i| seen(15, i)) {
        let above = corners.iter().filter(|c| n.dot(**c) > 0.0).count();
        if above > 0 && above < corners.len() {
            errors.take(&corners, n);
        }
    }
    errors.figures("across the horizon")
}

/// Near-parallel: the polygon is seen edge-on, or stands on the horizon, down to 10⁻⁷; what is left of it is a difference of
/// angles. Seed 16.
pub(super) fn near_parallel(samples: u64) -> Vec<Figure> {
    let mut errors = Errors::default();
    for i in 0..samples {
        let mut sample = Sequence::new(16, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d()).normalize();
        let (centre, normal, n) = (direction(), direction(), direction());
        let tilt = 10f32.powf(-7.0 * (i as f32 / samples as f32));
        let tilted = |v: Vec3, towards: f32| (v - centre * (v.dot(centre) - towards)).normalize();
        let normal = if i % 3 == 0 { normal } else { tilted(normal, -tilt) };
        let n = if i % 3 == 1 { n } else { tilted(n, tilt) };
        // Before its plane, as renderers ask first.
        if normal.dot(centre) < 0.0 {
            let radius = 0.2 + 0.7 * sample.next_1d();
            errors.take(&polygon(centre, normal, radius, 3 + i as usize % 6), n);
        }
    }
    errors.figures("edge-on or on the horizon")
}

/// Near-contact: 10⁻¹ to 10⁻⁵ m before the middle, an edge or a corner of a polygon 0.6 m wide, in a room of 10 m. The
/// differences of positions are those of the given f32 points. Seed 17.
pub(super) fn near_contact(samples: u64) -> Vec<Figure> {
    let mut errors = Errors::default();
    for i in 0..samples {
        let mut sample = Sequence::new(17, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d()).normalize();
        let (normal, n) = (direction(), direction());
        let world = polygon(Vec3::new(3.0, 4.0, -2.0), normal, 0.3, 3 + i as usize % 6);
        let at = match i % 3 {
            0 => Vec3::new(3.0, 4.0, -2.0),
            1 => world[0].lerp(world[1], sample.next_1d()),
            _ => world[0],
        };
        let receiver = at + normal * 10f32.powf(-1.0 - 4.0 * (i as f32 / samples as f32));
        let corners: Vec<Vec3> = world.iter().map(|c| *c - receiver).collect();
        if normal.dot(corners[0]) < 0.0 {
            errors.take(&corners, n);
        }
    }
    errors.figures("in contact")
}

/// Slivers 1 : 10⁶, whose two long edges all but cancel; angles by f32 arc cosines are at least ten times as wrong, or the
/// slivers were not hard enough to tell. Seed 18.
pub(super) fn slivers(samples: u64) -> Vec<Figure> {
    let mut errors = Errors::default();
    for i in 0..samples {
        let mut sample = Sequence::new(18, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d()).normalize();
        let (a, along, across, n) = (direction(), direction(), direction(), direction());
        let a = a * (0.1 + 1.9 * sample.next_1d());
        let sliver = [a, a + along, a + along * 0.5 + across * 1e-6];
        let is_before = (sliver[1] - a).cross(sliver[2] - a).dot(a) < 0.0;
        if is_before && sliver.iter().all(|c| n.dot(*c) > 0.0) {
            errors.take(&sliver, n);
        }
    }
    let mut figures = errors.figures("slivers");
    let share = Worst(errors.absolute.0 / errors.arc_cosines.0);
    figures.push(Figure::new("their error over that of f32 arc cosines", share, 0.1));
    figures
}
