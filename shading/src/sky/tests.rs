//! Turns skies into sums over their samples, and compares them with closed forms.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::{
    LightShape,
    light::Bounds,
    sobol::{Sample, Sequence},
};
use std::sync::Arc;

const N: u32 = 1 << 18;

fn samples() -> impl Iterator<Item = Sample> {
    (0..N).map(|i| Sequence::new(7, 3).sample(u64::from(i)))
}

fn gradient() -> Sky {
    Sky::gradient(DVec3::new(0.2, 0.4, 1.0), DVec3::new(0.9, 0.8, 0.6), DVec3::new(0.1, 0.05, 0.0))
}

/// A dark map with a gradient around and a sun of 10⁴ in one texel.
fn sunny(width: u32, height: u32) -> (Sky, Vec<[f32; 3]>) {
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        if (x, y) == (width / 3, height / 4) {
            return [1e4, 9e3, 8e3];
        }
        let around = x as f32 / width as f32;
        [0.1 + around, 0.3, if y > height / 2 { 0.0 } else { 1.0 - around }]
    };
    let texels: Vec<_> = (0..width * height).map(texel).collect();
    (Sky::map(width, height, &texels, 30.0), texels)
}

fn skies() -> Vec<Sky> {
    let red = Sky::gradient(DVec3::X, DVec3::ZERO, DVec3::ZERO);
    let constant = Sky::gradient(DVec3::splat(2.0), DVec3::splat(2.0), DVec3::splat(2.0));
    vec![constant, gradient(), red, sunny(32, 16).0, sunny(7, 5).0]
}

/// Of each sky the mean weight of its photons is 1 in each channel that shines, none weighs more than the number of
/// channels, and the mean radiance over uniform directions is 1. N = 2¹⁸ low-discrepancy points; 0.3 % for the weights, whose
/// errors are below 1/√N even if they were independent (σ ≤ 1.4/512), 3 % where a sun of 1/512
/// of the sphere is found by uniform directions.
#[test]
fn photons_carry_all_power_of_a_sky() {
    let bounds = Bounds { centre: Vec3::ONE, radius: 2.0 };
    for sky in skies() {
        let sky = Arc::new(sky);
        let shape = LightShape::Sky { sky: Arc::clone(&sky) };
        let (mut weights, mut uniform) = (DVec3::ZERO, DVec3::ZERO);
        for mut sample in samples() {
            let photon = shape.emit(bounds, &mut sample);
            assert!((photon.direction.length() - 1.0).abs() < 1e-6);
            assert!(photon.weight.max_element() <= sky.channels() * 1.0001, "{}", photon.weight);
            weights += photon.weight.as_dvec3();
            uniform += sky.relative(sampling::sphere(sample.next_2d())).as_dvec3();
        }
        for c in 0..3 {
            let expected = if sky.mean()[c] > 0.0 { 1.0 } else { 0.0 };
            let (weight, mean) = (weights[c] / f64::from(N), uniform[c] / f64::from(N));
            assert!((weight - expected).abs() < 0.003, "{sky:?}: weight {weight}");
            assert!((mean - expected).abs() < 0.03, "{sky:?}: mean {mean}");
        }
    }
}

/// What `illuminate` and `illuminate_surface` give is the irradiance: π L under a constant sky whatever the normal, and
/// π (h/3 + 2z/3) of a horizontal plane under a gradient, as ∫ L cos θ dω says; π g from below; under a map with a sun that of a
/// midpoint rule of 2 048 × 1 024 directions, also where the sun is below. N = 2¹⁸, half of them by the cosine, whose σ is
/// below 1/√2¹⁷ = 0.3 %; 1 %.
#[test]
fn surfaces_get_the_irradiance_of_the_hemisphere() {
    let irradiance = |sky: &Sky, normal: Vec3, above: bool| -> DVec3 {
        let shape = LightShape::Sky { sky: Arc::new(sky.clone()) };
        let sum: DVec3 = samples()
            .filter_map(|mut sample| {
                let u = sample.next_2d();
                let arriving = if above {
                    shape.illuminate_surface(Vec3::ZERO, normal, u)?
                } else {
                    shape.illuminate(Vec3::ZERO, u)?
                };
                assert!(!above || normal.dot(arriving.wi) > -1e-5);
                Some(arriving.irradiance.as_dvec3() * f64::from(normal.dot(arriving.wi).max(0.0)))
            })
            .sum();
        sum / f64::from(N) * sky.mean().as_dvec3()
    };
    let close = |found: DVec3, expected: DVec3| {
        assert!(
            (found - expected).abs().max_element() < 0.01 * expected.max_element(),
            "{found}, {expected}"
        );
    };
    let pi = std::f64::consts::PI;
    let constant = Sky::gradient(DVec3::splat(2.0), DVec3::splat(2.0), DVec3::splat(2.0));
    for normal in [Vec3::Y, Vec3::X, Vec3::new(2.0, -3.0, 6.0) / 7.0] {
        for above in [false, true] {
            close(irradiance(&constant, normal, above), DVec3::splat(2.0 * pi));
        }
        let (map, _) = sunny(32, 16);
        close(irradiance(&map, normal, true), midpoints(&map, normal));
    }
    for above in [false, true] {
        let found = irradiance(&gradient(), Vec3::Y, above);
        close(found, pi * (DVec3::new(0.9, 0.8, 0.6) / 3.0 + DVec3::new(0.2, 0.4, 1.0) * (2.0 / 3.0)));
        close(irradiance(&gradient(), Vec3::NEG_Y, above), pi * DVec3::new(0.1, 0.05, 0.0));
    }
}

