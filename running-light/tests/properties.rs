//! Turns random sets of VPLs, lights and blockers into what must hold for all of them. 256 cases each, seed 1;
//! `PROPTEST_CASES` asks for more.
#![allow(clippy::unwrap_used)]

use photonstream_running_light::{
    AmortisedWeights, Blocker, Light, Phantom, PhantomSettings, SecondBounce, Spot, UpdateSettings, Vec3,
    VirtualLight, Visibility, Vpl, VplId, automatic_weights, update,
};
use proptest::{collection::vec, prelude::*, test_runner::RngSeed};

/// Any finite number, of all magnitudes; or one that is not extreme.
fn any_finite() -> impl Strategy<Value = f32> {
    use prop::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![
        POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO,
        -2.0f32..2.0,
        Just(f32::MAX),
        Just(-f32::MAX)
    ]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    [any_finite(), any_finite(), any_finite()].prop_map(Vec3::from)
}

fn any_light() -> impl Strategy<Value = Light> {
    let spot = (any_vector(), any_vector(), [any_finite(), any_finite()], any_vector())
        .prop_map(|(position, direction, angles, power)| Spot::new(position, direction, angles, power));
    prop_oneof![
        (any_vector(), any_vector()).prop_map(|(position, power)| Light::point(position, power)),
        spot.prop_map(Light::Spot),
        (any_vector(), any_vector(), any_vector())
            .prop_map(|(position, normal, power)| Light::emitter(position, normal, power)),
        (any_vector(), any_vector())
            .prop_map(|(direction, irradiance)| Light::Directional { direction, irradiance }),
    ]
}

fn any_vpl() -> impl Strategy<Value = Vpl> {
    (any_vector(), any_vector(), any_vector(), any_finite())
        .prop_map(|(position, normal, albedo, weight)| Vpl { position, normal, albedo, weight })
}

/// Coordinates in a hall of 10 m.
fn place() -> impl Strategy<Value = Vec3> {
    [-5.0f32..5.0, -5.0f32..5.0, -5.0f32..5.0].prop_map(Vec3::from)
}

fn direction() -> impl Strategy<Value = Vec3> {
    place().prop_filter_map("no direction", Vec3::try_normalize)
}

fn colour() -> impl Strategy<Value = Vec3> {
    [0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0].prop_map(Vec3::from)
}

fn vpl() -> impl Strategy<Value = Vpl> {
    (place(), direction(), colour(), 0.0f32..4.0).prop_map(|(position, normal, albedo, weight)| Vpl {
        position,
        normal,
        albedo,
        weight,
    })
}

fn light() -> impl Strategy<Value = Light> {
    let half_angles = (0.05f32..1.5, 0.05f32..1.5).prop_map(|(a, b)| [a.min(b), a.max(b)]);
    prop_oneof![
        (place(), colour()).prop_map(|(position, colour)| Light::point(position, colour * 50.0)),
        (place(), direction(), half_angles, colour())
            .prop_map(|(x, axis, angles, colour)| Light::Spot(Spot::new(x, axis, angles, colour * 50.0))),
        (place(), direction(), colour()).prop_map(|(x, normal, colour)| Light::emitter(
            x,
            normal,
            colour * 50.0
        )),
        (direction(), colour())
            .prop_map(|(direction, irradiance)| Light::Directional { direction, irradiance }),
    ]
}

fn blocker() -> impl Strategy<Value = Blocker> {
    (place(), 0.1f32..3.0).prop_map(|(centre, radius)| Blocker::new(centre, radius))
}

const ALL: UpdateSettings = UpdateSettings { area_per_weight: 1.0, cull_intensity: 0.0 };

fn lit(
    vpls: &[Vpl],
    lights: &[Light],
    blockers: &[Blocker],
    settings: &UpdateSettings,
) -> (Vec<Vec3>, Vec<VplId>) {
    let (mut flux, mut active) = (vec![Vec3::NAN; vpls.len()], vec![VplId(0); vpls.len()]);
    let mut visibility = Visibility::Blockers(blockers);
    let shining = update(vpls, lights, &mut visibility, settings, &mut flux, &mut active).unwrap();
    active.truncate(shining);
    (flux, active)
}

/// Irradiance that reaches the front of `vpl` without blockers, in f64, with 10⁻⁶ more of cosθ.
fn irradiance(vpl: &Vpl, light: &Light) -> f64 {
    let cos_theta = |d: glam::DVec3| (vpl.normal.as_dvec3().dot(d.normalize()) + 1e-6).max(0.0);
    let at = |d: glam::DVec3, intensity: Vec3| {
        f64::from(intensity.max_element()) * cos_theta(d) / d.length_squared()
    };
    match light {
        Light::Point { position, intensity } => at((position - vpl.position).as_dvec3(), *intensity),
        Light::Spot(spot) => at((spot.position - vpl.position).as_dvec3(), spot.intensity),
        Light::Emitter { position, normal, intensity } => {
            let d = (position - vpl.position).as_dvec3();
            at(d, *intensity) * (-normal.as_dvec3().dot(d.normalize())).max(0.0)
        }
        Light::Directional { direction, irradiance } => {
            f64::from(irradiance.max_element()) * cos_theta(-direction.as_dvec3())
        }
    }
}

