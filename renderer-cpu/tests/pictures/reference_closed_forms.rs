//! Turns scenes of known light into reference pictures and compares the two.
#![allow(clippy::unwrap_used)]

use crate::scenes::{floor, mean, options, scene, sphere};
use glam::Vec3;
use photonstream_renderer::{LayerKind, Watch};
use photonstream_renderer_cpu::{
    Reference, ReferenceOptions, reference,
    reference::{PixelFilter, Stop},
    render,
};
use photonstream_scene::{RenderSettings, Scene};
use photonstream_shading::{Camera, surface};
use std::f64::consts::PI;

const ALL: [LayerKind; 3] = [LayerKind::Full, LayerKind::Direct, LayerKind::Indirect];

fn trace(scene: &Scene, width: u32, height: u32, samples: u64, pixel_filter: PixelFilter) -> Reference {
    let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(samples));
    let options = ReferenceOptions { width, height, layers: ALL.to_vec(), pixel_filter, ..defaults };
    reference(scene, &options, Watch::default()).unwrap()
}

fn mean_of(picture: &Reference, layer: &str) -> f64 {
    mean(&picture.film.layer(layer).unwrap().pixels)
}

/// 4 standard errors of the mean of a picture of independent pixels, relative.
fn four_sigma(noise: f64, pixels: usize) -> f64 {
    4.0 * noise / (pixels as f64).sqrt()
}

fn area(scene: &Scene) -> f64 {
    (0..scene.geometry.triangles.len()).map(|t| surface::area(scene.geometry.triangle(t as u32))).sum()
}

/// Light in the centre: direct radiance ρ P/(4π² R²), full radiance that over (1 − ρ). N = 32 × 24 pixels × 256
/// paths, seed 1. Tolerance: 4 σ, and 0.3 % for the 96-segment sphere (its facets lie up to 1 − cos(π/96) = 0.05 %
/// nearer, its area is 0.1 % less, and the light meets them up to 1.9° off their normal).
#[test]
fn inside_of_a_sphere_is_uniform() {
    let scene = sphere([0.0; 3]);
    let picture = trace(&scene, 32, 24, 256, PixelFilter::Centre);
    let direct = picture.film.layer("direct").unwrap();
    for p in &direct.pixels {
        assert!((p.x - 0.5).abs() < 0.5 * 0.003, "direct {p}");
    }
    let tolerance = four_sigma(picture.stats.noise_rel_rmse, 32 * 24) + 0.003;
    let full = mean_of(&picture, "full");
    assert!((full - 1.0).abs() < tolerance, "full {full}, tolerance {tolerance}");
    // The energy balance of the very mesh: 4 σ and nothing else but its non-uniformity of 0.1 %.
    let balance = 4.0 * PI * PI * 0.5 / 0.5 / area(&scene) / PI;
    assert!((full / balance - 1.0).abs() < tolerance - 0.002, "full {full} against {balance}");
}

/// The light anywhere, or an area light: the indirect radiance is ρ/π · P ρ/(4πR²(1 − ρ)) = 0.5 all the same.
/// N and tolerance as above.
#[test]
fn indirect_light_in_a_sphere_does_not_depend_on_the_lamp() {
    let plate = scene(&format!(
        "[camera]\nposition_m = [0.3, 0.2, -0.1]\ntarget_m = [-0.4, 0.1, 0.3]\nvertical_fov_deg = 100\n\
         [material.grey]\nalbedo = 0.5\n\
         [object.sphere]\nmaterial = \"grey\"\nsides = \"back\"\nsphere = {{ radius_m = 1, segments = 96 }}\n\
         [light.plate]\npower_w = {}\n\
         rectangle = {{ corner_m = [0.1, 0.5, 0.1], edge_u_m = [0.02, 0, 0], edge_v_m = [0, 0, 0.02] }}\n",
        4.0 * PI * PI
    ));
    for scene in [sphere([0.5, -0.3, 0.2]), plate] {
        let picture = trace(&scene, 32, 24, 256, PixelFilter::Centre);
        let indirect = mean_of(&picture, "indirect");
        let tolerance = four_sigma(picture.stats.noise_indirect_rel_rmse, 32 * 24) + 0.003;
        assert!((indirect / 0.5 - 1.0).abs() < tolerance, "indirect {indirect}, tolerance {tolerance}");
        // No bright or dark side: left and right half agree within 4 σ of each, √2 · √2 times that of the whole.
        let pixels = &picture.film.layer("indirect").unwrap().pixels;
        let half = |right: bool| {
            let values: Vec<Vec3> =
                pixels.iter().enumerate().filter(|(i, _)| (i % 32 >= 16) == right).map(|(_, &p)| p).collect();
            mean(&values)
        };
        let (left, right) = (half(false), half(true));
        assert!((left / right - 1.0).abs() < 2.0 * tolerance, "left {left}, right {right}");
    }
}