/// ∫ L cos θ dω by a midpoint rule.
fn midpoints(sky: &Sky, normal: Vec3) -> DVec3 {
    let (columns, rows) = (2048, 1024);
    let mut sum = DVec3::ZERO;
    for row in 0..rows {
        let y = 1.0 - 2.0 * (row as f32 + 0.5) / rows as f32;
        for column in 0..columns {
            let (sin, cos) = ((column as f32 + 0.5) / columns as f32 * 2.0 * PI).sin_cos();
            let wi = Vec3::new(sin, 0.0, cos) * (1.0 - y * y).sqrt() + Vec3::Y * y;
            sum += sky.relative(wi).as_dvec3() * f64::from(normal.dot(wi).max(0.0));
        }
    }
    sum * sky.mean().as_dvec3() * (4.0 * std::f64::consts::PI / f64::from(rows * columns))
}

/// The samples of a map fall into its texels as its density says: χ² over 7 × 5 texels, N = 2¹⁸ points of a generator of its
/// own (independent, as χ² wants), seed 1; the 99.9 % quantile of χ² with 34 degrees of freedom is 65.2.
#[test]
fn samples_of_a_map_have_its_density() {
    let (sky, texels) = sunny(7, 5);
    let mut counts = [0u32; 35];
    let mut state = 1u64;
    let mut next = || {
        // SplitMix64.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    };
    let Spread::Map(map, turn) = sky.spread() else { panic!("a map") };
    for _ in 0..N {
        let sample = sky.sample([next(), next()]);
        // The direction lies where the radiance is that of the sample.
        assert_eq!(map.relative(sample.wi, *turn), sample.relative);
        let around = 0.5 + sample.wi.x.atan2(-sample.wi.z) / core::f32::consts::TAU + turn;
        let column = ((around - around.floor()) * 7.0) as usize;
        let row = (sample.wi.y.clamp(-1.0, 1.0).acos() / PI * 5.0) as usize;
        counts[row.min(4) * 7 + column.min(6)] += 1;
    }
    let mean = SkyMap::mean(7, 5, &texels);
    let mut chi_sq = 0.0;
    for (i, &count) in counts.iter().enumerate() {
        let importance = sky.importance(relative(Vec3::from(texels[i]).as_dvec3(), mean));
        let edge = |row: usize| (row as f64 * std::f64::consts::PI / 5.0).cos();
        let solid = (edge(i / 7) - edge(i / 7 + 1)) / 2.0 / 7.0;
        let expected = f64::from(importance) * solid * f64::from(N);
        chi_sq += (f64::from(count) - expected).powi(2) / expected;
    }
    assert!(chi_sq < 65.2, "{chi_sq}");
}

/// The middle of the picture lies at −Z, a quarter of its width further right +X; turned by 90° about +Y, −Z goes to −X.
#[test]
fn maps_are_put_where_they_say() {
    let mut texels = vec![[0.0; 3]; 8 * 4];
    // Just right of the middle, above the horizon.
    texels[8 + 4] = [1.0, 1.0, 1.0];
    let lit = |sky: &Sky, wi: Vec3| sky.relative(wi.normalize()).x > 0.0;
    let sky = Sky::map(8, 4, &texels, 0.0);
    assert!(lit(&sky, Vec3::new(0.1, 0.3, -1.0)) && !lit(&sky, Vec3::new(-0.1, 0.3, -1.0)));
    assert!(!lit(&sky, Vec3::new(0.1, -0.3, -1.0)) && !lit(&sky, Vec3::new(0.1, 2.0, -1.0)));
    let turned = Sky::map(8, 4, &texels, 90.0);
    assert!(lit(&turned, Vec3::new(-1.0, 0.3, -0.1)) && !lit(&turned, Vec3::new(-1.0, 0.3, 0.1)));
    for i in 0..64 {
        let sample = turned.sample(Sequence::new(1, 1).sample(i).next_2d());
        assert!(lit(&turned, sample.wi), "{}", sample.wi);
    }
}

/// A dark sky is drawn from all directions, and gives nothing.
#[test]
fn a_dark_sky_is_dark() {
    for sky in [Sky::gradient(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO), Sky::map(2, 1, &[[0.0; 3]; 2], 0.0)] {
        assert_eq!(sky.mean(), Vec3::ZERO);
        let sample = sky.sample([0.3, 0.7]);
        assert!(sample.wi.is_normalized() && sample.relative == Vec3::ONE, "{sample:?}");
    }
}
