//! Phantoms by hand, in time, and across VPLs.

use super::*;
use core::f32::consts::PI;

const SETTINGS: PhantomSettings =
    PhantomSettings { area_per_weight: 1.0, softening: 0.005, time_constant: 0.1 };

/// 2 m above the floor, straight down, 8 W/sr.
fn torch() -> Spot {
    let spot = Spot::new(Vec3::Y * 2.0, Vec3::NEG_Y, [0.1, 0.2], Vec3::ONE);
    Spot { intensity: Vec3::splat(8.0), ..spot }
}

fn vpl(x: f32, normal: Vec3, albedo: Vec3, weight: f32) -> Vpl {
    Vpl { position: Vec3::X * x, normal, albedo, weight }
}

fn two() -> [Vpl; 2] {
    [vpl(-1.0, Vec3::Y, Vec3::new(1.0, 0.5, 0.0), 1.0), vpl(1.0, Vec3::Y, Vec3::new(0.0, 0.5, 1.0), 3.0)]
}

/// Half way between both: ρ = ½ everywhere, w = 2. E = 8/2² = 2 W/m², Φ = ½ · 2 · 2 m² = 2 W. Tolerance: roundings.
#[test]
fn flux_half_way_between_two() {
    let light = Phantom::new().update(&torch(), Some(Vec3::ZERO), &two(), &SETTINGS, 0.01).unwrap();
    assert_eq!((light.position, light.normal), (Vec3::ZERO, Vec3::Y));
    assert!(light.flux.abs_diff_eq(Vec3::splat(2.0), 1e-6), "{}", light.flux);
    assert!((light.area - 2.0).abs() < 1e-6);
}

/// At 1 m beyond the second, b = 1/(9 + δ) and 1/(1 + δ), δ = 1: 0.1 and 0.5, so one and five sixths.
/// w = (1 + 15)/6; ρ = (1/6, 1/2, 5/6); n = (5, 1, 0)/6.
#[test]
fn interpolation_by_inverse_squares() {
    let mut vpls = two();
    vpls[1].normal = Vec3::X;
    let (normal, albedo, weight) = interpolated(&vpls, Vec3::X * 2.0, 1.0).unwrap();
    assert!(normal.abs_diff_eq(Vec3::new(5.0, 1.0, 0.0) / 6.0, 1e-6));
    assert!(albedo.abs_diff_eq(Vec3::new(1.0, 3.0, 5.0) / 6.0, 1e-6));
    assert!((weight - 16.0 / 6.0).abs() < 1e-6);
    // On a VPL, without a softening, it is that one but for 10⁻¹²/4 of the other.
    let (normal, albedo, weight) = interpolated(&vpls, Vec3::X, 0.0).unwrap();
    assert!(normal.abs_diff_eq(vpls[1].normal, 1e-12) && albedo.abs_diff_eq(vpls[1].albedo, 1e-12));
    assert!((weight - vpls[1].weight).abs() < 1e-6);
}

/// The VPLs' normal leans 60° from the beam: half the flux.
#[test]
fn flux_falls_with_the_cosine() {
    let normal = Vec3::new(0.75f32.sqrt(), 0.5, 0.0);
    let vpls = [vpl(0.0, normal, Vec3::ONE, 1.0)];
    let light = Phantom::new().update(&torch(), Some(Vec3::ZERO), &vpls, &SETTINGS, 0.0).unwrap();
    assert!((light.flux.x - 1.0).abs() < 1e-6, "{}", light.flux);
    assert!(light.normal.abs_diff_eq(normal, 1e-6));
}

