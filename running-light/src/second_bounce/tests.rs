//! Second bounces by hand. Tolerance: 10⁻⁶, a few roundings.

use super::*;

const BOUNCE: SecondBounce = SecondBounce { average_albedo: 0.4, distance: 2.0 };

fn torch() -> Spot {
    Spot::new(Vec3::Y * 5.0, Vec3::NEG_Y, [0.1, 0.2], Vec3::ONE)
}

fn floor(x: f32) -> Vpl {
    Vpl { position: Vec3::X * x, normal: Vec3::Y, albedo: Vec3::ONE, weight: 1.0 }
}

/// Fluxes of 3 W red at x = 0 and 1 W blue at x = 4: weights ¾ and ¼, so the mean stands at x = 1 and has
/// (2.25, 0, 0.25) W. 2 m against the light's way down is 2 m up; 0.4/2² makes (0.225, 0, 0.025) W. A VPL that is culled
/// counts for nothing.
#[test]
fn of_two_vpls() {
    let vpls = [floor(0.0), floor(100.0), floor(4.0)];
    let flux = [Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO, Vec3::new(0.0, 0.0, 1.0)];
    let light = BOUNCE.of_constellation(&vpls, &flux, &Light::Spot(torch())).unwrap().unwrap();
    assert!(light.position.abs_diff_eq(Vec3::new(1.0, 2.0, 0.0), 1e-6), "{}", light.position);
    assert!(light.flux.abs_diff_eq(Vec3::new(0.225, 0.0, 0.025), 1e-6), "{}", light.flux);
    assert_eq!((light.normal, light.area), (Vec3::NEG_Y, PI));
}

/// From a point light at x = −3 to the mean at x = 1: against +x is x = −1. A directional light has its own way.
#[test]
fn every_kind_of_light_has_a_direction() {
    let (vpls, flux) = ([floor(1.0)], [Vec3::ONE]);
    let place = |light: Light| BOUNCE.of_constellation(&vpls, &flux, &light).unwrap().unwrap().position;
    assert_eq!(place(Light::point(Vec3::NEG_X * 3.0, Vec3::ONE)), Vec3::NEG_X);
    let sun = Light::Directional { direction: Vec3::NEG_Z, irradiance: Vec3::ONE };
    assert_eq!(place(sun), Vec3::new(1.0, 0.0, 2.0));
    assert_eq!(
        place(Light::point(Vec3::X, Vec3::ONE)),
        Vec3::new(1.0, 2.0, 0.0),
        "in its place: along the normal"
    );
}

/// Normals that cancel out: it faces the way of the light, which is where the lit surfaces are.
#[test]
fn opposed_normals_leave_the_lights_direction() {
    let vpls = [floor(0.0), Vpl { normal: Vec3::NEG_Y, ..floor(2.0) }];
    let light = BOUNCE.of_constellation(&vpls, &[Vec3::ONE; 2], &Light::Spot(torch())).unwrap().unwrap();
    assert_eq!(light.normal, Vec3::NEG_Y);
}

/// The phantom alone is a constellation of one.
#[test]
fn of_a_phantom() {
    let (vpl, flux) = (floor(1.0), Vec3::new(3.0, 2.0, 1.0));
    let phantom = VirtualLight { position: vpl.position, normal: vpl.normal, flux, area: 1.0 };
    let light = BOUNCE.of_phantom(&phantom, &torch()).unwrap();
    assert!(light.flux.abs_diff_eq(flux * 0.1, 1e-6));
    assert_eq!((light.position, light.normal), (Vec3::new(1.0, 2.0, 0.0), Vec3::NEG_Y));
    assert_eq!(BOUNCE.of_constellation(&[vpl], &[flux], &Light::Spot(torch())), Ok(Some(light)));
}

#[test]
fn nothing_lit_or_no_distance_is_off() {
    let spot = Light::Spot(torch());
    assert_eq!(BOUNCE.of_constellation(&[floor(0.0); 2], &[Vec3::ZERO; 2], &spot), Ok(None));
    assert_eq!(BOUNCE.of_constellation(&[], &[], &spot), Ok(None));
    for distance in [0.0, -1.0, f32::NAN] {
        let off = SecondBounce { distance, ..BOUNCE };
        assert_eq!(off.of_constellation(&[floor(0.0)], &[Vec3::ONE], &spot), Ok(None), "distance {distance}");
    }
    let black = SecondBounce { average_albedo: 0.0, ..BOUNCE };
    assert_eq!(black.of_constellation(&[floor(0.0)], &[Vec3::ONE], &spot), Ok(None));
    assert_eq!(
        BOUNCE.of_constellation(&[floor(0.0)], &[], &spot),
        Err(LengthError { slice: "flux", found: 0, expected: 1 })
    );
}
