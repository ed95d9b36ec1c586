//! Turns whole pictures into the claim that the device's irradiance is the CPU renderer's.

use super::*;

const SIZE: [u32; 2] = [72, 64];

/// Both sides sum the same terms in f32; answers may differ for single rays that graze an edge. N = 4 608 pixels.
const TOLERANCE: f64 = 1e-3;

#[test]
fn direct_light_is_that_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for (name, samples) in [
        ("cornell-box.toml", 1),
        ("integrating-sphere.toml", 1),
        ("two-rooms.toml", 3),
        ("cornell-knot.toml", 1),
    ] {
        let scene = config(name);
        let (found, _) = Picture::new(&gpu, &scene, SIZE).direct(&scene, samples);
        let error = relative_rmse(
            &found,
            &expected(&scene, &VslSet::default(), SIZE, LayerKind::Direct, samples, WHOLE),
        );
        assert!(error <= TOLERANCE, "{name}: {error:e}");
    }
}

/// Every kind of light in one scene, area lights among the others so that each sample takes the right dimension.
#[test]
fn every_kind_of_light_arrives_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = scene(
        r#"
        [camera]
        position_m = [0.2, 1.2, 3.5]
        target_m = [0, 0.5, 0]
        vertical_fov_deg = 50
        [material.grey]
        albedo = 0.7
        [object.floor]
        material = "grey"
        quad = { corner_m = [-2, 0, 2], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -4] }
        [object.block]
        material = "grey"
        position_m = [0.2, 0.4, 0]
        rotation_deg = [0, 30, 10]
        box = { size_m = [0.6, 0.7, 0.5] }
        [light.a-panel]
        power_w = [3, 2, 1]
        rectangle = { corner_m = [-1, 2, 0], edge_u_m = [0.5, 0, 0], edge_v_m = [0, 0, 0.5] }
        [light.b-bulb]
        power_w = [1, 2, 3]
        point = { position_m = [1, 1.5, 1] }
        [light.c-panel]
        power_w = [1, 5, 1]
        rectangle = { corner_m = [1, 1.2, -1], edge_u_m = [0, 0, 0.4], edge_v_m = [-0.1, 0.4, 0] }
        [light.d-spot]
        power_w = [4, 4, 4]
        spot = { position_m = [-1, 2, 1], target_m = [0, 0, 0], outer_half_angle_deg = 40, inner_half_angle_deg = 20 }
        [light.e-sun]
        irradiance_w_m2 = [0.3, 0.3, 0.2]
        directional = { direction = [0.4, -1, -0.3] }
        "#,
    );
    let (found, _) = Picture::new(&gpu, &scene, SIZE).direct(&scene, 4);
    let error =
        relative_rmse(&found, &expected(&scene, &VslSet::default(), SIZE, LayerKind::Direct, 4, WHOLE));
    assert!(error <= TOLERANCE, "{error:e}");
}

/// N = 300 lights, without ranges, with ranges that leave some out, and with those that they have drawn by lot.
#[test]
fn indirect_light_with_a_ray_to_each_is_that_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let by_lot = (2e-4, RangeCulling::Stochastic);
    for (name, range) in [
        ("cornell-box.toml", WHOLE),
        ("cornell-box.toml", (2e-4, RangeCulling::Cut)),
        ("cornell-box.toml", by_lot),
        ("two-rooms.toml", WHOLE),
    ] {
        let epsilon = range.0;
        let scene = config(name);
        let vsls = scattered_vsls(&scene, 300);
        let mut picture = Picture::new(&gpu, &scene, SIZE);
        picture.frame.albedo_max = scene
            .objects
            .iter()
            .map(|o| scene.materials[o.material.0 as usize].albedo.max_element())
            .fold(0.0, f32::max);
        if range == by_lot {
            picture.frame.flux_of_range = culling::flux_of_range(picture.frame.albedo_max, epsilon);
            picture.frame.first_lot = culling::first_lot(1, 0);
        }
        let reference = expected(&scene, &vsls, SIZE, LayerKind::Indirect, 1, range);
        for budget in [0, 300, 4_000] {
            let (found, _) = picture.indirect(&vsls, epsilon, budget, 0);
            let error = relative_rmse(&found, &reference);
            assert!(error <= TOLERANCE, "{name}, {range:?}: {error:e}");
            assert_eq!(picture.rays.noise(&gpu).unwrap(), Some(0.0));
        }
    }
}

