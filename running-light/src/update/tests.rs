//! Fluxes by hand, one formula each. Tolerance where there is one: 10⁻⁶, a few roundings of f32 (6·10⁻⁸ each).

use super::*;
use crate::{Blocker, ShadowRay, Spot};
use core::f32::consts::PI;

const ALL: UpdateSettings = UpdateSettings { area_per_weight: 1.0, cull_intensity: 0.0 };

fn floor(x: f32) -> Vpl {
    Vpl { position: Vec3::X * x, normal: Vec3::Y, albedo: Vec3::ONE, weight: 1.0 }
}

fn lamp(height: f32, intensity: f32) -> Light {
    Light::Point { position: Vec3::Y * height, intensity: Vec3::splat(intensity) }
}

fn flux_of<const N: usize>(
    vpls: [Vpl; N],
    lights: &[Light],
    mut visibility: Visibility<'_>,
    settings: UpdateSettings,
) -> [Vec3; N] {
    let (mut flux, mut active) = ([Vec3::NAN; N], [VplId::default(); N]);
    update(&vpls, lights, &mut visibility, &settings, &mut flux, &mut active).unwrap();
    flux
}

/// A lamp of 4 W/sr at distance 2, 60° off the normal: E = 4 · ½ / 4 = 0.5 W/m². Weight 3 of 2 m² makes A = 6 m², so
/// ρ = (0.5, 0.25, 1) sends on Φ = (1.5, 0.75, 3) W.
#[test]
fn flux_of_a_point_light() {
    let normal = Vec3::new(0.75f32.sqrt(), 0.5, 0.0);
    let vpl = Vpl { position: Vec3::ZERO, normal, albedo: Vec3::new(0.5, 0.25, 1.0), weight: 3.0 };
    let settings = UpdateSettings { area_per_weight: 2.0, ..ALL };
    let [flux] = flux_of([vpl], &[lamp(2.0, 4.0)], Visibility::None, settings);
    assert!(flux.abs_diff_eq(Vec3::new(1.5, 0.75, 3.0), 1e-6), "{flux}");
}

/// 10 W/m² at the cosine 0.6 of a 3-4-5 triangle: Φ = 0.5 · 6 · 1 m² = 3 W, at any place.
#[test]
fn flux_of_a_directional_light() {
    let light =
        Light::Directional { direction: Vec3::new(0.8, -0.6, 0.0), irradiance: Vec3::new(10.0, 0.0, 5.0) };
    let vpl = Vpl { albedo: Vec3::splat(0.5), ..floor(1e3) };
    let [flux] = flux_of([vpl], &[light], Visibility::None, ALL);
    assert!(flux.abs_diff_eq(Vec3::new(3.0, 0.0, 1.5), 1e-6), "{flux}");
}

/// Straight below a spot 2 m away, 8 W/sr along the axis: E = 2 W/m²; a VPL outside the cone has exactly none.
#[test]
fn flux_of_a_spot() {
    let half_angles = [0.1, 0.2];
    let spot = Spot::new(Vec3::Y * 2.0, Vec3::NEG_Y, half_angles, Vec3::ONE);
    let light = Light::Spot(Spot { intensity: Vec3::splat(8.0), ..spot });
    // The edge is at 2 m · tan 0.2 = 0.405 m.
    let [below, inside, outside] =
        flux_of([floor(0.0), floor(0.39), floor(0.41)], &[light], Visibility::None, ALL);
    assert!((below.x - 2.0).abs() < 1e-6, "{below}");
    assert!(inside.x > 0.0);
    assert_eq!(outside, Vec3::ZERO);
}

#[test]
fn light_from_behind_or_of_nothing_is_exactly_none() {
    let below = lamp(-2.0, 4.0);
    let dark = [lamp(2.0, 0.0), Light::Spot(Spot::new(Vec3::Y, Vec3::NEG_Y, [0.1, 0.2], Vec3::ZERO))];
    assert_eq!(flux_of([floor(0.0)], &[below], Visibility::None, ALL), [Vec3::ZERO]);
    assert_eq!(flux_of([floor(0.0)], &dark, Visibility::None, ALL), [Vec3::ZERO]);
    assert_eq!(flux_of([floor(0.0)], &[], Visibility::None, ALL), [Vec3::ZERO]);
}

/// 4 and 12 W/sr at 2 m: 1 + 3 W. Each of two lights of 0.006 W/sr of reflected light would be culled, both are not.
#[test]
fn several_lights_add_up_before_culling() {
    let [flux] = flux_of([floor(0.0)], &[lamp(2.0, 4.0), lamp(2.0, 12.0)], Visibility::None, ALL);
    assert!((flux.x - 4.0).abs() < 1e-6, "{flux}");
    let faint = lamp(1.0, 0.006 * PI);
    let settings = UpdateSettings::default();
    assert_eq!(flux_of([floor(0.0)], &[faint], Visibility::None, settings), [Vec3::ZERO]);
    let [flux] = flux_of([floor(0.0)], &[faint, faint], Visibility::None, settings);
    assert!((flux.x - 0.012 * PI).abs() < 1e-6, "{flux}");
}