/// A closed cube lit by a lamp off its centre: over all faces the mean radiosity is P ρ/(A (1 − ρ)). Seen from the
/// centre each face fills a square picture, pixels of equal area. N = 6 × 16² × 256, seed 1; 4 σ + 0.2 % for the
/// midpoint rule of 16 pixels over a smooth irradiance.
#[test]
fn a_closed_box_keeps_its_energy() {
    let (power, albedo) = (10.0, 0.7);
    let mut scene = scene(&format!(
        "origin_m = [0, 0, 0]\n[camera]\nposition_m = [0, 0, 0]\ntarget_m = [0, 0, 1]\nvertical_fov_deg = 90\n\
         [material.grey]\nalbedo = {albedo}\n\
         [object.room]\nmaterial = \"grey\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
         [light.lamp]\npower_w = {power}\npoint = {{ position_m = [0.2, 0.3, -0.1] }}\n"
    ));
    let (mut sum, mut noise) = (0.0, 0.0);
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        let up = if axis.y == 0.0 { Vec3::Y } else { Vec3::Z };
        scene.camera = Camera::look_at(Vec3::ZERO, axis, up, 90.0).unwrap();
        let picture = trace(&scene, 16, 16, 256, PixelFilter::Centre);
        sum += mean_of(&picture, "full") * PI / 6.0;
        noise += picture.stats.noise_rel_rmse / 6.0;
    }
    let expected = power * albedo / (24.0 * (1.0 - albedo));
    let tolerance = four_sigma(noise, 6 * 256) + 0.002;
    assert!((sum / expected - 1.0).abs() < tolerance, "{sum} against {expected}, tolerance {tolerance}");
}

/// Form factors of unit squares: parallel at distance 1, 0.199825, and perpendicular with a common edge, 0.200044
/// (closed forms, e.g. Howell's catalogue C-11 and C-14). N = 24² pixel centres × 4096 light samples, seed 1: off the
/// common edge, where the variance of area sampling is infinite. Tolerance 4 σ + 0.1 % for the midpoint rule.
#[test]
fn unit_squares_have_their_form_factors() {
    let parallel = "rectangle = { corner_m = [-0.5, 1, -0.5], edge_u_m = [1, 0, 0], edge_v_m = [0, 0, 1] }";
    let perpendicular =
        "rectangle = { corner_m = [-0.5, 0, -0.5], edge_u_m = [0, 1, 0], edge_v_m = [0, 0, 1] }";
    for (light, factor) in [(parallel, 0.199_825), (perpendicular, 0.200_044)] {
        let mut scene = floor(&format!("[light.emitter]\npower_w = 3\n{light}\n"));
        // Half a metre above the floor, a 90° view sees the unit square.
        scene.camera = Camera::look_at(Vec3::Y * 0.5, Vec3::ZERO, Vec3::NEG_Z, 90.0).unwrap();
        let picture = trace(&scene, 24, 24, 4096, PixelFilter::Centre);
        let red: f64 =
            picture.film.layer("direct").unwrap().pixels.iter().map(|p| f64::from(p.x)).sum::<f64>();
        let found = red / 576.0 * PI / 0.8 / 3.0;
        let tolerance = four_sigma(picture.stats.noise_direct_rel_rmse, 576) + 0.001;
        assert!((found / factor - 1.0).abs() < tolerance, "{found} against {factor}, tolerance {tolerance}");
        assert!(tolerance < 0.015, "{tolerance}");
        // The renderer's own direct light: the same.
        let mut settings = options(24, 24, &[LayerKind::Direct]);
        settings.light_samples = 4096;
        let picture = render(&scene, &photonstream_renderer::VslSet::default(), &settings, Watch::default());
        let film = picture.unwrap().film;
        let red: f64 = film.layers()[0].pixels.iter().map(|p| f64::from(p.x)).sum::<f64>();
        let found = red / 576.0 * PI / 0.8 / 3.0;
        assert!((found / factor - 1.0).abs() < tolerance, "render: {found} against {factor}");
    }
}

