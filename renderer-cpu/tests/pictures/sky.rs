//! Turns skies over scenes of known light into pictures of the reference and of the renderer, and compares them.
#![allow(clippy::unwrap_used)]

use crate::scenes::{floor, mean, on_floor, options, scene};
use glam::Vec3;
use photonstream_renderer::{LayerKind, VslSet, Watch};
use photonstream_renderer_cpu::{Reference, ReferenceOptions, reference, reference::Stop, render};
use photonstream_scene::{RenderSettings, Scene};
use photonstream_shading::Camera;
use std::f64::consts::PI;

const LAYERS: [LayerKind; 3] = [LayerKind::Full, LayerKind::Direct, LayerKind::Indirect];

fn trace(scene: &Scene, width: u32, height: u32, samples: u64) -> Reference {
    let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(samples));
    reference(
        scene,
        &ReferenceOptions { width, height, layers: LAYERS.to_vec(), ..defaults },
        Watch::default(),
    )
    .unwrap()
}

/// The renderer's direct light, without virtual surface lights.
fn direct(scene: &Scene, width: u32, height: u32, light_samples: u32) -> Vec<Vec3> {
    let mut settings = options(width, height, &LAYERS);
    settings.light_samples = light_samples;
    let film = render(scene, &VslSet::default(), &settings, Watch::default()).unwrap().film;
    assert_eq!(film.layer("full").unwrap().pixels, film.layer("direct").unwrap().pixels);
    film.layer("direct").unwrap().pixels.clone()
}

/// An open floor under a constant sky of radiance 2 shines back ρ L everywhere, under a gradient ρ (h/3 + 2z/3).
///
/// N = 24² pixels × 256 directions, seed 1; the mean to 4 σ of the reference's own noise, and so that of the renderer, whose
/// 256 directions are drawn alike. The floor is all the picture shows.
#[test]
fn an_open_floor_shines_back_what_comes_from_above() {
    for (sky, expected) in [
        ("radiance_w_m2_sr = 2", [1.6, 0.8, 0.4]),
        ("zenith_w_m2_sr = [3, 6, 0], horizon_w_m2_sr = [0, 3, 3], ground_w_m2_sr = 50", [1.6, 2.0, 0.2]),
    ] {
        let mut scene = floor(&format!("[light.sky]\nsky = {{ {sky} }}\n"));
        scene.camera = Camera::look_at(Vec3::Y * 0.9, Vec3::ZERO, Vec3::NEG_Z, 60.0).unwrap();
        let picture = trace(&scene, 24, 24, 256);
        let tolerance = 4.0 * picture.stats.noise_direct_rel_rmse / 24.0;
        assert!(tolerance < 0.02 && tolerance > 0.0, "{tolerance}");
        let mean_of = |pixels: &[Vec3]| pixels.iter().map(|p| p.as_dvec3()).sum::<glam::DVec3>() / 576.0;
        let largest = f64::max(expected[0], expected[1]);
        for found in
            [mean_of(&picture.film.layer("direct").unwrap().pixels), mean_of(&direct(&scene, 24, 24, 256))]
        {
            let error = (found - glam::DVec3::from(expected)).abs().max_element();
            assert!(
                error < tolerance * largest,
                "{sky}: {found}, expected {expected:?}, tolerance {tolerance}"
            );
        }
        assert!(picture.film.layer("indirect").unwrap().pixels.iter().all(|p| *p == Vec3::ZERO));
    }
}

/// A convex body of albedo 1 in a constant sky cannot be told from it: every pixel of the furnace has the radiance of the sky.
///
/// Background exact to f32; the body's mean to 4 σ of the noise of N = 256 directions, of which at most 0.999 survive.
#[test]
fn a_white_body_in_a_furnace_disappears() {
    for body in ["sphere = { radius_m = 0.5, segments = 64 }", "box = { size_m = [0.9, 0.6, 0.7] }"] {
        let scene = scene(&format!(
            "[camera]\nposition_m = [1, 0.8, 2]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
             [material.white]\nalbedo = 1\n[object.body]\nmaterial = \"white\"\n{body}\n\
             [light.sky]\nsky = {{ radiance_w_m2_sr = 1, scale = [3, 2, 1] }}\n"
        ));
        let picture = trace(&scene, 32, 32, 256);
        let seen = |i: usize| scene.bvh.closest(&ray(&scene, i)).is_some();
        for pixels in [&picture.film.layer("full").unwrap().pixels, &direct(&scene, 32, 32, 256)] {
            let (mut sum, mut count) = (Vec3::ZERO, 0.0f32);
            for (i, p) in pixels.iter().enumerate() {
                if seen(i) {
                    sum += *p;
                    count += 1.0;
                } else {
                    assert!((*p - Vec3::new(3.0, 2.0, 1.0)).abs().max_element() < 3e-6, "{p}");
                }
            }
            assert!(count > 100.0 && count < 900.0, "{count}");
            let found = sum / count / Vec3::new(3.0, 2.0, 1.0);
            // The noise is that of the whole picture, to which the background adds none.
            let tolerance =
                4.0 * picture.stats.noise_rel_rmse as f32 * (1024.0 / count).sqrt() / count.sqrt();
            assert!(tolerance < 0.01, "{tolerance}");
            assert!((found - Vec3::ONE).abs().max_element() < tolerance, "{found}, tolerance {tolerance}");
        }
    }
}