/// Lamps 1 m above VPLs of 1 m²: a VPL's intensity is the lamp's over π. Of 0.0099, 0.0101, 0 and 5 W/sr the second
/// and the last shine; one bright channel is enough.
#[test]
fn culled_vpls_are_zero_and_listed_nowhere() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::new(PI, 0.0, 0.0) };
    let vpls = [0.0099, 0.0101, 0.0, 5.0].map(|weight| Vpl { weight, ..floor(0.0) });
    let (mut flux, mut active) = ([Vec3::NAN; 4], [VplId::default(); 4]);
    let settings = UpdateSettings::default();
    let shining = update(&vpls, &[sun], &mut Visibility::None, &settings, &mut flux, &mut active).unwrap();
    assert_eq!(&active[..shining], [VplId(1), VplId(3)]);
    assert_eq!([flux[0], flux[2]], [Vec3::ZERO; 2]);
    assert!((flux[1].x - 0.0101 * PI).abs() < 1e-6 && (flux[3].x - 5.0 * PI).abs() < 1e-5);
    let settings = UpdateSettings { cull_intensity: 0.0, ..settings };
    let shining = update(&vpls, &[sun], &mut Visibility::None, &settings, &mut flux, &mut active).unwrap();
    assert_eq!(&active[..shining], [VplId(0), VplId(1), VplId(3)], "without light nothing shines");
}

/// Two lights of 0.75 times the largest irradiance are as bright as the largest: a reflectance of 10⁻¹⁰ makes 10⁻¹⁰ of
/// it, and one of 0 nothing.
#[test]
fn sums_beyond_f32_are_the_largest() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(0.75 * f32::MAX) };
    let vpl = Vpl { albedo: Vec3::new(1.0, 1e-10, 0.0), ..floor(0.0) };
    let [flux] = flux_of([vpl], &[sun, sun], Visibility::None, ALL);
    assert_eq!(flux, Vec3::new(f32::MAX, f32::MAX * 1e-10, 0.0));
}

/// A blocker of radius 1 passes half a metre from the way: a quarter of 1 W. Attached to something, it moves with it:
/// in the way, beside it, and above the lamp, from where it does not reach back to it.
#[test]
fn blockers_dim_and_move() {
    let light = [lamp(4.0, 16.0)];
    let with = |x, y| {
        let blockers = [Blocker::new(Vec3::new(x, y, 0.0), 1.0)];
        flux_of([floor(0.0)], &light, Visibility::Blockers(&blockers), ALL)[0].x
    };
    assert!((with(0.5, 2.0) - 0.25).abs() < 1e-6);
    assert_eq!(with(0.0, 2.0), 0.0);
    assert!((with(1.0, 2.0) - 1.0).abs() < 1e-6);
    assert!((with(0.0, 5.0) - 1.0).abs() < 1e-6);
}

/// The caller is told the way, and is not asked about light that arrives from behind; its answer is taken as a share.
#[test]
fn visibility_can_be_asked() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    let mut rays = [None; 4];
    let mut asked = 0;
    let mut ask = |ray: ShadowRay| {
        rays[asked] = Some(ray);
        asked += 1;
        0.25
    };
    let lights = [lamp(2.0, 4.0), lamp(-2.0, 4.0), sun];
    let [flux] = flux_of([floor(0.0)], &lights, Visibility::Asked(&mut ask), ALL);
    assert!((flux.x - 0.5).abs() < 1e-6, "{flux}");
    let ray = |distance| Some(ShadowRay { origin: Vec3::ZERO, direction: Vec3::Y, distance });
    assert_eq!(rays, [ray(2.0), ray(f32::INFINITY), None, None]);
    for (answer, expected) in [(7.0, 1.0), (-1.0, 0.0), (f32::NAN, 0.0)] {
        let [flux] = flux_of([floor(0.0)], &[sun], Visibility::Asked(&mut |_| answer), ALL);
        assert_eq!(flux.x, expected, "answer {answer}");
    }
}

#[test]
fn results_have_one_entry_for_each_vpl() {
    let (vpls, settings) = ([floor(0.0); 3], ALL);
    let (mut flux, mut active) = ([Vec3::ZERO; 4], [VplId::default(); 2]);
    let mut run = |flux: &mut [Vec3]| update(&vpls, &[], &mut Visibility::None, &settings, flux, &mut active);
    assert_eq!(run(&mut flux), Err(LengthError { slice: "flux", found: 4, expected: 3 }));
    assert_eq!(run(&mut flux[..3]), Err(LengthError { slice: "active", found: 2, expected: 3 }));
}
