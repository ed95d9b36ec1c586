//! Turns closed forms evaluated in f32 and in f64 into error bounds in ulps, near-parallel and near-contact ones included.

use crate::rooms::figure;
use glam::{DVec3, Vec3};
use photonstream_shading::{
    Kernel, LightShape, camera::Camera, kernel::range_sq, octahedral, sampling, sobol::Sequence, surface,
};
use std::f64::consts::PI;

const EPS: f64 = f32::EPSILON as f64;
const SAMPLES: u64 = 200_000;

/// Ulps of f32 (2⁻²³, relative) by which `found` differs from `exact`.
fn ulps(found: f32, exact: f64) -> f64 {
    (f64::from(found) - exact).abs() / (exact.abs() * EPS)
}

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
fn pairs(seed: u64) -> impl Iterator<Item = Pair> {
    (0..SAMPLES).map(move |i| {
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
/// N = 200 000, seed 7. A kernel with 1/(r·r·r·r) in another order, or a normalisation by an approximate root (as fast
/// inverse roots of GPUs, 2⁻¹²), would show as thousands of ulps.
#[test]
fn kernels_are_within_ulps_of_double_precision() {
    for kernel in [Kernel::Paper, Kernel::Disc] {
        let mut worst = 0.0f64;
        for Pair { d, n, n_s, area } in pairs(7) {
            let exact = transfer(kernel, d.as_dvec3(), n.as_dvec3(), n_s.as_dvec3(), area.into());
            let r = d.as_dvec3().normalize();
            if n.as_dvec3().dot(r) < 0.1 || -n_s.as_dvec3().dot(r) < 0.1 {
                continue;
            }
            worst = worst.max(ulps(kernel.transfer(d, n, n_s, area), exact));
        }
        figure(&format!("kernel {kernel}, ulps"), worst, 30.0);
    }
}

/// Near-parallel: receiver or light is seen at grazing angles down to 10⁻⁷. A cosine is then a difference of rounded
/// products, and its relative error has no bound; its absolute error has: 3 ulps of 1. So the transfer is within 6 ulps
/// times the kernel without cosines, which is what a picture sees beside its other lights.
///
/// N = 200 000, seed 8. Where both planes are met exactly nothing arrives, not noise of either sign: `max(0, ·)`.
#[test]
fn grazing_pairs_lose_nothing_but_absolute_ulps() {
    for kernel in [Kernel::Paper, Kernel::Disc] {
        let mut worst = 0.0f64;
        for (i, Pair { d, n, n_s, area }) in pairs(8).enumerate() {
            let tilt = 10f32.powf(-7.0 * (i as f32 / SAMPLES as f32));
            let r = d.normalize();
            // The normals, all but perpendicular to the way between.
            let n = (n - r * (n.dot(r) - tilt)).normalize();
            let n_s = if i % 2 == 0 { (n_s - r * (n_s.dot(r) + tilt)).normalize() } else { n_s };
            let exact = transfer(kernel, d.as_dvec3(), n.as_dvec3(), n_s.as_dvec3(), area.into());
            let found = f64::from(kernel.transfer(d, n, n_s, area));
            assert!(found >= 0.0 && found.is_finite());
            let r_sq = d.as_dvec3().length_squared();
            let whole = 1.0 / (PI * r_sq + if kernel == Kernel::Disc { f64::from(area) } else { 0.0 });
            worst = worst.max((found - exact).abs() / (whole * EPS));
        }
        figure(&format!("kernel {kernel} at grazing angles, ulps of its bound"), worst, 6.0);
    }
}

/// Near-contact: receiver and light 10⁻¹ to 10⁻⁵ m apart, in a room of 10 m. What cancels is the difference of positions;
/// it is exact (Sterbenz) once they are nearer than half their coordinates, so that the kernel of the *given* f32 points is
/// as accurate as far away; and bounded by 1/A for `disc`, however near. Both hold down to the same point, which gives 0.
///
/// N = 200 000, seed 9; 30 ulps as far away. A difference of products (|x|² + |y|² − 2 x·y), which some write for many
/// lights, would lose all digits at 10⁻³ m.
#[test]
fn pairs_in_contact_are_as_exact_and_bounded() {
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for (i, Pair { d, n, n_s, .. }) in pairs(9).enumerate() {
        let distance = 10f32.powf(-1.0 - 4.0 * (i as f32 / SAMPLES as f32));
        let x = Vec3::new(3.0, 4.0, -2.0) + n * 0.5;
        let light = x + d.normalize() * distance;
        let exact_d = light.as_dvec3() - x.as_dvec3();
        let area = 0.01f32;
        let found = Kernel::Disc.transfer(light - x, n, n_s, area);
        assert!(found.is_finite() && found >= 0.0);
        largest = largest.max(f64::from(found * area));
        let r = exact_d.normalize_or_zero();
        if n.as_dvec3().dot(r) > 0.1 && -n_s.as_dvec3().dot(r) > 0.1 {
            worst = worst
                .max(ulps(found, transfer(Kernel::Disc, exact_d, n.as_dvec3(), n_s.as_dvec3(), area.into())));
        }
    }
    figure("kernel disc in contact, ulps", worst, 30.0);
    figure("kernel disc in contact, times A", largest, 1.0 + 4.0 * EPS);
    for kernel in Kernel::ALL {
        assert_eq!(kernel.transfer(Vec3::ZERO, Vec3::Y, Vec3::NEG_Y, 0.01), 0.0);
    }
}

/// Distances whose fourth power leaves f32: nothing but numbers, and never more than the exact value by more than ulps. The
/// smallest coordinates of a scene of 10⁻⁹ m and the largest of 10⁹ m: there the kernel is 0 where the exact one is below
/// 10⁻¹⁹ m⁻² (no light of 10¹⁵ W shows), or where it is nearer than 10⁻⁹ m.
#[test]
fn distances_beyond_the_fourth_power_give_numbers() {
    for kernel in [Kernel::Paper, Kernel::Disc] {
        for exponent in -45..=9 {
            for area in [0.0, f32::MIN_POSITIVE, 1e-30, 1.0, 1e18] {
                let d = Vec3::Y * 10f32.powi(exponent);
                let found = kernel.transfer(d, Vec3::Y, Vec3::NEG_Y, area);
                let exact = transfer(kernel, d.as_dvec3(), DVec3::Y, DVec3::NEG_Y, area.into());
                assert!(found >= 0.0, "{kernel}, 10^{exponent} m, {area} m²: {found}");
                if (-8..=8).contains(&exponent) && area != f32::MIN_POSITIVE {
                    assert!(
                        ulps(found, exact) <= 8.0,
                        "{kernel}, 10^{exponent} m, {area} m²: {found} for {exact}"
                    );
                }
            }
        }
    }
}

/// The range within which a light can add ε: 4 ulps, and infinite for none.
#[test]
fn ranges_are_within_ulps() {
    let mut worst = 0.0f64;
    for i in 0..SAMPLES {
        let mut sample = Sequence::new(10, 0).sample(i);
        let mut decade = |low: f32, high: f32| 10f32.powf(low + (high - low) * sample.next_1d());
        let (flux, albedo, epsilon) = (decade(-9.0, 9.0), decade(-3.0, 0.0), decade(-9.0, 0.0));
        let exact = f64::from(flux) * f64::from(albedo) / (PI * PI * f64::from(epsilon));
        worst = worst.max(ulps(range_sq(flux, albedo, epsilon), exact));
    }
    figure("range, ulps", worst, 4.0);
    assert_eq!(range_sq(1.0, 1.0, 0.0), f32::INFINITY);
}

/// Irradiance of point lights, of area lights away from their own plane, and of spots within their inner cone: 1/(4 π r²),
/// cos/(π r²), 1/(π (v_i + v_o) r²). The position's difference is taken in f32, as renderers do: 10 m and farther from
/// the light at coordinates of 10 m, so that it costs an ulp or two. N = 200 000, seed 11;
/// 32 ulps; 160 for area lights, whose samples stand off their surface.
#[test]
fn lights_are_within_ulps_of_double_precision() {
    let mut worst = [0.0f64; 3];
    let (position, axis) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(2.0, -3.0, 6.0) / 7.0);
    let versine = |degrees: f64| (2.0 * (degrees.to_radians() / 2.0).sin().powi(2)) as f32;
    let (inner, outer) = (versine(60.0), versine(80.0));
    let spot = LightShape::Spot { position, direction: axis, versine_inner: inner, versine_outer: outer };
    let (edge_u, edge_v) = (Vec3::new(0.5, 0.0, 0.25), Vec3::new(0.0, 0.5, 0.125));
    let area = LightShape::Parallelogram { corner: position, edge_u, edge_v };
    let normal = edge_u.as_dvec3().cross(edge_v.as_dvec3()).normalize();
    for i in 0..SAMPLES {
        let mut sample = Sequence::new(11, 0).sample(i);
        let direction = sampling::sphere(sample.next_2d());
        let x = position + direction * (10.0 + 90.0 * sample.next_1d());
        let d = position.as_dvec3() - x.as_dvec3();
        let r_sq = d.length_squared();
        let point = LightShape::Point { position }.illuminate(x, [0.5; 2]).unwrap().irradiance;
        worst[0] = worst[0].max(ulps(point, 1.0 / (4.0 * PI * r_sq)));
        if -d.normalize().dot(axis.as_dvec3()) > 0.51 {
            let exact = 1.0 / (PI * (f64::from(inner) + f64::from(outer)) * r_sq);
            worst[1] = worst[1].max(ulps(spot.illuminate(x, [0.5; 2]).unwrap().irradiance, exact));
        }
        let d = d + (edge_u * 0.5 + edge_v * 0.5).as_dvec3();
        let cos = -d.normalize().dot(normal);
        if cos > 0.1 {
            // The sample stands 2⁻¹⁸ of 3.5 m off its surface, 11 ulps of the distance: twice, and in a cosine of 0.1.
            let found = area.illuminate(x, [0.5; 2]).unwrap().irradiance;
            worst[2] = worst[2].max(ulps(found, cos / (PI * d.length_squared())));
        }
    }
    figure("point light, ulps", worst[0], 32.0);
    figure("spot, ulps", worst[1], 32.0);
    figure("area light, ulps", worst[2], 160.0);
}

/// Normals and areas of slivers (1 : 10⁶) far from the origin: cross products are taken in f64, so that the normal is right
/// to an ulp of 1 though the f32 cross product has none of its digits left.
#[test]
fn slivers_have_the_normals_of_double_precision() {
    let (mut worst, mut plain) = (0.0f64, 0.0f64);
    for i in 0..20_000 {
        let mut sample = Sequence::new(12, 0).sample(i);
        let mut direction = || sampling::sphere(sample.next_2d());
        let (a, along) = (direction() * 500.0, direction());
        let b = a + along;
        let c = a + along * 0.5 + direction() * 1e-3;
        let t = [a, b, c];
        let Some(normal) = surface::normal(t) else { continue };
        let [a, b, c] = t.map(Vec3::as_dvec3);
        let exact = (b - a).cross(c - a).normalize();
        worst = worst.max((normal.as_dvec3() - exact).length());
        let in_f32 = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        plain = plain.max((in_f32.as_dvec3() - exact).length());
    }
    figure("normals of slivers, ulps of 1", worst / EPS, 1.0);
    println!("the same in f32: {:.1e} ulps", plain / EPS);
    assert!(plain > 10.0 * worst, "slivers are not hard enough to tell f32 from f64: {plain:e}");
}

/// Octahedral directions and camera rays: 4 ulps of 1. N = 200 000, seed 13.
#[test]
fn directions_are_within_ulps_of_one() {
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0).unwrap();
    let (mut there_and_back, mut length) = (0.0f64, 0.0f64);
    for i in 0..SAMPLES {
        let mut sample = Sequence::new(13, 0).sample(i);
        let n = sampling::sphere(sample.next_2d()).normalize();
        there_and_back =
            there_and_back.max(f64::from((octahedral::decode(octahedral::encode(n)) - n).length()));
        let [x, y] = sample.next_2d();
        let ray = camera.direction(x * 800.0, y * 600.0, 800, 600).as_dvec3();
        length = length.max((ray.length() - 1.0).abs());
    }
    figure("octahedral there and back, ulps of 1", there_and_back / EPS, 4.0);
    figure("length of camera rays, ulps of 1", length / EPS, 4.0);
}
