//! Turns lights into sums over their photons and over what they illuminate, and compares the two.

use super::*;
use crate::sobol::Sequence;

fn versine(half_angle_deg: f64) -> f32 {
    (2.0 * (half_angle_deg.to_radians() / 2.0).sin().powi(2)) as f32
}

fn spot(inner_deg: f64, outer_deg: f64) -> LightShape {
    LightShape::Spot {
        position: Vec3::new(0.3, 0.2, 0.1),
        direction: Vec3::new(2.0, -3.0, 6.0) / 7.0,
        versine_inner: versine(inner_deg),
        versine_outer: versine(outer_deg),
    }
}

const PATCH: LightShape = LightShape::Parallelogram {
    corner: Vec3::new(-0.2, 0.1, -0.3),
    edge_u: Vec3::new(0.5, 0.0, 0.0),
    edge_v: Vec3::new(0.1, 0.0, 0.7),
};
const TRIANGLE: LightShape = LightShape::Triangle {
    corner: Vec3::new(-0.2, 0.1, -0.3),
    edge_u: Vec3::new(0.5, 0.0, 0.0),
    edge_v: Vec3::new(0.1, 0.0, 0.7),
};
const BOUNDS: Bounds = Bounds { centre: Vec3::ZERO, radius: 2.0 };

/// All that leaves a light arrives on a sphere around it: ∫ E dA = P. Quasi-Monte Carlo over the sphere, N = 2^16
/// points × 1 emitter point; the 1 % allows for the discontinuous edge of the narrowest cone and the emitter's
/// own sampling noise (σ ≤ 0.3 %).
#[test]
fn all_emitted_power_arrives() {
    let n = 1 << 16;
    let radius = 3.0f32;
    for shape in [
        LightShape::Point { position: Vec3::X },
        spot(20.0, 30.0),
        spot(60.0, 60.0),
        spot(90.0, 180.0),
        PATCH,
        TRIANGLE,
    ] {
        let sum: f64 = (0..n)
            .map(|i| {
                let mut sample = Sequence::new(1, 1).sample(i);
                let normal = sampling::sphere(sample.next_2d());
                let arriving = shape.illuminate(normal * radius, sample.next_2d());
                arriving.map_or(0.0, |a| f64::from(a.irradiance.x * (-normal).dot(a.wi).max(0.0)))
            })
            .sum();
        let power = sum / n as f64 * 4.0 * core::f64::consts::PI * f64::from(radius * radius);
        assert!((power - 1.0).abs() < 0.01, "{shape:?}: {power}");
    }
}

/// The mean photon weight is 1 and photons start at the light. N = 2^14, stratified: error ≪ 1/√N; 0.1 %.
#[test]
fn photons_carry_all_power() {
    let n = 1 << 14;
    let directional = LightShape::Directional { direction: Vec3::NEG_Y };
    for shape in [
        LightShape::Point { position: Vec3::X },
        spot(0.04, 0.05),
        spot(10.0, 40.0),
        spot(90.0, 180.0),
        directional,
        PATCH,
        TRIANGLE,
    ] {
        let mut sum = 0.0;
        for i in 0..n {
            let photon = shape.emit(BOUNDS, &mut Sequence::new(3, 0).sample(i));
            assert!(photon.origin.is_finite() && (photon.direction.length() - 1.0).abs() < 1e-6);
            sum += f64::from(photon.weight.x);
        }
        assert!((sum / n as f64 - 1.0).abs() < 1e-3, "{shape:?}: {}", sum / n as f64);
    }
}

/// Photons and irradiance describe the same light: photons through a small cap agree with E there.
/// N = 2^20; each cap holds ≥ 4 000 photons, 4 σ = 6 %.
#[test]
fn photons_match_the_irradiance() {
    let n = 1 << 20;
    for shape in [spot(25.0, 40.0), PATCH, TRIANGLE] {
        let axis =
            if let LightShape::Spot { direction, .. } = shape { direction } else { shape.emitter_normal() };
        for tilt in [0.0f32, 0.2, 0.5] {
            let towards = (axis + Vec3::X * tilt).normalize();
            let (distance, cap) = (8.0f32, 0.5f32);
            let centre = towards * distance;
            let count: f64 = (0..n)
                .map(|i| {
                    let photon = shape.emit(BOUNDS, &mut Sequence::new(9, 0).sample(i));
                    let t = (centre - photon.origin).dot(towards) / photon.direction.dot(towards);
                    let hit = photon.origin + photon.direction * t;
                    if t > 0.0 && hit.distance(centre) < cap { f64::from(photon.weight.x) } else { 0.0 }
                })
                .sum();
            let irradiance: f64 = (0..4096)
                .map(|i| {
                    let mut sample = Sequence::new(11, 0).sample(i);
                    let p = sampling::disc(sample.next_2d()) * cap;
                    let x = centre + crate::basis::from_local(towards, Vec3::new(p.x, p.y, 0.0));
                    shape
                        .illuminate(x, sample.next_2d())
                        .map_or(0.0, |a| f64::from(a.irradiance.x * a.wi.dot(-towards).max(0.0)))
                })
                .sum::<f64>()
                / 4096.0;
            let (got, expected) = (count / n as f64, irradiance * f64::from(PI * cap * cap));
            let tolerance = 4.0 * (expected / n as f64).sqrt() + 0.01 * expected;
            assert!(
                (got - expected).abs() < tolerance,
                "{shape:?} tilt {tilt}: {got:e} against {expected:e}"
            );
        }
    }
}

#[test]
fn area_lights_emit_to_one_side_with_their_radiance() {
    let normal = PATCH.emitter_normal();
    assert!((normal - Vec3::NEG_Y).length() < 1e-6);
    assert!(PATCH.illuminate(Vec3::Y * 2.0, [0.5, 0.5]).is_none());
    let light = Light { shape: PATCH, power: Vec3::splat(7.0) };
    assert!((light.emitted_radiance().x - 7.0 / (PI * 0.35)).abs() < 1e-4);
    assert_eq!(TRIANGLE.area() * 2.0, PATCH.area());
}

#[test]
fn a_light_at_the_receiver_is_finite() {
    let light = LightShape::Point { position: Vec3::ONE };
    assert_eq!(light.illuminate(Vec3::ONE, [0.5; 2]), None);
    assert!(light.illuminate(Vec3::ONE + Vec3::X * 1e-6, [0.5; 2]).is_none_or(|a| a.irradiance.is_finite()));
}

#[test]
fn directional_photons_cover_the_bounds() {
    let shape = LightShape::Directional { direction: Vec3::new(0.6, -0.8, 0.0) };
    assert!((shape.watts_per_power(BOUNDS) - 4.0 * PI).abs() < 1e-5);
    for i in 0..1000 {
        let photon = shape.emit(BOUNDS, &mut Sequence::new(5, 0).sample(i));
        assert!((BOUNDS.centre - photon.origin).dot(photon.direction) > BOUNDS.radius);
        let miss = (BOUNDS.centre - photon.origin).cross(photon.direction).length();
        assert!(miss <= BOUNDS.radius * 1.0001);
    }
}
