//! Turns NaN, infinities, denormals and the largest numbers, in every field that takes a number, into refusals or light.

use crate::rooms::{Lit, build, options};
use glam::Vec3;
use photonstream_renderer::{Vsl, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::Scene;
use photonstream_shading::{Kernel, Light, LightShape, tone};
use std::sync::Arc;

/// A small scene in which each number stands between the marks `<` and `>`.
const TEXT: &str = "[camera]\nposition_m = [<0>, <1>, <4>]\ntarget_m = [0, <0.5>, 0]\nup = [0, <1>, 0]\nvertical_fov_deg = <40>\n\
[material.a]\nalbedo = [<0.5>, 0.3, 0.1]\n\
[object.floor]\nmaterial = \"a\"\nquad = { corner_m = [<-1>, 0, 1], edge_u_m = [<2>, 0, 0], edge_v_m = [0, 0, <-2>] }\n\
[object.body]\nmaterial = \"a\"\nposition_m = [0, <0.3>, 0]\nrotation_deg = [<10>, 0, 0]\nscale = [<1>, 1, 1]\nbox = { size_m = [<0.2>, 0.2, 0.2], centre_m = [<0>, 0, 0] }\n\
[object.ball]\nmaterial = \"a\"\nposition_m = [0.5, 0.5, 0]\nsphere = { radius_m = <0.2>, segments = 8 }\n\
[light.bulb]\npower_w = [<5>, 1, 1]\npoint = { position_m = [<0.5>, 1.5, 0.5] }\n\
[light.panel]\npower_w = <3>\nrectangle = { corner_m = [<-0.2>, 1.8, 0.2], edge_u_m = [0, 0, <-0.4>], edge_v_m = [<0.4>, 0, 0], albedo = <0.1> }\n\
[light.spot]\npower_w = 2\nspot = { position_m = [0, <1.5>, 0], direction = [0, <-1>, <0.2>], outer_half_angle_deg = <30>, inner_half_angle_deg = <20> }\n\
[light.sun]\nirradiance_w_m2 = <2>\ndirectional = { direction = [<0.3>, -1, 0] }\n\
[streaming]\nvsls = 20\npool_paths = 256\nplacement_scale = <0.9>\npublish_period_ms = <10.0>\ntarget_error = <0.0>\nlatency_ms = <0.0>\n\
[render]\nepsilon = <1e-6>\nexposure_ev = <0.0>\n";

/// What is put in the place of each number, one by one: not numbers; numbers that f64 holds and f32 does not; denormals of
/// f64 and f32; the smallest and largest of f32; negative zero.
const ODD: [&str; 15] = [
    "nan", "inf", "-inf", "1e308", "-1e308", "4.9e-324", "1e-310", "1e-46", "1e-40", "-1e-40", "1.2e-38",
    "3.4e38", "1e9", "1e-9", "-0.0",
];

/// Every number of a scene becomes each of 15 odd ones, 37 × 15 scenes: refused with file, line and field, or lit and
/// rendered with nothing but finite light that is not negative. Exact; one NaN that got through would spread to every
/// virtual light by way of the sums of a pixel.
#[test]
fn odd_numbers_in_a_config_are_refused_or_harmless() {
    let numbers = TEXT.matches('<').count();
    let (mut refused, mut lit) = (0, 0);
    for index in 0..numbers {
        for odd in ODD {
            let mut parts = TEXT.split('<');
            let mut text = parts.next().unwrap().to_owned();
            for (i, part) in parts.enumerate() {
                let (number, rest) = part.split_once('>').unwrap();
                text += if i == index { odd } else { number };
                text += rest;
            }
            match build(&text) {
                Err(error) => {
                    let error = error.to_string();
                    assert!(error.starts_with("test.toml:"), "number {index}, {odd}: {error}");
                    refused += 1;
                }
                Ok(scene) => {
                    assert!(!odd.contains('n'), "number {index}: {odd} was taken");
                    let light = Lit::new(&Arc::new(scene));
                    light.assert_sane();
                    light.picture(6);
                    lit += 1;
                }
            }
        }
    }
    println!("{numbers} numbers, {refused} refused, {lit} lit");
    assert!(refused >= 3 * numbers && lit > 2 * numbers, "{refused} refused, {lit} lit");
}

/// Each field of a published light becomes each odd number of f32: refused, or a picture without a bad pixel, with every
/// kernel. A renderer takes these from memory that another process writes.
#[test]
fn odd_numbers_in_published_lights_are_refused_or_harmless() {
    let scene = build(&TEXT.replace(['<', '>'], "")).unwrap();
    let good = Vsl {
        position: Vec3::new(0.2, 1.0, 0.1),
        normal: Vec3::NEG_Y,
        flux: Vec3::ONE,
        area: 0.1,
        object: 0,
    };
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
        -f32::from_bits(1),
        1e-40,
        1e9,
        1e15,
        -0.0,
    ];
    let (mut refused, mut drawn) = (0, 0);
    for value in odd {
        let v = Vec3::new(0.0, value, 0.0);
        for light in [
            Vsl { position: good.position + v, ..good },
            Vsl { normal: good.normal + v, ..good },
            Vsl { flux: v, ..good },
            Vsl { area: value, ..good },
        ] {
            let Ok(vsls) = VslSet::new([light, good]) else {
                refused += 1;
                continue;
            };
            assert!(value.is_finite());
            // Without a range, and with one that lights draw by lot.
            for (kernel, epsilon) in Kernel::ALL.into_iter().flat_map(|k| [(k, 0.0), (k, 1e-3)]) {
                let options = photonstream_renderer::RenderOptions { kernel, epsilon, ..options(&scene, 6) };
                let Ok(rendered) = render(&scene, &vsls, &options, Watch::default()) else { continue };
                rendered.film.check_finite().unwrap();
                let full = &rendered.film.layer("full").unwrap().pixels;
                assert!(full.iter().all(|p| p.min_element() >= 0.0));
            }
            drawn += 1;
        }
    }
    assert!(refused >= 12 && drawn >= 16, "{refused} refused, {drawn} drawn");
}

