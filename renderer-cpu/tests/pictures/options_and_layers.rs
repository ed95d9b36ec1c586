//! Turns options into pictures or clear refusals, and checks what the layers hold.
#![allow(clippy::unwrap_used)]

use crate::scenes::{NO_LIGHT, cornell, floor, options, scattered_vsls};
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderError, RenderOptions, VslSet, Watch};
use photonstream_renderer_cpu::{ReferenceOptions, reference, reference::Stop, render};
use photonstream_scene::RenderSettings;
use std::sync::{
    Mutex,
    atomic::{AtomicBool, Ordering},
};

#[test]
fn options_out_of_range_are_named() {
    let scene = floor(NO_LIGHT);
    let good = options(8, 8, &[LayerKind::Full]);
    let with = |change: fn(&mut RenderOptions)| {
        let mut options = good.clone();
        change(&mut options);
        render(&scene, &VslSet::default(), &options, Watch::default()).unwrap_err().to_string()
    };
    for (message, start) in [
        (with(|o| o.width = 0), "picture size: found 0 x 8"),
        (with(|o| o.epsilon = f32::NAN), "epsilon: found NaN"),
        (with(|o| o.epsilon = -1.0), "epsilon: found -1"),
        (with(|o| o.light_samples = 0), "light_samples: found 0"),
        (with(|o| o.samples_per_pixel = 0), "samples per pixel: found 0"),
        (with(|o| o.threads = Some(0)), "threads: found 0"),
        (with(|o| o.layers.clear()), "layers: found []"),
        (with(|o| o.layers = vec![LayerKind::Full; 2]), "layers: found [full, full]"),
    ] {
        assert!(message.starts_with(start), "{message}");
    }
    let good = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(4));
    for (bad, start) in [
        (ReferenceOptions { stop: Stop::Samples(0), ..good.clone() }, "samples per pixel: found 0"),
        (ReferenceOptions { layers: vec![LayerKind::Vsl], ..good.clone() }, "layers: found [vsl]"),
        (ReferenceOptions { stop: Stop::Error { rel_rmse: 0.0, max_samples: 10 }, ..good }, "error: found 0"),
    ] {
        let message = reference(&scene, &bad, Watch::default()).unwrap_err().to_string();
        assert!(message.starts_with(start), "{message}");
    }
}

#[test]
fn layers_hold_what_they_say() {
    let scene = floor(NO_LIGHT);
    let vsls = scattered_vsls(&scene, 10);
    let film = render(&scene, &vsls, &options(21, 16, &LayerKind::ALL), Watch::default()).unwrap().film;
    let layer = |kind: LayerKind| &film.layer(kind.name()).unwrap().pixels;
    for i in 0..film.pixel_count() {
        assert_eq!(layer(LayerKind::Albedo)[i], Vec3::new(0.8, 0.4, 0.2));
        assert!(layer(LayerKind::Normal)[i].distance(Vec3::new(0.5, 1.0, 0.5)) < 1e-6);
        let distance = scene.camera.position.distance(crate::scenes::on_floor(&scene, i, 21, 16));
        assert!((layer(LayerKind::Depth)[i].x - distance).abs() < 1e-5);
        let x = crate::scenes::on_floor(&scene, i, 21, 16);
        let owner = (0..vsls.len())
            .map(|k| vsls.get(k).unwrap())
            .min_by(|a, b| a.position.distance(x).total_cmp(&b.position.distance(x)))
            .unwrap();
        assert!((layer(LayerKind::Flux)[i] - owner.flux / owner.area).length() < 1e-6);
    }
    let mut colours: Vec<[u32; 3]> =
        layer(LayerKind::Vsl).iter().map(|p| p.to_array().map(f32::to_bits)).collect();
    colours.sort_unstable();
    colours.dedup();
    assert!(colours.len() > 3 && colours.len() <= 10, "{} owners", colours.len());
    assert_eq!(film.metadata.scene_hash, Some(scene.hash));
    assert_eq!(film.metadata.kernel.as_deref(), Some("disc"));
}

#[test]
fn an_empty_view_and_no_lights_are_black() {
    let mut scene = floor(NO_LIGHT);
    scene.camera = photonstream_shading::Camera::look_at(Vec3::Y, Vec3::Y * 2.0, Vec3::X, 60.0).unwrap();
    let film =
        render(&scene, &VslSet::default(), &options(9, 7, &LayerKind::ALL), Watch::default()).unwrap().film;
    assert!(film.layers().iter().all(|l| l.pixels.iter().all(|p| *p == Vec3::ZERO)));
    let options = ReferenceOptions {
        width: 9,
        height: 7,
        ..ReferenceOptions::from_settings(
            &RenderSettings::default(),
            Stop::Error { rel_rmse: 0.1, max_samples: 64 },
        )
    };
    let black = reference(&scene, &options, Watch::default()).unwrap();
    assert!(black.film.layers()[0].pixels.iter().all(|p| *p == Vec3::ZERO));
    assert_eq!(black.stats.noise_rel_rmse, 0.0);
}

#[test]
fn progress_reaches_one_and_a_flag_stops() {
    let scene = cornell();
    let vsls = scattered_vsls(&scene, 20);
    let shares = Mutex::new(Vec::new());
    let cancelled = AtomicBool::new(false);
    let note = |share: f64| shares.lock().unwrap().push(share);
    let watch = Watch { progress: Some(&note), cancelled: Some(&cancelled) };
    render(&scene, &vsls, &options(100, 80, &[LayerKind::Full]), watch).unwrap();
    assert!(shares.lock().unwrap().contains(&1.0));
    shares.lock().unwrap().clear();
    let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(16));
    let traced = ReferenceOptions { width: 40, height: 30, ..defaults };
    reference(&scene, &traced, watch).unwrap();
    assert!(shares.lock().unwrap().iter().all(|s| (0.0..=1.0).contains(s)));
    assert_eq!(shares.lock().unwrap().last(), Some(&1.0));
    cancelled.store(true, Ordering::Relaxed);
    let stopped = render(&scene, &vsls, &options(100, 80, &[LayerKind::Full]), watch);
    assert!(matches!(stopped, Err(RenderError::Cancelled)));
    assert!(matches!(reference(&scene, &traced, watch), Err(RenderError::Cancelled)));
}