/// τ = 0.1 s, a jump from x = −1 to x = 1: after τ 1 − 1/e of it, −1 + 2 · 0.632121 = 0.264241; after 7 further τ the
/// rest is 2 · e⁻⁸ = 0.00067.
#[test]
fn a_jump_is_followed_exponentially() {
    let (vpls, spot) = (two(), torch());
    let mut phantom = Phantom::new();
    phantom.update(&spot, Some(Vec3::NEG_X), &vpls, &SETTINGS, 0.1);
    let light = phantom.update(&spot, Some(Vec3::X), &vpls, &SETTINGS, 0.1).unwrap();
    assert!((light.position.x - 0.264_241).abs() < 1e-6, "{}", light.position);
    let light = phantom.update(&spot, Some(Vec3::X), &vpls, &SETTINGS, 0.7).unwrap();
    assert!((1.0 - light.position.x - 0.000_671).abs() < 1e-6, "{}", light.position);
    let light = phantom.update(&spot, Some(Vec3::NEG_X), &vpls, &SETTINGS, 0.0).unwrap();
    assert!(light.position.x > 0.99, "no time, no way");
    let at_once = PhantomSettings { time_constant: 0.0, ..SETTINGS };
    let light = phantom.update(&spot, Some(Vec3::NEG_X), &vpls, &at_once, 0.0).unwrap();
    assert_eq!(light.position, Vec3::NEG_X);
}

/// 90 ms in 1, 3, 9 and 90 steps: the same place, normal, flux and area. Tolerance 10⁻⁵ of values around 1: 90 steps of
/// two roundings each (6·10⁻⁸).
#[test]
fn following_does_not_depend_on_the_frame_rate() {
    let spot = torch();
    let mut vpls = two();
    vpls[0].normal = Vec3::new(0.6, 0.8, 0.0);
    let after = |steps: u16| {
        let mut phantom = Phantom::new();
        phantom.update(&spot, Some(Vec3::new(-0.9, 0.0, 0.3)), &vpls, &SETTINGS, 1.0);
        let dt = 0.09 / f32::from(steps);
        let mut run = || phantom.update(&spot, Some(Vec3::new(0.8, 0.2, 0.0)), &vpls, &SETTINGS, dt).unwrap();
        (1..steps).for_each(|_| {
            run();
        });
        run()
    };
    let one = after(1);
    for steps in [3, 9, 90] {
        let many = after(steps);
        assert!(many.position.abs_diff_eq(one.position, 1e-5), "{steps} steps: {}", many.position);
        assert!(many.normal.abs_diff_eq(one.normal, 1e-5), "{steps} steps: {}", many.normal);
        assert!(
            many.flux.abs_diff_eq(one.flux, 1e-5 * one.flux.max_element()),
            "{steps} steps: {}",
            many.flux
        );
        assert!((many.area - one.area).abs() < 1e-5, "{steps} steps: {}", many.area);
    }
}

#[test]
fn a_miss_turns_it_off_and_the_next_hit_starts_anew() {
    let (vpls, spot) = (two(), torch());
    let mut phantom = Phantom::new();
    assert!(phantom.update(&spot, Some(Vec3::NEG_X), &vpls, &SETTINGS, 0.01).is_some());
    assert_eq!(phantom.update(&spot, None, &vpls, &SETTINGS, 0.01), None);
    let light = phantom.update(&spot, Some(Vec3::X), &vpls, &SETTINGS, 0.01).unwrap();
    assert_eq!(light.position, Vec3::X);
    assert_eq!(phantom.update(&spot, Some(Vec3::X), &[], &SETTINGS, 0.01), None, "nothing to interpolate");
}

#[test]
fn a_light_that_goes_off_is_dark_at_once() {
    let (vpls, spot) = (two(), torch());
    let mut phantom = Phantom::new();
    phantom.update(&spot, Some(Vec3::ZERO), &vpls, &SETTINGS, 0.01);
    let dark = Spot { intensity: Vec3::ZERO, ..spot };
    let light = phantom.update(&dark, Some(Vec3::ZERO), &vpls, &SETTINGS, 0.001).unwrap();
    assert_eq!(light.flux, Vec3::ZERO);
}