/// Edits of a running scene by f32 values: NaN, infinite and negative ones are refused by the field's name, denormals are
/// taken and light nothing.
#[test]
fn odd_numbers_in_edits_are_refused_or_harmless() {
    let scene = build(&TEXT.replace(['<', '>'], "")).unwrap();
    let id = scene.light("bulb").unwrap();
    let edit = |scene: &Scene, x: f32, power: f32| {
        let shape = LightShape::Point { position: Vec3::new(x, 1.5, 0.0) };
        scene.with_light(id, Light { shape, power: Vec3::splat(power) })
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -f32::from_bits(1)] {
        let error = edit(&scene, 0.0, bad).unwrap_err().to_string();
        assert!(error.contains("light.bulb.power"), "{error}");
        if !bad.is_finite() {
            let error = edit(&scene, bad, 1.0).unwrap_err().to_string();
            assert!(error.contains("light.bulb.position"), "{error}");
        }
    }
    for tiny in [f32::MIN_POSITIVE, 1e-40, f32::from_bits(1)] {
        let lit = Lit::new(&Arc::new(edit(&scene, tiny, tiny).unwrap()));
        lit.assert_sane();
        lit.picture(6);
    }
}

/// Tone maps of anything: a PNG has a colour for every radiance, infinite and undefined ones included.
#[test]
fn tone_maps_take_every_number() {
    for bits in (0..=u32::MAX).step_by(65_521) {
        let value = f32::from_bits(bits);
        for map in tone::ToneMap::ALL {
            let mapped = map.apply(Vec3::splat(value), 0.0);
            if value >= 0.0 && value.is_finite() {
                assert!((0.0..=1.0).contains(&mapped.x), "{map:?} of {value}: {mapped}");
            }
        }
    }
}
