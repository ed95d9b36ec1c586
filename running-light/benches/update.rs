//! Turns the update of a scene of 200 VPLs and 20 blockers into times: `cargo bench -p photonstream-running-light`.
#![allow(missing_docs)]

use divan::{Bencher, black_box};
use photonstream_running_light::{
    AmortisedWeights, Blocker, Light, Phantom, PhantomSettings, SecondBounce, Spot, UpdateSettings, Vec3,
    VirtualLight, Visibility, Vpl, VplId, automatic_weights, update,
};

const VPLS: usize = 200;
const BLOCKERS: usize = 20;

fn main() {
    divan::main();
}

/// On the inside of a ball of 5 m, by the golden angle: each faces every light within.
fn vpls() -> [Vpl; VPLS] {
    core::array::from_fn(|i| {
        let up = 1.0 - 2.0 * (i as f32 + 0.5) / VPLS as f32;
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let out = Vec3::new(cos * (1.0 - up * up).sqrt(), up, sin * (1.0 - up * up).sqrt());
        Vpl { position: out * 5.0, normal: -out, albedo: Vec3::new(0.8, 0.5, 0.2), weight: 1.5 }
    })
}

/// Around the middle, of half a metre.
fn blockers() -> [Blocker; BLOCKERS] {
    core::array::from_fn(|i| {
        let (sin, cos) = (i as f32 * 0.9).sin_cos();
        Blocker::new(Vec3::new(cos * 2.0, i as f32 * 0.2 - 2.0, sin * 2.0), 0.5)
    })
}

fn spot() -> Spot {
    Spot::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.6, -0.8, 0.0), [0.3, 0.6], Vec3::splat(60.0))
}

fn lamp() -> Light {
    Light::point(Vec3::new(0.1, 0.2, 0.3), Vec3::splat(60.0))
}

fn time_update(bencher: Bencher<'_, '_>, light: Light, blockers: &[Blocker]) {
    let (vpls, settings) = (vpls(), UpdateSettings::default());
    let (mut flux, mut active) = ([Vec3::ZERO; VPLS], [VplId(0); VPLS]);
    bencher.bench_local(|| {
        let mut visibility = Visibility::Blockers(black_box(blockers));
        update(black_box(&vpls), black_box(&[light]), &mut visibility, &settings, &mut flux, &mut active)
    });
}

/// The most work: every VPL sees the lamp.
#[divan::bench]
fn update_point_light_20_blockers(bencher: Bencher<'_, '_>) {
    time_update(bencher, lamp(), &blockers());
}

#[divan::bench]
fn update_directional_light_20_blockers(bencher: Bencher<'_, '_>) {
    let light = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(10.0) };
    time_update(bencher, light, &blockers());
}

/// Only the VPLs in the cone are compared with blockers.
#[divan::bench]
fn update_spot_20_blockers(bencher: Bencher<'_, '_>) {
    time_update(bencher, Light::Spot(spot()), &blockers());
}

#[divan::bench]
fn update_point_light_no_blockers(bencher: Bencher<'_, '_>) {
    time_update(bencher, lamp(), &[]);
}

#[divan::bench(args = [20, 200])]
fn phantom(bencher: Bencher<'_, '_>, count: usize) {
    let (vpls, spot, settings) = (vpls(), spot(), PhantomSettings::default());
    let hit = spot.position + spot.direction * 4.5;
    let mut phantom = Phantom::new();
    bencher.bench_local(|| {
        phantom.update(black_box(&spot), Some(black_box(hit)), black_box(&vpls[..count]), &settings, 0.011)
    });
}

#[divan::bench]
fn second_bounce_of_200(bencher: Bencher<'_, '_>) {
    let vpls = vpls();
    let flux = [Vec3::ONE; VPLS];
    let light = lamp();
    bencher.bench_local(|| {
        SecondBounce::default().of_constellation(black_box(&vpls), black_box(&flux), black_box(&light))
    });
}

#[divan::bench]
fn second_bounce_of_phantom(bencher: Bencher<'_, '_>) {
    let light = VirtualLight { position: Vec3::X, normal: Vec3::Y, flux: Vec3::ONE, area: 1.0 };
    let spot = spot();
    bencher.bench_local(|| SecondBounce::default().of_phantom(black_box(&light), black_box(&spot)));
}

#[divan::bench]
fn automatic_weights_of_200(bencher: Bencher<'_, '_>) {
    let mut vpls = vpls();
    bencher.bench_local(|| automatic_weights(black_box(&mut vpls), 1.0));
}

#[divan::bench]
fn amortised_weights_one_step(bencher: Bencher<'_, '_>) {
    let mut vpls = vpls();
    let mut weights = AmortisedWeights::new();
    bencher.bench_local(|| weights.step(black_box(&mut vpls), 1.0));
}
