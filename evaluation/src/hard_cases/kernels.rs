//! Turns the kernels of points and discs, and the range, evaluated in f32 and in f64, into error bounds in ulps.

use super::{EPS, Figure, Worst, ulps};
use glam::{DVec3, Vec3};
use photonstream_shading::{Kernel, kernel::range_sq, sampling, sobol::Sequence};
use std::f64::consts::PI;

const POINTS_AND_DISCS: [Kernel; 2] = [Kernel::Paper, Kernel::Disc];

/// cos θ cos θ_s K in f64: METHODS §2.
fn transfer(kernel: Kernel, d: DVec3, n: DVec3, n_s: DVec3, area: f64) -> f64 {
    let r_sq = d.length_squared();
    let area = if kernel == Kernel::Disc { area } else { 0.0 };
    let cosines = n.dot(d).max(0.0) * (-n_s.dot(d)).max(0.0);
    if cosines > 0.0 { cosines / (r_sq * (PI * r_sq + area)) } else { 0.0 }
}

struct Pair {
    d: Vec3,
    n: Vec3,
    n_s: Vec3,
    area: f32,
}

/// Random pairs of a receiver and a light: all directions, distances 10⁻⁶ to 10⁶ m, areas 10⁻⁸ to 10⁴ of r².
fn pairs(samples: u64, seed: u64) -> impl Iterator<Item = Pair> {
    (0..samples).map(move |i| {
        let mut sample = Sequence::new(seed, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d()).normalize();
        let (d, n, n_s) = (direction(), direction(), direction());
        let r = 10f32.powf(sample.next_1d() * 12.0 - 6.0);
        let area = r * r * 10f32.powf(sample.next_1d() * 12.0 - 8.0);
        Pair { d: d * r, n, n_s, area }
    })
}

/// Kernels away from the planes of both sides (cosines above 0.1): the scalar products have three products and two sums
/// each, whose errors are at most 1.5 ulp of 1, divided by 0.1; 30 ulps at most, a handful usually.
///
/// Seed 7. A kernel with 1/(r·r·r·r) in another order, or a normalisation by an approximate root (as fast inverse roots of
/// GPUs, 2⁻¹²), would show as thousands of ulps.
pub(super) fn away_from_the_planes(samples: u64) -> Vec<Figure> {
    let figure = |kernel: Kernel| {
        let mut worst = Worst::default();
        for Pair { d, n, n_s, area } in pairs(samples, 7) {
            let exact = transfer(kernel, d.as_dvec3(), n.as_dvec3(), n_s.as_dvec3(), area.into());
            let r = d.as_dvec3().normalize();
            if n.as_dvec3().dot(r) >= 0.1 && -n_s.as_dvec3().dot(r) >= 0.1 {
                let found = kernel.transfer(d, n, n_s, area);
                worst.take_light(found, ulps(found, exact));
            }
        }
        Figure::new(format!("kernel {kernel}, ulps"), worst, 30.0)
    };
    POINTS_AND_DISCS.map(figure).to_vec()
}

/// Near-parallel: receiver or light is seen at grazing angles down to 10⁻⁷. A cosine is then a difference of rounded
/// products, and its relative error has no bound; its absolute error has: 3 ulps of 1. So the transfer is within 6 ulps
/// times the kernel without cosines, which is what a picture sees beside its other lights.
///
/// Seed 8. Where both planes are met exactly nothing arrives, not noise of either sign: `max(0, ·)`.
pub(super) fn near_parallel(samples: u64) -> Vec<Figure> {
    let figure = |kernel: Kernel| {
        let mut worst = Worst::default();
        for (i, Pair { d, n, n_s, area }) in pairs(samples, 8).enumerate() {
            let tilt = 10f32.powf(-7.0 * (i as f32 / samples as f32));
            let r = d.normalize();
            // The normals, all but perpendicular to the way between.
            let n = (n - r * (n.dot(r) - tilt)).normalize();
            let n_s = if i % 2 == 0 { (n_s - r * (n_s.dot(r) + tilt)).normalize() } else { n_s };
            let exact = transfer(kernel, d.as_dvec3(), n.as_dvec3(), n_s.as_dvec3(), area.into());
            let found = kernel.transfer(d, n, n_s, area);
            let r_sq = d.as_dvec3().length_squared();
            let whole = 1.0 / (PI * r_sq + if kernel == Kernel::Disc { f64::from(area) } else { 0.0 });
            worst.take_light(found, (f64::from(found) - exact).abs() / (whole * EPS));
        }
        Figure::new(format!("kernel {kernel} at grazing angles, ulps of its bound"), worst, 6.0)
    };
    POINTS_AND_DISCS.map(figure).to_vec()
}

