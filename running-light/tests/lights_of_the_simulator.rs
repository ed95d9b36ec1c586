//! Turns the same lights into irradiance here and in `photonstream_shading`: powers and falloffs mean the same.
#![allow(clippy::unwrap_used)]

use photonstream_running_light::{Light, Spot, UpdateSettings, Vec3, Visibility, Vpl, VplId, update};
use photonstream_shading::{LightShape, sampling, sobol::Sequence};

/// 4 096 Sobol points around each light, to 10⁻⁵ of the brightest (the profile of a spot is steep at its edge).
#[test]
fn irradiance_is_that_of_the_simulator() {
    let (position, axis, power) =
        (Vec3::new(0.3, 1.0, -0.2), Vec3::new(0.48, -0.6, 0.64), Vec3::new(40.0, 20.0, 5.0));
    let half_angles = [0.2f32, 0.7];
    let spot = Spot::new(position, axis, half_angles, power);
    let [versine_inner, versine_outer] = half_angles.map(|a| 2.0 * (a * 0.5).sin().powi(2));
    let pairs = [
        (Light::point(position, power), LightShape::Point { position }),
        (Light::Spot(spot), LightShape::Spot { position, direction: axis, versine_inner, versine_outer }),
        (
            Light::Directional { direction: axis, irradiance: power },
            LightShape::Directional { direction: axis },
        ),
    ];
    let settings = UpdateSettings { area_per_weight: 1.0, cull_intensity: 0.0 };
    for (ours, theirs) in pairs {
        let mut lit = 0;
        for i in 0..4096 {
            let mut sample = Sequence::new(1, 0).sample(i);
            // Within two metres of the light, nearest 20 cm.
            let [distance, _] = sample.next_2d();
            let x = position + sampling::sphere(sample.next_2d()) * (0.2 + 1.8 * distance);
            let expected = theirs.illuminate(x, [0.0; 2]);
            let (normal, irradiance) =
                expected.map_or((Vec3::Y, Vec3::ZERO), |e| (e.wi, e.irradiance * power));
            let vpl = Vpl { position: x, normal, albedo: Vec3::ONE, weight: 1.0 };
            let mut flux = [Vec3::NAN];
            update(&[vpl], &[ours], &mut Visibility::None, &settings, &mut flux, &mut [VplId(0)]).unwrap();
            // 1 W/sr per 4π W at 20 cm is 2 W/m² for each W.
            let brightest = irradiance.max_element().max(1.0);
            assert!(
                flux[0].abs_diff_eq(irradiance, 1e-5 * brightest),
                "{ours:?} at {x}: {} {irradiance}",
                flux[0]
            );
            lit += u32::from(irradiance != Vec3::ZERO);
        }
        assert!(lit > 400, "{theirs:?} lights {lit} of 4096 points");
    }
}
