//! Turns each place where the paper's authors' script leaves the paper into a scene in which both differ: the paper holds.
//!
//! Two further ones concern the placement of VPLs, which is not part of this crate: rays that go on from where they
//! started instead of from what they hit, and VPLs that are dropped where the paper averages them.
#![allow(clippy::unwrap_used)]

use core::f32::consts::PI;
use photonstream_running_light::{
    AmortisedWeights, Blocker, Light, Phantom, PhantomSettings, SecondBounce, Spot, UpdateSettings, Vec3,
    Visibility, Vpl, VplId, automatic_weights, update,
};

const ALL: UpdateSettings = UpdateSettings { area_per_weight: 1.0, cull_intensity: 0.0 };

fn floor(x: f32) -> Vpl {
    Vpl { position: Vec3::X * x, normal: Vec3::Y, albedo: Vec3::ONE, weight: 1.0 }
}

fn flux(vpl: Vpl, light: Light, mut visibility: Visibility<'_>) -> f32 {
    let mut flux = [Vec3::NAN];
    update(&[vpl], &[light], &mut visibility, &ALL, &mut flux, &mut [VplId(0)]).unwrap();
    flux[0].x
}

fn unit_lamp(height: f32) -> Light {
    Light::Point { position: Vec3::Y * height, intensity: Vec3::ONE }
}

/// The script takes the whole opening angle for the half one. A spot of 30° to each side, VPLs 1 m below: 20° off the
/// axis is lit, 45° off is not.
#[test]
fn a_spot_ends_at_half_its_opening_angle() {
    let half = PI / 6.0;
    let light = Light::Spot(Spot::new(Vec3::Y, Vec3::NEG_Y, [half, half], Vec3::ONE));
    assert!(flux(floor(0.36), light, Visibility::None) > 0.0);
    assert_eq!(flux(floor(1.0), light, Visibility::None), 0.0);
}

/// The script lights VPLs without the cosine where the light is a point, also from behind. 1 W/sr at 1 m, 60° off: ½ W.
#[test]
fn point_lights_have_the_cosine() {
    let leaning = Vpl { normal: Vec3::new(0.75f32.sqrt(), 0.5, 0.0), ..floor(0.0) };
    assert!((flux(leaning, unit_lamp(1.0), Visibility::None) - 0.5).abs() < 1e-6);
    assert_eq!(flux(floor(0.0), unit_lamp(-1.0), Visibility::None), 0.0);
}

/// The script divides by 0.1 + d². Half a metre away: 4 W, not 2.86.
#[test]
fn light_falls_with_the_square_alone() {
    assert!((flux(floor(0.0), unit_lamp(0.5), Visibility::None) - 4.0).abs() < 1e-6);
}

/// The script's second bounce divides by the light's intensity: NaN without any.
#[test]
fn a_light_of_zero_intensity_is_dark_and_finite() {
    let vpls = [floor(0.0), floor(1.0)];
    let spot = Spot::new(Vec3::Y, Vec3::NEG_Y, [0.5, 1.0], Vec3::ZERO);
    let light = Light::Spot(spot);
    let (mut flux, mut active) = ([Vec3::NAN; 2], [VplId(0); 2]);
    assert_eq!(update(&vpls, &[light], &mut Visibility::None, &ALL, &mut flux, &mut active), Ok(0));
    assert_eq!(flux, [Vec3::ZERO; 2]);
    assert_eq!(SecondBounce::default().of_constellation(&vpls, &flux, &light), Ok(None));
    let settings = PhantomSettings::default();
    let phantom = Phantom::new().update(&spot, Some(Vec3::ZERO), &vpls, &settings, 0.01).unwrap();
    assert_eq!(phantom.flux, Vec3::ZERO);
    assert_eq!(SecondBounce::default().of_phantom(&phantom, &spot), None);
}

