//! Turns lights of extreme powers, colours, angles and places into light of known amount.

use crate::rooms::{Lit, closed_box, figure, mean, pixels, scene};
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, Vsl, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::Visibility;
use photonstream_shading::Kernel;
use photonstream_simulator::simulation::Simulation;
use std::{f64::consts::PI, sync::Arc};

const STREAMING: &str = "vsls = 100\npool_paths = 16384\nseed = 6";

/// Lamps of 10⁻⁹ W and 10⁹ W in one room. With columns of their own each is as exact as alone: the small one's light, read
/// with the large one off, is P ρ/(1 − ρ); the large one's too; and switching moves no path. Deposits in watts and f32
/// would lose the small one 11 digits below the last.
///
/// N = 32 768 paths, of which each light has at least 1/32; ρ = 0.5, seed 6: 5 σ of the fewest, 1 024 paths: σ = √2/√N of P.
/// In one shared column its paths would be rounded to nothing: that is what `light_columns` says, and 10⁻¹⁸ of the light.
#[test]
fn a_nanowatt_beside_a_gigawatt() {
    let room = |columns: u32| {
        let lamps = "power_w = 1e9\npoint = { position_m = [0.3, 0.2, -0.7] }\n\
                     [light.small]\npower_w = 1e-9\npoint = { position_m = [-0.3, 0.1, 0.7] }";
        closed_box(0.5, lamps, &format!("vsls = 60\npool_paths = 32768\nseed = 6\nlight_columns = {columns}"))
    };
    let both = room(8);
    let lit = Lit::new(&both);
    let sigma = (2.0f64 / 1024.0).sqrt();
    figure("1 GW beside 1 nW", lit.total()[0] / 1e9 - 1.0, 5.0 * sigma);
    for (off, power) in [("lamp", 1e-9), ("small", 1e9)] {
        let id = both.light(off).unwrap();
        let mut dark = both.lights[id.0 as usize].light.clone();
        dark.power = Vec3::ZERO;
        let one = Arc::new(both.with_light(id, dark).unwrap());
        let readings = lit.ledger.readings(&one);
        let total: f64 = readings.map(|r| f64::from(r.flux.x)).sum();
        figure(&format!("{power:e} W with {off} off"), total / power - 1.0, 5.0 * sigma);
    }
    let shared = Lit::new(&room(1));
    shared.assert_sane();
    figure("1 GW beside 1 nW in one column", shared.total()[0] / 1e9 - 1.0, 5.0 * sigma);
}

/// A lamp without green, and a wall without red: exactly 0 in those channels everywhere, though survival is decided by the
/// largest albedo; and blue as if it were alone. Survival by the colour of the light would divide by 0 here.
#[test]
fn channels_without_light_are_exactly_dark() {
    let text = |albedo: &str| {
        scene(&format!(
            "[camera]\nposition_m = [0.9, 0.4, 1.4]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 60\n\
             [material.wall]\nalbedo = {albedo}\n\
             [object.room]\nmaterial = \"wall\"\nsides = \"back\"\nbox = {{ size_m = [2, 1, 3] }}\n\
             [light.lamp]\npower_w = [5, 0, 10]\npoint = {{ position_m = [0.3, 0.2, -0.7] }}\n[streaming]\n{STREAMING}\n"
        ))
    };
    let lit = Lit::new(&text("[0.0, 0.9, 0.9]"));
    let [red, green, blue] = lit.total();
    assert_eq!((red, green), (0.0, 0.0));
    assert_eq!(blue, Lit::new(&text("0.9")).total()[2]);
    let rendered = lit.picture(12);
    assert!(pixels(&rendered, "full").iter().all(|p| p.x == 0.0 && p.y == 0.0 && p.z > 0.0));
    // All power in the channel that nothing reflects: paths are traced, and leave exactly nothing.
    let dark = Lit::new(
        &text("[0.9, 0.9, 0.0]")
            .with_light(
                photonstream_scene::LightId(0),
                photonstream_shading::Light { power: Vec3::Z, ..text("0.9").lights[0].light.clone() },
            )
            .map(Arc::new)
            .unwrap(),
    );
    assert_eq!(dark.total(), [0.0; 3]);
    dark.assert_sane();
}

