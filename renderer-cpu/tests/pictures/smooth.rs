//! Turns surfaces with shading normals into pictures of known light.
#![allow(clippy::unwrap_used)]

use crate::scenes::{mean, options, scene};
use glam::Vec3;
use photonstream_renderer::{LayerKind, VslSet, Watch};
use photonstream_renderer_cpu::{ReferenceOptions, reference, reference::Stop, render};
use photonstream_scene::{RenderSettings, Scene};
use std::f64::consts::PI;

/// A plate of 2 cm and albedo 0.8 in the plane y = 0, looked down on; its corners' normals are tilted by `degrees` towards +x.
fn plate(degrees: f64, rest: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let (s, c) = degrees.to_radians().sin_cos();
    let obj = format!("v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvn {s} {c} 0\nf 1//1 2//1 3//1 4//1\n");
    let path = folder.path().join("plate.obj");
    std::fs::write(&path, obj).unwrap();
    scene(&format!(
        "origin_m = [0, 0, 0]\n[camera]\nposition_m = [0, 0.1, 0]\ntarget_m = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 5\n\
         [material.light]\nalbedo = 0.8\n[material.grey]\nalbedo = 0.5\n\
         [object.plate]\nmaterial = \"light\"\nobj = {{ path = {:?}, unit_m = 0.01 }}\n{rest}",
        path.to_str().unwrap()
    ))
}

/// A sun of 3 W m⁻² from straight above onto a plate bent by θ: L = ρ/π E cos θ, exactly; where it shines from below the
/// plate the plate shadows itself, however the normal is bent. Renderer and reference agree bit for bit.
#[test]
fn the_bent_normal_weighs_the_sun() {
    for (degrees, direction, expected) in [
        (0.0, "[0, -1, 0]", 1.0),
        (25.0, "[0, -1, 0]", 25f64.to_radians().cos()),
        (25.0, "[-1, -1, 0]", 20f64.to_radians().cos()),
        (-25.0, "[-1, -1, 0]", 70f64.to_radians().cos()),
        (40.0, "[-1, 0.2, 0]", 0.0),
        (-50.0, "[-1, -0.2, 0]", 0.0),
        // Too far off to be meant.
        (70.0, "[0, -1, 0]", 1.0),
    ] {
        let sun = format!("[light.sun]\nirradiance_w_m2 = 3\ndirectional = {{ direction = {direction} }}\n");
        let scene = plate(degrees, &sun);
        let settings = options(5, 5, &[LayerKind::Direct]);
        let film = render(&scene, &VslSet::default(), &settings, Watch::default()).unwrap().film;
        let found = &film.layer("direct").unwrap().pixels;
        let expected = 0.8 / PI * 3.0 * expected;
        for pixel in found {
            // A few roundings of f32.
            assert!(
                (f64::from(pixel.x) - expected).abs() < 1e-6,
                "{degrees}, {direction}: {pixel}, expected {expected}"
            );
        }
        let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(2));
        let settings = ReferenceOptions { width: 5, height: 5, layers: vec![LayerKind::Direct], ..defaults };
        let traced = reference(&scene, &settings, Watch::default()).unwrap().film;
        for (a, b) in traced.layer("direct").unwrap().pixels.iter().zip(found) {
            assert!((*a - *b).abs().max_element() < 1e-6, "{a} {b}");
        }
    }
}

/// The plate inside a sphere with a lamp in its centre, whose walls have the radiance ρ P/(4π² R²)/(1 − ρ) = 1 everywhere: of the half space over its bent normal the plate
/// itself hides what is behind it, and the sphere lights it by π (1 + cos θ)/2.
///
/// N = 16² pixels × 1 024 paths, seed 1. Tolerance 4 σ of the reference's own noise, and 0.3 % for the facets of the sphere and
/// 0.1 % for what the plate takes from it (two sides of 4e-4 m² of 12.6 m²).
#[test]
fn a_bent_plate_in_even_light() {
    for degrees in [0.0f64, 30.0, 55.0] {
        let sphere = format!(
            "[object.sphere]\nmaterial = \"grey\"\nsides = \"back\"\nposition_m = [0.1, 0.2, -0.3]\n\
             sphere = {{ radius_m = 1, segments = 96 }}\n\
             [light.lamp]\npower_w = {}\npoint = {{ position_m = [0.1, 0.2, -0.3] }}\n",
            4.0 * PI * PI
        );
        let scene = plate(degrees, &sphere);
        let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(1024));
        let layers = vec![LayerKind::Direct, LayerKind::Indirect, LayerKind::Normal];
        let settings = ReferenceOptions { width: 16, height: 16, layers: layers[..2].to_vec(), ..defaults };
        let picture = reference(&scene, &settings, Watch::default()).unwrap();
        let found = mean(&picture.film.layer("indirect").unwrap().pixels);
        let tolerance = 4.0 * picture.stats.noise_indirect_rel_rmse / 16.0 + 0.004;
        let expected = 0.8 * (1.0 + degrees.to_radians().cos()) / 2.0;
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{degrees}: {found}, expected {expected} ± {tolerance}"
        );
        assert!(tolerance < 0.03, "{tolerance}");
        let film =
            render(&scene, &VslSet::default(), &options(3, 3, &layers), Watch::default()).unwrap().film;
        let (s, c) = degrees.to_radians().sin_cos();
        for normal in &film.layer("normal").unwrap().pixels {
            let normal = *normal * 2.0 - Vec3::ONE;
            assert!((normal - Vec3::new(s as f32, c as f32, 0.0)).length() < 1e-6, "{normal}");
        }
    }
}