/// The script has one counter and one smallest distance for all lights and all VPLs, and takes the squared distance as
/// area. Two sets of three, stepped in turn: each has its own discs after 9 steps of its own.
#[test]
fn amortised_weights_belong_to_their_set() {
    let set = |scale: f32| [0.0, 1.0, 3.0].map(|x| floor(x * scale));
    let (mut near, mut far) = (set(1.0), set(2.0));
    let mut states = [AmortisedWeights::new(), AmortisedWeights::new()];
    for _ in 0..9 {
        states[0].step(&mut near, 1.0);
        states[1].step(&mut far, 1.0);
    }
    let mut whole = near;
    automatic_weights(&mut whole, 1.0);
    assert_eq!(near, whole);
    assert_eq!(near.map(|vpl| vpl.weight), [PI / 4.0, PI / 4.0, PI]);
    assert_eq!(far.map(|vpl| vpl.weight), [PI, PI, 4.0 * PI]);
}

/// The script's rays to directional lights end after 100 units. A blocker 150 m up is in the way.
#[test]
fn directional_light_is_blocked_however_far_away() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    let above = [Blocker::new(Vec3::Y * 150.0, 1.0)];
    assert_eq!(flux(floor(0.0), sun, Visibility::Blockers(&above)), 0.0);
    let below = [Blocker::new(Vec3::Y * -2.0, 1.0)];
    assert_eq!(flux(floor(0.0), sun, Visibility::Blockers(&below)), 1.0);
}

/// The script discards a VPL of exactly I_cull; the paper discards I < I_cull.
#[test]
fn the_threshold_itself_shines() {
    let mut flux = [Vec3::ZERO];
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    let settings = UpdateSettings { cull_intensity: core::f32::consts::FRAC_1_PI, ..ALL };
    let shining = update(&[floor(0.0)], &[sun], &mut Visibility::None, &settings, &mut flux, &mut [VplId(0)]);
    assert_eq!((shining, flux), (Ok(1), [Vec3::ONE]));
}

/// The script gives its second bounce colours of VPLs that are off, from when they were last on.
#[test]
fn culled_vpls_have_no_second_bounce() {
    let vpls = [floor(0.0), Vpl { albedo: Vec3::X, ..floor(0.0) }];
    let lamp = unit_lamp(1.0);
    let alone = SecondBounce::default().of_constellation(&vpls[..1], &[Vec3::ONE], &lamp);
    let beside_culled = SecondBounce::default().of_constellation(&vpls, &[Vec3::ONE, Vec3::ZERO], &lamp);
    assert_eq!(alone, beside_culled);
}

/// The script leaves the second bounce on where the axis hits nothing, and moves the phantom half way in each frame.
#[test]
fn a_miss_is_dark_and_time_is_not_counted_in_frames() {
    let spot = Spot::new(Vec3::Y * 2.0, Vec3::NEG_Y, [0.1, 0.2], Vec3::ONE);
    let (vpls, settings) = ([floor(0.0), floor(1.0)], PhantomSettings::default());
    let after_a_tenth = |frames: u16| {
        let mut phantom = Phantom::new();
        phantom.update(&spot, Some(Vec3::ZERO), &vpls, &settings, 0.0);
        let dt = 0.1 / f32::from(frames);
        (0..frames).map(|_| phantom.update(&spot, Some(Vec3::X), &vpls, &settings, dt)).last().flatten()
    };
    let [slow, fast] = [3, 9].map(|frames| after_a_tenth(frames).unwrap().position.x);
    assert!((slow - fast).abs() < 1e-6, "{slow} at 30 frames/s, {fast} at 90");
    let mut phantom = Phantom::new();
    phantom.update(&spot, Some(Vec3::ZERO), &vpls, &settings, 0.01);
    let missed = phantom.update(&spot, None, &vpls, &settings, 0.01);
    assert_eq!(missed.and_then(|light| SecondBounce::default().of_phantom(&light, &spot)), None);
}