fn ray(scene: &Scene, pixel: usize) -> photonstream_scene::bvh::Ray {
    let (x, y) = (pixel as u32 % 32, pixel as u32 / 32);
    let direction = scene.camera.direction(x as f32 + 0.5, y as f32 + 0.5, 32, 32);
    photonstream_scene::bvh::Ray { origin: scene.camera.position, direction, t_max: f32::INFINITY }
}

/// A unit wall beside a unit floor takes its form factor 0.200044 of the light of a constant sky (Howell's catalogue, C-14).
///
/// N = 24² pixel centres × 1 024 directions, seed 1; 4 σ + 0.1 % for the midpoint rule.
#[test]
fn a_wall_takes_its_form_factor_of_the_sky() {
    let mut scene = floor(
        "[material.black]\nalbedo = 0\n[object.wall]\nmaterial = \"black\"\nsides = \"both\"\n\
         quad = { corner_m = [-0.5, 0, -0.5], edge_u_m = [0, 1, 0], edge_v_m = [0, 0, 1] }\n\
         [light.sky]\nsky = { radiance_w_m2_sr = 1 }\n",
    );
    // Half a metre above the floor, a 90° view sees the unit square.
    scene.camera = Camera::look_at(Vec3::Y * 0.5, Vec3::ZERO, Vec3::NEG_Z, 90.0).unwrap();
    let picture = trace(&scene, 24, 24, 1024);
    let tolerance = 4.0 * picture.stats.noise_direct_rel_rmse / 24.0 + 0.001;
    assert!(tolerance < 0.01, "{tolerance}");
    for pixels in [picture.film.layer("direct").unwrap().pixels.clone(), direct(&scene, 24, 24, 1024)] {
        let found = pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / 576.0 / 0.8;
        let expected = 1.0 - 0.200_044;
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{found}, expected {expected}, tolerance {tolerance}"
        );
    }
    assert!(on_floor(&scene, 0, 24, 24).y.abs() < 1e-5);
}

/// Under a map whose only light is one texel the floor gets what a sun of that texel's solid angle gives: E = L Ω cos θ,
/// and the wall's shadow lies where that sun's does. N = 24² × 64 directions; half of the samples meet the texel, 4 σ + 0.5 %
/// for the cosine within the texel of 5.6°.
#[test]
fn a_bright_texel_is_a_sun() {
    let folder = tempfile::tempdir().unwrap();
    // RGBE texels without run lengths: 64 × 32, one of them (128, 64, 32) · 2⁰ at column 40, row 10, the others black.
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n".to_vec();
    let texel = |i: usize| if i == 10 * 64 + 40 { [128u8, 64, 32, 136] } else { [0; 4] };
    for row in 0..32 {
        // New style: each channel of a row as literals.
        bytes.extend([2, 2, 0, 64]);
        for channel in 0..4 {
            bytes.push(64);
            bytes.extend((0..64).map(|x| texel(row * 64 + x)[channel]));
        }
    }
    std::fs::write(folder.path().join("sun.hdr"), bytes).unwrap();
    let text = format!(
        "[light.sky]\nsky = {{ map = \"{}\", rotation_deg = -120 }}\n",
        folder.path().join("sun.hdr").display()
    );
    let mut scene = floor(&text);
    scene.camera = Camera::look_at(Vec3::Y * 0.9, Vec3::ZERO, Vec3::NEG_Z, 60.0).unwrap();
    let sky = scene.sky.unwrap();
    let (top, bottom) = (10.0 * PI / 32.0, 11.0 * PI / 32.0);
    // ∫ cos θ dω over the texel, and its radiance in red, 128.
    let expected = 128.0 * (PI / 32.0) * 0.5 * (bottom.sin().powi(2) - top.sin().powi(2)) * 0.8 / PI;
    let picture = trace(&scene, 24, 24, 64);
    let tolerance = 4.0 * picture.stats.noise_direct_rel_rmse / 24.0 + 0.005;
    assert!(tolerance < 0.05, "{tolerance}");
    for pixels in [picture.film.layer("direct").unwrap().pixels.clone(), direct(&scene, 24, 24, 64)] {
        let found = pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / 576.0;
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{found}, expected {expected}, tolerance {tolerance}"
        );
        assert!((mean(&pixels) / found - 0.8 * (1.0 + 0.25 + 0.0625) / 2.4).abs() < 0.01);
    }
    // Column 40 of 64: 47.8° right of −Z, turned back by 120°: at 167.8° clockwise, towards +Z.
    let angle = ((40.5 / 64.0 - 0.5) * 360.0 + 120.0f32).to_radians();
    let wi =
        Vec3::new(angle.sin(), (0.5 * PI as f32 - 10.5 * PI as f32 / 32.0).tan(), -angle.cos()).normalize();
    assert!(scene.background(wi).x > 127.0 && scene.background(Vec3::new(-wi.x, wi.y, -wi.z)).x == 0.0);
    assert_eq!(scene.lights[sky.0 as usize].name, "sky");
}
