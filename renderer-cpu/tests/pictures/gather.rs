//! Turns single virtual surface lights into pictures and compares them with the sum done by hand.
#![allow(clippy::unwrap_used)]

use crate::scenes::{NO_LIGHT, cornell, floor, on_floor, options, scattered_vsls};
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, Vsl, VslSet, Watch};
use photonstream_renderer_cpu::{InstructionSet, render, render_with};
use photonstream_scene::{RangeCulling, Visibility};
use photonstream_shading::Kernel;
use std::f64::consts::PI;

const LAMP: Vsl = Vsl {
    position: Vec3::new(0.3, 0.7, -0.2),
    normal: Vec3::new(0.6, -0.8, 0.0),
    flux: Vec3::new(2.0, 3.0, 4.0),
    area: 0.05,
    object: 0,
};

/// One light over a floor, both kernels: L = ρ/π Φ cos cos_s / (π r² + A), in f64. Tolerance 1e-5: about thirty f32
/// roundings of terms that do not cancel.
#[test]
fn one_light_is_the_sum_by_hand() {
    let scene = floor(NO_LIGHT);
    let vsls = VslSet::new([LAMP]).unwrap();
    for (kernel, area) in [(Kernel::Paper, 0.0), (Kernel::Disc, 0.05)] {
        for visibility in [Visibility::None, Visibility::Rays] {
            let mut options = options(50, 37, &[LayerKind::Full, LayerKind::Indirect]);
            (options.kernel, options.visibility) = (kernel, visibility);
            let film = render(&scene, &vsls, &options, Watch::default()).unwrap().film;
            let pixels = &film.layer("full").unwrap().pixels;
            let mut lit = 0;
            for (i, p) in pixels.iter().enumerate() {
                let d = (LAMP.position - on_floor(&scene, i, 50, 37)).as_dvec3();
                let (r_sq, r) = (d.length_squared(), d.length());
                let cos_s = -LAMP.normal.as_dvec3().dot(d) / r;
                let k = (d.y / r) * cos_s.max(0.0) / (PI * r_sq + area);
                for (found, flux, albedo) in [(p.x, 2.0, 0.8), (p.y, 3.0, 0.4), (p.z, 4.0, 0.2)] {
                    let expected = albedo / PI * flux * k;
                    let error = (f64::from(found) - expected).abs();
                    // Beside the light's own plane cos_s is a difference of rounded numbers.
                    assert!(error < 1e-5 * expected + 1e-6, "{kernel} {i}: {found} against {expected}");
                }
                lit += u32::from(k > 0.0);
            }
            assert!(
                lit > 1000 && lit < 50 * 37,
                "{lit} pixels lit: the light's plane should cross the picture"
            );
            assert_eq!(pixels, &film.layer("indirect").unwrap().pixels);
        }
    }
}

/// A square of 0.5 m half way between a light 2 m up and the floor shades the central square metre.
#[test]
fn an_occluder_shades_exactly_its_projection() {
    let plate = "[object.plate]\nmaterial = \"grey\"\nsides = \"both\"\n\
                 quad = { corner_m = [-0.25, 1, 0.25], edge_u_m = [0.5, 0, 0], edge_v_m = [0, 0, -0.5] }\n";
    let scene = floor(&format!("{plate}{NO_LIGHT}"));
    let lamp = Vsl { position: Vec3::Y * 2.0, normal: Vec3::NEG_Y, ..LAMP };
    let vsls = VslSet::new([lamp]).unwrap();
    let mut options = options(64, 48, &[LayerKind::Indirect]);
    let open = render(&scene, &vsls, &options, Watch::default()).unwrap().film;
    options.visibility = Visibility::Rays;
    let shadowed = render(&scene, &vsls, &options, Watch::default()).unwrap();
    assert!(shadowed.stats.vsl_rays == 64 * 48);
    for (i, (with, without)) in
        shadowed.film.layers()[0].pixels.iter().zip(&open.layers()[0].pixels).enumerate()
    {
        let p = on_floor(&scene, i, 64, 48);
        let reach = p.x.abs().max(p.z.abs());
        assert!(without.min_element() > 0.0);
        // The shadow's edge, up to the 2e-5 m by which rays start off their surfaces.
        if reach < 0.4999 {
            assert_eq!(*with, Vec3::ZERO, "{p}");
        } else if reach > 0.5001 {
            assert_eq!(with, without, "{p}");
        }
    }
}

/// Only modelled sides reflect, and light does not pass to the other side.
#[test]
fn sides_are_separate() {
    for (sides, y, expected) in [
        ("front", 0.5, true),
        ("front", -0.5, false),
        ("both", 0.5, true),
        ("both", -0.5, true),
        ("back", 0.5, false),
        ("back", -0.5, true),
    ] {
        let mut scene = floor(&format!(
            "[object.shelf]\nmaterial = \"grey\"\nsides = \"{sides}\"\n\
             quad = {{ corner_m = [-1, 1, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }}\n{NO_LIGHT}"
        ));
        let eye = Vec3::Y * (1.0 + y);
        scene.camera = photonstream_shading::Camera::look_at(eye, Vec3::Y, Vec3::X, 50.0).unwrap();
        for light_side in [1.0f32, -1.0] {
            let lamp = Vsl {
                position: Vec3::Y * (1.0 + 0.3 * light_side),
                normal: Vec3::NEG_Y * light_side,
                ..LAMP
            };
            let vsls = VslSet::new([lamp]).unwrap();
            for visibility in [Visibility::None, Visibility::Rays] {
                let mut options = options(16, 16, &[LayerKind::Indirect]);
                options.visibility = visibility;
                let film = render(&scene, &vsls, &options, Watch::default()).unwrap().film;
                let lit = film.layers()[0].pixels.iter().all(|p| p.min_element() > 0.0);
                let dark = film.layers()[0].pixels.iter().all(|p| *p == Vec3::ZERO);
                let should = expected && light_side == y.signum();
                assert!(lit == should && dark != should, "{sides}, seen from {y}, lit from {light_side}");
            }
        }
    }
}