/// Near-contact: receiver and light 10⁻¹ to 10⁻⁵ m apart, in a room of 10 m. What cancels is the difference of positions;
/// it is exact (Sterbenz) once they are nearer than half their coordinates, so that the kernel of the *given* f32 points is
/// as accurate as far away; and bounded by 1/A for `disc`, however near. Both hold down to the same point, which gives 0.
///
/// Seed 9; 30 ulps as far away. A difference of products (|x|² + |y|² − 2 x·y), which some write for many lights, would
/// lose all digits at 10⁻³ m.
pub(super) fn near_contact(samples: u64) -> Vec<Figure> {
    let (mut worst, mut largest, mut same) = (Worst::default(), Worst::default(), Worst::default());
    for (i, Pair { d, n, n_s, .. }) in pairs(samples, 9).enumerate() {
        let distance = 10f32.powf(-1.0 - 4.0 * (i as f32 / samples as f32));
        let x = Vec3::new(3.0, 4.0, -2.0) + n * 0.5;
        let light = x + d.normalize() * distance;
        let exact_d = light.as_dvec3() - x.as_dvec3();
        let area = 0.01f32;
        let found = Kernel::Disc.transfer(light - x, n, n_s, area);
        largest.take_light(found, f64::from(found * area));
        let r = exact_d.normalize_or_zero();
        if n.as_dvec3().dot(r) > 0.1 && -n_s.as_dvec3().dot(r) > 0.1 {
            let exact = transfer(Kernel::Disc, exact_d, n.as_dvec3(), n_s.as_dvec3(), area.into());
            worst.take(ulps(found, exact));
        }
    }
    for kernel in Kernel::ALL {
        let found = kernel.transfer(Vec3::ZERO, Vec3::Y, Vec3::NEG_Y, 0.01);
        same.take_light(found, found.into());
    }
    vec![
        Figure::new("kernel disc in contact, ulps", worst, 30.0),
        Figure::new("kernel disc in contact, times A", largest, 1.0 + 4.0 * EPS),
        Figure::new("all kernels at the same point, m⁻²", same, 0.0),
    ]
}

/// Distances whose fourth power leaves f32: nothing but numbers, and never more than the exact value by more than ulps. The
/// smallest coordinates of a scene of 10⁻⁹ m and the largest of 10⁹ m: there the kernel is 0 where the exact one is below
/// 10⁻¹⁹ m⁻² (no light of 10¹⁵ W shows), or where it is nearer than 10⁻⁹ m. No random number.
pub(super) fn extreme_distances(_samples: u64) -> Vec<Figure> {
    let (mut worst, mut negative) = (Worst::default(), Worst::default());
    for kernel in POINTS_AND_DISCS {
        for exponent in -45..=9 {
            for area in [0.0, f32::MIN_POSITIVE, 1e-30, 1.0, 1e18] {
                let d = Vec3::Y * 10f32.powi(exponent);
                let found = kernel.transfer(d, Vec3::Y, Vec3::NEG_Y, area);
                negative.take(if found >= 0.0 { 0.0 } else { f64::INFINITY });
                if (-8..=8).contains(&exponent) && area != f32::MIN_POSITIVE {
                    let exact = transfer(kernel, d.as_dvec3(), DVec3::Y, DVec3::NEG_Y, area.into());
                    worst.take(ulps(found, exact));
                }
            }
        }
    }
    vec![
        Figure::new("kernels at 10^±8 m, ulps", worst, 8.0),
        Figure::new("kernels from 10⁻⁴⁵ to 10⁹ m: negative, or no number", negative, 0.0),
    ]
}

/// The range within which a light can add ε: 4 ulps, and infinite for none. Seed 10.
pub(super) fn ranges(samples: u64) -> Vec<Figure> {
    let mut worst = Worst::default();
    for i in 0..samples {
        let mut sample = Sequence::new(10, 0).sample(i);
        let mut decade = |low: f32, high: f32| 10f32.powf(low + (high - low) * sample.next_1d());
        let (flux, albedo, epsilon) = (decade(-9.0, 9.0), decade(-3.0, 0.0), decade(-9.0, 0.0));
        let exact = f64::from(flux) * f64::from(albedo) / (PI * PI * f64::from(epsilon));
        worst.take(ulps(range_sq(flux, albedo, epsilon), exact));
    }
    if range_sq(1.0, 1.0, 0.0) != f32::INFINITY {
        worst.take(f64::INFINITY);
    }
    vec![Figure::new("range, ulps", worst, 4.0)]
}