/// With a budget the mean of many samples is the exact picture, no pixel asks more rays than it may, and the standard
/// error that the two halves tell is the real error. N = 36 samples of 8 rays of 72 × 64 pixels; the real error of the
/// mean is one draw of 4 608 correlated pixels: a factor of 1.3 either way. Bias would not fall with the samples: the
/// error of all 36 is below a quarter of that of one (a sixth is expected).
#[test]
fn a_budget_is_unbiased_and_tells_its_error() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let vsls = scattered_vsls(&scene, 200);
    let mut picture = Picture::new(&gpu, &scene, SIZE);
    let exact: Vec<_> =
        picture.indirect(&vsls, 0.0, 0, 0).0.into_iter().map(|e| (e != Vec3::ZERO).then_some(e)).collect();
    for budget in [8, 5] {
        picture.rays.restart_noise();
        assert_eq!(picture.rays.noise(&gpu).unwrap(), None);
        let mut mean = vec![Vec3::ZERO; exact.len()];
        let mut first = 0.0;
        const SAMPLES: u32 = 36;
        for sample in 0..SAMPLES {
            let (found, traced) = picture.indirect(&vsls, 0.0, budget, sample);
            assert!(traced.rays <= u64::from(budget) * exact.len() as u64 && traced.rays > 0, "{traced:?}");
            for (sum, value) in mean.iter_mut().zip(&found) {
                *sum += *value / SAMPLES as f32;
            }
            if sample == 0 {
                first = relative_rmse(&found, &exact);
                let told = picture.rays.noise(&gpu).unwrap().unwrap();
                assert!((first / 1.3..first * 1.3).contains(&told), "{budget}: {told} of {first}");
            }
        }
        let error = relative_rmse(&mean, &exact);
        let told = picture.rays.noise(&gpu).unwrap().unwrap();
        assert!(error < first * 0.25, "{budget}: {error} after {first}");
        // Samples of one sequence complement each other: the mean is at least as good as independent ones.
        assert!(told > error / 1.3, "{budget}: {told} of {error}");
    }
    assert!(picture.indirect(&vsls, 0.0, 1, 0).0.iter().all(|e| e.is_finite()));
    assert_eq!(picture.rays.noise(&gpu).unwrap(), None);
}

#[test]
fn a_picture_without_lights_or_geometry_is_black() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let mut picture = Picture::new(&gpu, &scene, [9, 5]);
    assert!(picture.indirect(&VslSet::default(), 0.0, 4, 0).0.iter().all(|e| *e == Vec3::ZERO));
    let vsls = scattered_vsls(&scene, 20);
    let mut lit = picture.indirect(&vsls, 0.0, 0, 0).0;
    assert!(lit.iter().any(|e| *e != Vec3::ZERO));
    let row = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(9 * 16), rows_per_image: None };
    let texture = &picture.gbuffer.texture;
    gpu.queue.write_texture(texture.as_image_copy(), &[0; 9 * 5 * 16], row, texture.size());
    for budget in [0, 4] {
        lit = picture.indirect(&vsls, 0.0, budget, 0).0;
        assert!(lit.iter().all(|e| *e == Vec3::ZERO), "what was there before is gone");
    }
}

#[test]
fn a_stopped_pass_says_so() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let vsls = scattered_vsls(&scene, 20);
    let mut picture = Picture::new(&gpu, &scene, [8, 8]);
    picture.indirect(&vsls, 0.0, 0, 0);
    let lights = upload(&gpu, "lights", bytemuck::cast_slice(&[VslUniform::default(); 20]));
    let stop = std::sync::atomic::AtomicBool::new(true);
    let (_, traced) = picture.trace(&lights, 20, 0, |rays, gpu, encoder, inputs| {
        let watch = Watch { cancelled: Some(&stop), progress: None };
        rays.encode_indirect(gpu, encoder, &RayInputs { watch, ..*inputs }, 0)
    });
    assert!(traced.stopped && traced.rays == 0, "{traced:?}");
}