/// Spots of 0.1° and 180°, hard and soft: in a closed room all of them give P ρ/(1 − ρ). A narrow cone by 1 − cos θ in f32
/// would have 1.5 · 10⁻⁶ with an ulp of 6 · 10⁻⁸: 4 % of its power wrong; versines are exact.
///
/// N = 16 384, ρ = 0.8, seed 6: 4.5 σ.
#[test]
fn spots_from_a_tenth_of_a_degree_to_all_around() {
    for (outer, inner) in
        [(0.05, 0.05), (0.05, 0.0), (0.01, 0.009), (90.0, 90.0), (180.0, 180.0), (180.0, 0.0)]
    {
        let spot = format!(
            "power_w = 10\nspot = {{ position_m = [0.3, 0.2, -0.7], direction = [2, -3, 6], \
             outer_half_angle_deg = {outer}, inner_half_angle_deg = {inner} }}"
        );
        let lit = Lit::new(&closed_box(0.8, &spot, STREAMING));
        lit.assert_sane();
        figure(&format!("spot of {outer}° to {inner}°, σ"), (lit.total()[0] - 40.0) / lit.sigma(), 4.5);
    }
}

/// The disc that a spot of 0.1° (full angle) draws on a wall: P/(2 π (1 − cos)) /r² within, nothing without, by direct light.
///
/// 64 × 64 pixels over 20 mm, spot 10 m away: the disc's radius is 8.727 mm. Irradiance 1 % (versines near 4 · 10⁻⁷ from
/// f32 directions: an ulp of a direction is 10⁻⁴ of the cone's radius), its area 3 % (pixels of 1/28 of its radius).
#[test]
fn a_narrow_spot_draws_its_disc() {
    let scene = scene(
        "[camera]\nposition_m = [0.3, 0, 0.1]\ntarget_m = [0.3, 0, 0]\nvertical_fov_deg = 11.421186\n\
         [material.a]\nalbedo = 1\n\
         [object.wall]\nmaterial = \"a\"\nquad = { corner_m = [-1, -1, 0], edge_u_m = [2, 0, 0], edge_v_m = [0, 2, 0] }\n\
         [light.lamp]\npower_w = 1\nspot = { position_m = [0.3, 0, 10], direction = [0, 0, -1], outer_half_angle_deg = 0.05, inner_half_angle_deg = 0.05 }\n\
         [streaming]\nvsls = 10\npool_paths = 1000\n",
    );
    let lit = Lit::new(&scene);
    let rendered = lit.picture(64);
    let lit_pixels: Vec<f64> =
        pixels(&rendered, "direct").iter().filter(|p| p.x > 0.0).map(|p| f64::from(p.x)).collect();
    let half_angle = 0.05f64.to_radians();
    let exact = 1.0 / (2.0 * PI * 2.0 * (half_angle / 2.0).sin().powi(2)) / 100.0 / PI;
    let worst = lit_pixels.iter().map(|p| (p / exact - 1.0).abs()).fold(0.0, f64::max);
    figure("spot of 0.1°, radiance", worst, 0.01);
    let area = lit_pixels.len() as f64 / (64.0 * 64.0) * 0.02 * 0.02;
    figure("spot of 0.1°, area", area / (PI * (10.0 * half_angle.tan()).powi(2)) - 1.0, 0.03);
}