/// Every instruction set and every number of threads gives the same bits; the picture's size is no multiple of any
/// lane count or tile. 300 lights: more than one block of the loop. The range of ε = 1e-3 ends within tiles.
#[test]
fn instruction_sets_and_threads_give_the_same_picture() {
    let scene = cornell();
    let vsls = scattered_vsls(&scene, 300);
    let (cut, by_lot) = (RangeCulling::Cut, RangeCulling::Stochastic);
    for (epsilon, culling) in [(0.0, cut), (1e-3, cut), (1e-3, by_lot)] {
        for kernel in Kernel::ALL {
            let mut options = options(101, 67, &[LayerKind::Indirect]);
            (options.epsilon, options.culling, options.kernel) = (epsilon, culling, kernel);
            let render = |options: &RenderOptions, set| {
                render_with(&scene, &vsls, options, Watch::default(), set).unwrap()
            };
            let best = render(&options, InstructionSet::Detected);
            for set in [InstructionSet::Avx2, InstructionSet::Portable] {
                let other = render(&options, set);
                assert_eq!(other.film, best.film, "{set:?}");
                let (a, b) = (other.stats.range_loss_share, best.stats.range_loss_share);
                // The lanes' bounds are summed in another order.
                assert!((a - b).abs() <= 1e-5 * a, "{a} against {b}");
                assert_eq!(a > 0.0, epsilon > 0.0 && culling == cut);
                assert_eq!(other.stats.range_error > 0.0, culling == by_lot);
            }
            for threads in [1, 2, 3] {
                options.threads = Some(threads);
                let other = render(&options, InstructionSet::Detected);
                assert_eq!(other.film, best.film, "{threads} threads");
                assert_eq!(other.stats.range_loss_share, best.stats.range_loss_share);
                assert_eq!(other.stats.range_error, best.stats.range_error);
            }
        }
    }
}

/// What the range leaves out is at most what is reported, and the report is no gross exaggeration: a bound without
/// cosines, at most 20 times the loss here.
#[test]
fn the_loss_of_the_range_is_bounded_by_its_report() {
    let scene = cornell();
    let vsls = scattered_vsls(&scene, 200);
    for visibility in [Visibility::None, Visibility::Rays] {
        let mut options = options(60, 45, &[LayerKind::Indirect]);
        (options.visibility, options.culling) = (visibility, RangeCulling::Cut);
        let whole = render(&scene, &vsls, &options, Watch::default()).unwrap();
        assert_eq!(whole.stats.range_loss_share, 0.0);
        let total = |film: &photonstream_film::Film| -> f64 {
            film.layers()[0].pixels.iter().map(|p| f64::from(p.max_element())).sum()
        };
        let mut last = 0.0;
        for epsilon in [1e-4, 3e-4, 1e-3] {
            options.epsilon = epsilon;
            let cut = render(&scene, &vsls, &options, Watch::default()).unwrap();
            let loss = total(&whole.film) / total(&cut.film) - 1.0;
            let stated = cut.stats.range_loss_share;
            assert!(loss >= last && loss <= stated + 1e-6, "ε {epsilon}: lost {loss}, stated {stated}");
            last = loss;
        }
        assert!(last > 0.01, "the largest ε should cost something: {last}");
    }
}

/// More samples per pixel average stratified points: edges soften, the mean stays. N = 16 per pixel, seed 1. The
/// means agree within 2 %: 500 pixels lie on edges of the room, each uncertain by up to its own value.
#[test]
fn samples_soften_edges_and_keep_the_mean() {
    let scene = cornell();
    let vsls = scattered_vsls(&scene, 50);
    let mut options = options(80, 60, &[LayerKind::Full, LayerKind::Albedo]);
    let one = render(&scene, &vsls, &options, Watch::default()).unwrap().film;
    options.samples_per_pixel = 16;
    let many = render(&scene, &vsls, &options, Watch::default()).unwrap();
    assert_eq!(many.stats.camera_rays, 16 * 80 * 60);
    for layer in ["full", "albedo"] {
        let (a, b) = (
            crate::scenes::mean(&one.layer(layer).unwrap().pixels),
            crate::scenes::mean(&many.film.layer(layer).unwrap().pixels),
        );
        assert!((a / b - 1.0).abs() < 0.02, "{layer}: {a} against {b}");
    }
    let distinct = |film: &photonstream_film::Film| {
        let mut values: Vec<u32> =
            film.layer("albedo").unwrap().pixels.iter().map(|p| p.x.to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        values.len()
    };
    assert!(distinct(&many.film) > distinct(&one), "no pixel mixes two materials");
}