fn is_light(light: &VirtualLight) -> bool {
    let channels = light.flux.is_finite() && light.flux.cmpge(Vec3::ZERO).all();
    channels && light.position.is_finite() && light.normal.is_finite() && light.area.is_finite()
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn whatever_is_finite_stays_finite(
        mut vpls in vec(any_vpl(), 0..6),
        lights in vec(any_light(), 1..4),
        spheres in vec((any_vector(), any_finite()), 0..4),
        numbers in [any_finite(), any_finite(), any_finite(), any_finite()],
        hits in vec(any_vector(), 3),
    ) {
        let [area_per_weight, cull_intensity, softening, time_constant] = numbers;
        let blockers: Vec<Blocker> = spheres.iter().map(|&(centre, radius)| Blocker::new(centre, radius)).collect();
        let (flux, active) = lit(&vpls, &lights, &blockers, &UpdateSettings { area_per_weight, cull_intensity });
        prop_assert!(flux.iter().all(|flux| flux.is_finite() && flux.cmpge(Vec3::ZERO).all()), "{flux:?}");
        let shine: Vec<VplId> = (0..).zip(&flux).filter(|(_, f)| **f != Vec3::ZERO).map(|(i, _)| VplId(i)).collect();
        prop_assert_eq!(&active, &shine);

        let bounce = SecondBounce { average_albedo: softening, distance: cull_intensity };
        let second = bounce.of_constellation(&vpls, &flux, &lights[0]).unwrap();
        prop_assert!(second.as_ref().is_none_or(is_light), "{second:?}");

        let settings = PhantomSettings { area_per_weight, softening, time_constant };
        let spots = lights.iter().filter_map(|light| if let Light::Spot(spot) = light { Some(*spot) } else { None });
        for spot in spots {
            let mut phantom = Phantom::new();
            for &hit in &hits {
                let first = phantom.update(&spot, Some(hit), &vpls, &settings, cull_intensity);
                prop_assert!(first.as_ref().is_none_or(is_light), "{first:?}");
                let second = first.and_then(|light| bounce.of_phantom(&light, &spot));
                prop_assert!(second.as_ref().is_none_or(is_light), "{second:?}");
            }
        }

        let mut amortised = AmortisedWeights::new();
        automatic_weights(&mut vpls, area_per_weight);
        let whole = vpls.clone();
        (0..vpls.len() * vpls.len()).for_each(|_| amortised.step(&mut vpls, area_per_weight));
        prop_assert!(vpls.iter().all(|vpl| vpl.weight.is_finite()));
        prop_assert_eq!(whole, vpls);
    }

    /// Φ ≤ ρ E A in each channel, E without blockers in f64. Tolerance: 10⁻⁶ of cosθ, which is a sum of three products
    /// of numbers up to 1 with up to three roundings of 6·10⁻⁸ each; 10⁻⁶ relative for the ten other operations.
    #[test]
    fn no_vpl_sends_on_more_than_it_receives(
        vpls in vec(vpl(), 1..6),
        lights in vec(light(), 1..4),
        blockers in vec(blocker(), 0..10),
    ) {
        let (flux, _) = lit(&vpls, &lights, &blockers, &ALL);
        for (vpl, flux) in vpls.iter().zip(flux) {
            let received: f64 = lights.iter().map(|light| irradiance(vpl, light)).sum();
            let area = f64::from(vpl.weight);
            for (flux, albedo) in flux.to_array().into_iter().zip(vpl.albedo.to_array()) {
                let most = f64::from(albedo) * received * area;
                prop_assert!(f64::from(flux) <= most * (1.0 + 1e-6), "{flux} of {most}");
            }
        }
    }

    /// One blocker more never brightens anything: no bit of it against none at all, and against one fewer 2·10⁻⁶, the
    /// roundings of two products of up to ten shares, 6·10⁻⁸ each.
    #[test]
    fn blockers_only_darken(
        vpls in vec(vpl(), 1..6),
        lights in vec(light(), 1..4),
        blockers in vec(blocker(), 1..10),
    ) {
        let (none, _) = lit(&vpls, &lights, &[], &ALL);
        let (fewer, _) = lit(&vpls, &lights, &blockers[1..], &ALL);
        let (all, _) = lit(&vpls, &lights, &blockers, &ALL);
        for ((none, fewer), all) in none.iter().zip(&fewer).zip(&all) {
            prop_assert!(all.cmple(*none).all(), "{all} of {none}");
            prop_assert!(all.cmple(*fewer * (1.0 + 2e-6)).all(), "{all} with one more, {fewer} without");
        }
    }

    /// VPLs in another order have the same fluxes, bit for bit; lights and blockers in another order change roundings:
    /// 10⁻⁵ of the brightest, some 20 operations of 6·10⁻⁸.
    #[test]
    fn order_does_not_matter(
        mut vpls in vec(vpl(), 1..6),
        mut lights in vec(light(), 1..4),
        mut blockers in vec(blocker(), 0..10),
    ) {
        let (flux, _) = lit(&vpls, &lights, &blockers, &ALL);
        vpls.reverse();
        let (mut back, _) = lit(&vpls, &lights, &blockers, &ALL);
        back.reverse();
        prop_assert_eq!(&back, &flux);
        vpls.reverse();
        lights.reverse();
        blockers.reverse();
        let (other, _) = lit(&vpls, &lights, &blockers, &ALL);
        let brightest = flux.iter().map(|flux| flux.max_element()).fold(0.0, f32::max);
        for (a, b) in flux.iter().zip(&other) {
            prop_assert!(a.abs_diff_eq(*b, brightest * 1e-5), "{a} and {b}");
        }
    }
}