/// More lights than are sampled one by one: choosing by power gives the same picture. N = 24² × 512; 4 σ.
#[test]
fn one_light_of_many_stands_for_all() {
    let lamps = |from: usize, to: usize| {
        let lamp = |i: usize| {
            let (x, z) = ((i % 4) as f64 * 0.5 - 0.75, (i / 4) as f64 * 0.5 - 0.75);
            format!("[light.l{i:02}]\npower_w = {}\npoint = {{ position_m = [{x}, 0.7, {z}] }}\n", 1 + i)
        };
        floor(&(from..to).map(lamp).collect::<String>())
    };
    let all = trace(&lamps(0, 12), 24, 24, 512, PixelFilter::Centre);
    let some = [
        trace(&lamps(0, 6), 24, 24, 2, PixelFilter::Centre),
        trace(&lamps(6, 12), 24, 24, 2, PixelFilter::Centre),
    ];
    let expected: f64 = some.iter().map(|p| mean_of(p, "direct")).sum();
    let found = mean_of(&all, "direct");
    let tolerance = four_sigma(all.stats.noise_direct_rel_rmse, 576);
    assert!(all.stats.noise_direct_rel_rmse > 0.0 && some[0].stats.noise_direct_rel_rmse < 1e-6);
    assert!((found / expected - 1.0).abs() < tolerance, "{found} against {expected}, tolerance {tolerance}");
}

/// A point light over a plane: L = ρ/π · P/(4π) · cos θ/r², pixel by pixel. Tolerance 5e-5: hits are drawn inwards
/// by 4e-6 of their triangle, here up to 1e-5 m of the 0.8 m to the lamp, and the law is of third order.
#[test]
fn a_point_light_follows_the_cosine_law() {
    let scene = floor("[light.lamp]\npower_w = [4, 5, 6]\npoint = { position_m = [0.3, 0.8, -0.2] }\n");
    let lamp = Vec3::new(0.3, 0.8, -0.2).as_dvec3();
    let film = render(
        &scene,
        &photonstream_renderer::VslSet::default(),
        &options(40, 30, &[LayerKind::Full, LayerKind::Direct, LayerKind::Indirect]),
        Watch::default(),
    )
    .unwrap()
    .film;
    for (i, p) in film.layer("full").unwrap().pixels.iter().enumerate() {
        let d = lamp - crate::scenes::on_floor(&scene, i, 40, 30).as_dvec3();
        let irradiance = d.y / d.length().powi(3) / (4.0 * PI);
        for (found, expected) in [
            (p.x, 4.0 * 0.8 / PI * irradiance),
            (p.y, 5.0 * 0.4 / PI * irradiance),
            (p.z, 6.0 * 0.2 / PI * irradiance),
        ] {
            assert!(
                (f64::from(found) / expected - 1.0).abs() < 5e-5,
                "pixel {i}: {found} against {expected}"
            );
        }
    }
    assert_eq!(film.layer("full").unwrap().pixels, film.layer("direct").unwrap().pixels);
    assert!(film.layer("indirect").unwrap().pixels.iter().all(|p| *p == Vec3::ZERO));
}