/// Interpolated values are means with weights b/Σb; their slope is at most (largest − smallest)/(2√δ), because
/// |∇ ln b| ≤ 1/√δ. Along a line through five VPLs, in steps of 0.1 mm: 0.1 mm · 0.9 / (2 · 0.0707 m) = 6.4·10⁻⁴ of the
/// albedo. Tolerance: 10⁻⁶ for roundings.
#[test]
fn interpolated_values_have_no_jumps() {
    let vpls: [Vpl; 5] = core::array::from_fn(|i| {
        let albedo = if i % 2 == 0 { 0.05 } else { 0.95 };
        vpl(i as f32 * 0.25, Vec3::Y, Vec3::splat(albedo), 1.0)
    });
    let albedo = |i: u16| {
        let x = Vec3::X * (f32::from(i) * 1e-4 - 0.2);
        interpolated(&vpls, x, SETTINGS.softening).unwrap().1.x
    };
    let largest = (0..14_000).map(|i| (albedo(i + 1) - albedo(i)).abs()).fold(0.0, f32::max);
    assert!(largest <= 1e-4 * 0.9 / (2.0 * SETTINGS.softening.sqrt()) + 1e-6, "{largest}");
    assert!(largest > 1e-5, "the line crosses different VPLs: {largest}");
}

/// A beam that sweeps over a corner, from a dark floor to a bright wall: without smoothing in time, half the step makes
/// half the largest change of flux. Tolerance: 0.6 for 0.5, because the steepest place is met or just missed.
#[test]
fn flux_has_no_jumps_while_the_beam_crosses_vpls() {
    let vpls = [
        vpl(0.0, Vec3::Y, Vec3::splat(0.1), 1.0),
        vpl(0.5, Vec3::Y, Vec3::splat(0.9), 2.0),
        Vpl {
            position: Vec3::new(1.0, 0.5, 0.0),
            normal: Vec3::NEG_X,
            albedo: Vec3::splat(0.5),
            weight: 1.0,
        },
    ];
    let settings = PhantomSettings { time_constant: 0.0, ..SETTINGS };
    let flux = |angle: f32| {
        // From 2 m above the floor to the floor, or to the wall at x = 1.
        let direction = Vec3::new(angle.sin(), -angle.cos(), 0.0);
        let distance = (2.0 / angle.cos()).min(1.0 / angle.sin());
        let spot = Spot { direction, ..torch() };
        let hit = Some(spot.position + direction * distance);
        Phantom::new().update(&spot, hit, &vpls, &settings, 0.0).unwrap().flux.x
    };
    let largest_change = |steps: u16| {
        let angle = |i: u16| 0.01 + (PI / 3.0 - 0.01) * f32::from(i) / f32::from(steps);
        (0..steps).map(|i| (flux(angle(i + 1)) - flux(angle(i))).abs()).fold(0.0, f32::max)
    };
    let (coarse, fine) = (largest_change(1_000), largest_change(2_000));
    assert!(coarse > 0.0 && fine <= 0.6 * coarse, "{coarse} in 1000 steps, {fine} in 2000");
}

/// A phantom that reflects ρ A cosθ/d² = 2 · 3/2² = 1.5 sr of the largest intensity: 1.5 times the largest number.
#[test]
fn flux_beyond_f32_is_the_largest() {
    let bright = Spot { intensity: Vec3::new(f32::MAX, 1.0, 0.0), ..torch() };
    let vpls = [vpl(0.0, Vec3::Y, Vec3::splat(2.0), 3.0)];
    let light = Phantom::new().update(&bright, Some(Vec3::ZERO), &vpls, &SETTINGS, 0.0).unwrap();
    assert_eq!(light.flux.x, f32::MAX);
    assert!((light.flux.y - 1.5).abs() < 1e-6 && light.flux.z == 0.0, "{}", light.flux);
}

/// A way that is longer than the largest number is jumped, because it cannot be followed.
#[test]
fn ways_beyond_f32_are_jumped() {
    let (from, to) = (Vec3::X * f32::MAX, Vec3::NEG_X * f32::MAX);
    let mut state = State { position: from, normal: Vec3::Y, reflected: Vec3::ONE, area: 1.0 };
    assert!(state.towards(State { position: to, ..state }, 0.5).is_none());
    state.position = Vec3::ZERO;
    assert_eq!(state.towards(State { position: to, ..state }, 0.5).unwrap().position, to * 0.5);
    let far = [from, to].map(|position| Vpl { position, ..two()[0] });
    assert_eq!(
        Phantom::new().update(&torch(), Some(Vec3::ZERO), &far, &SETTINGS, 0.0),
        None,
        "none in reach"
    );
}