/// Grazing light: a sun 0.006° above the horizon over a floor of 4 m². Its irradiance is E cos θ with cos θ = 10⁻⁴, directly to
/// 10⁻⁴ (the direction is f32: 6 · 10⁻⁸ of 10⁻⁴ is 0.06 %), and as flux ρ E cos θ A. Below the horizon: exactly nothing.
///
/// N = 2²⁰ paths over the scene's sphere, of which 10⁻⁴ · A/(π R²) hit, some 60: 4.5 σ of their number (60 ± 8).
#[test]
fn grazing_sun() {
    let text = |height: f64| {
        scene(&format!(
            "[camera]\nposition_m = [0, 3, 0]\ntarget_m = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 30\n\
             [material.a]\nalbedo = 0.5\n\
             [object.floor]\nmaterial = \"a\"\nquad = {{ corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }}\n\
             [light.sun]\nirradiance_w_m2 = 1000\ndirectional = {{ direction = [1, {}, 0] }}\n\
             [streaming]\nvsls = 10\npool_paths = 1048576\n",
            -height
        ))
    };
    let lit = Lit::new(&text(1e-4));
    lit.assert_sane();
    let direct = mean(pixels(&lit.picture(16), "direct"));
    figure("grazing sun, direct", direct / (0.5 / PI * 1000.0 * 1e-4) - 1.0, 1e-3);
    let share = 1e-4 * 4.0 / (PI * f64::from(lit.simulation.scene.bounds.radius).powi(2));
    let found = lit.total()[0] / (0.5 * 1000.0 * 1e-4 * 4.0);
    figure("grazing sun, flux", found - 1.0, 4.5 / (share * 1_048_576.0).sqrt());
    for height in [0.0, -1e-4] {
        let dark = Simulation::new(text(height));
        let lit = Lit { ledger: dark.ledger(), simulation: dark };
        assert!(pixels(&lit.picture(16), "direct").iter().all(|p| *p == Vec3::ZERO), "{height}");
    }
}

/// A virtual light in the very point that a pixel sees, a hair above it, and in its plane: finite, never negative, with
/// `disc` at most ρ Φ/(π A), with and without shadow rays. `paper` may be large there, as paper A's is; not infinite.
#[test]
fn a_virtual_light_at_the_receiver() {
    let scene = scene(
        "origin_m = [0, 0, 0]\n[camera]\nposition_m = [0, 1, 0]\ntarget_m = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 1\n\
         [material.a]\nalbedo = 0.5\n\
         [object.floor]\nmaterial = \"a\"\nquad = { corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }\n\
         [light.lamp]\npower_w = 0\npoint = { position_m = [0, 1, 0] }\n",
    );
    let bound = 0.5 * 3.0 / (PI as f32 * 0.01);
    let mut largest = 0.0f64;
    for height in [0.0, 1e-38, 1e-20, 1e-9, 1e-6, 1e-3, 1e-2] {
        for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X] {
            let light =
                Vsl { position: Vec3::Y * height, normal, flux: Vec3::splat(3.0), area: 0.01, object: 0 };
            let vsls = VslSet::new([light]).unwrap();
            for kernel in [Kernel::Paper, Kernel::Disc] {
                for visibility in [Visibility::None, Visibility::Rays] {
                    let options = RenderOptions {
                        width: 5,
                        height: 5,
                        kernel,
                        visibility,
                        epsilon: 0.0,
                        layers: vec![LayerKind::Indirect],
                        ..RenderOptions::from_settings(&scene.render)
                    };
                    let film = render(&scene, &vsls, &options, Watch::default()).unwrap().film;
                    film.check_finite().unwrap();
                    let brightest =
                        film.layers()[0].pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max);
                    assert!(film.layers()[0].pixels.iter().all(|p| p.min_element() >= 0.0));
                    if kernel == Kernel::Disc {
                        largest = largest.max(f64::from(brightest / bound));
                    }
                }
            }
        }
    }
    figure("light at the receiver, of its bound", largest, 1.0 + 1e-6);
    assert!(largest > 0.5, "no light near enough to come to its bound");
}
