//! Turns skies over scenes of known light into the flux of virtual surface lights, and compares the two.
#![allow(clippy::unwrap_used)]

use crate::support::{filled, scene};
use photonstream_scene::SceneConfig;
use photonstream_simulator::{flux::QUANTUM, ledger::Ledger, simulation::Simulation};
use std::{f64::consts::PI, path::Path};

/// Sum of all flux, W, first channel, and its standard error from the variance between paths.
fn total(simulation: &Simulation, ledger: &Ledger) -> (f64, f64) {
    let sum = ledger.readings(&simulation.scene).map(|r| f64::from(r.flux.x)).sum();
    let pool = ledger.pool();
    let n = f64::from(pool.slots());
    let sums: Vec<f64> = (0..pool.slots())
        .map(|slot| pool.path(slot).unwrap().iter().map(|d| f64::from(d.rgb[0])).sum::<f64>() * QUANTUM)
        .collect();
    let mean = sums.iter().sum::<f64>() / n;
    let variance = sums.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (n - 1.0);
    let light = &simulation.scene.lights[0].light;
    let watts = f64::from(light.power.x * light.shape.watts_per_power(simulation.scene.bounds));
    (sum, watts * (variance / n).sqrt())
}

/// What is lit: its albedo, and what its light does.
fn lit(object: &str, albedo: f64, sky: &str) -> (f64, f64, (Simulation, Ledger)) {
    let scene = scene(&format!(
        "[material.a]\nalbedo = {albedo}\n[object.body]\nmaterial = \"a\"\n{object}\n[light.sky]\nsky = {{ {sky} }}\n\
         [streaming]\nvsls = 64\npool_paths = 65536\nseed = 3\n"
    ));
    let (simulation, ledger) = filled(scene);
    assert_eq!(ledger.counters().rejected + ledger.counters().truncated, 0);
    let (sum, sigma) = total(&simulation, &ledger);
    (sum, sigma, (simulation, ledger))
}

/// A plane receives π L per area from a constant sky, π (h/3 + 2z/3) from a gradient above, and reflects its albedo's
/// share. N = 65 536 paths from a disc around the plane's sphere, of which a third or so hit it; 4 σ of independent paths,
/// which bound that of stratified ones.
#[test]
fn a_plane_under_a_sky_receives_its_irradiance() {
    let plane = "quad = { corner_m = [0, 0, 0], edge_u_m = [0, 0, 3], edge_v_m = [2, 0, 0] }";
    for (sky, irradiance) in [
        ("radiance_w_m2_sr = 2", 2.0 * PI),
        ("radiance_w_m2_sr = 2, scale = 3", 6.0 * PI),
        ("zenith_w_m2_sr = [2, 0, 1], horizon_w_m2_sr = [5, 1, 0]", PI * (5.0 / 3.0 + 4.0 / 3.0)),
        ("zenith_w_m2_sr = 0, horizon_w_m2_sr = 0, ground_w_m2_sr = 7", 0.0),
    ] {
        let (sum, sigma, _) = lit(plane, 0.6, sky);
        let expected = 0.6 * 6.0 * irradiance;
        assert!((sum - expected).abs() <= 4.0 * sigma, "{sky}: {sum} W, expected {expected}, σ {sigma}");
        assert!(sigma < 0.01 * expected || expected == 0.0, "{sigma}");
    }
}

/// A convex body of albedo ρ under a constant sky leaves ρ π L of every area: nothing that leaves it comes back, and in the
/// furnace ρ = 1 it is as bright as the sky. N = 65 536; 4 σ, and for the sphere its own mesh's area.
#[test]
fn convex_bodies_in_a_furnace_are_as_bright_as_the_sky() {
    for (object, area) in
        [("box = { size_m = [1, 2, 0.5] }", 7.0), ("sphere = { radius_m = 0.5, segments = 64 }", PI)]
    {
        for albedo in [0.5, 1.0] {
            let (sum, sigma, (simulation, ledger)) = lit(object, albedo, "radiance_w_m2_sr = 2");
            let meshed: f64 = (0..simulation.scene.geometry.triangles.len() as u32)
                .map(|t| photonstream_shading::surface::area(simulation.scene.geometry.triangle(t)))
                .sum();
            assert!((meshed / area - 1.0).abs() < 0.005);
            let expected = albedo * PI * 2.0 * meshed;
            assert!(
                (sum - expected).abs() <= 4.0 * sigma,
                "{object}, ρ = {albedo}: {sum}, {expected}, σ {sigma}"
            );
            assert!(sigma < 0.01 * expected);
            let pool = ledger.pool();
            assert!((0..pool.slots()).all(|slot| pool.path(slot).unwrap().len() <= 1), "nothing comes back");
        }
    }
}

/// Black walls take their form factor of the light of a constant sky: of a unit floor one unit wall at its edge sees
/// 0.200044, and a box of four leaves the opening's 0.199825 (Howell's catalogue, C-14 and C-11). N = 262 144; 4 σ.
#[test]
fn walls_take_their_form_factor_of_the_sky() {
    let walls = [
        "[0, 0, 0], edge_u_m = [0, 1, 0], edge_v_m = [0, 0, 1]",
        "[1, 0, 0], edge_u_m = [0, 1, 0], edge_v_m = [0, 0, 1]",
        "[0, 0, 0], edge_u_m = [0, 1, 0], edge_v_m = [1, 0, 0]",
        "[0, 0, 1], edge_u_m = [0, 1, 0], edge_v_m = [1, 0, 0]",
    ];
    for (count, open) in [(0, 1.0), (1, 1.0 - 0.200_044), (4, 0.199_825)] {
        let wall = |(i, wall): (usize, &&str)| {
            format!("[object.w{i}]\nmaterial = \"black\"\nsides = \"both\"\nquad = {{ corner_m = {wall} }}\n")
        };
        let walls: String = walls[..count].iter().enumerate().map(wall).collect();
        let (simulation, ledger) = filled(scene(&format!(
            "[material.a]\nalbedo = 0.5\n[material.black]\nalbedo = 0\n[object.floor]\nmaterial = \"a\"\n\
             quad = {{ corner_m = [0, 0, 0], edge_u_m = [0, 0, 1], edge_v_m = [1, 0, 0] }}\n{walls}\
             [light.sky]\nsky = {{ radiance_w_m2_sr = 1 }}\n[streaming]\nvsls = 64\npool_paths = 262144\nseed = 3\n"
        )));
        let (sum, sigma) = total(&simulation, &ledger);
        let expected = 0.5 * PI * open;
        assert!(
            (sum - expected).abs() <= 4.0 * sigma,
            "{count} walls: {sum} W, expected {expected}, σ {sigma}"
        );
        assert!(sigma < 0.02 * expected, "{sigma}");
    }
}

/// Dimming needs no ray: flux of another scale is that of the config with that scale, bit for bit, from the same paths.
#[test]
fn a_sky_is_dimmed_by_its_column() {
    let text = |scale: &str| {
        format!(
            "[camera]\nposition_m = [0, 1, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
             [material.a]\nalbedo = 0.6\n[object.floor]\nmaterial = \"a\"\n\
             quad = {{ corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }}\n\
             [light.sky]\nsky = {{ zenith_w_m2_sr = [1, 2, 4], horizon_w_m2_sr = 3, scale = {scale} }}\n\
             [streaming]\nvsls = 20\npool_paths = 4096\n"
        )
    };
    let build = |scale| SceneConfig::from_text(&text(scale), Path::new("sky.toml")).unwrap().build().unwrap();
    let (simulation, ledger) = filled(build("1"));
    let before: Vec<_> = ledger.readings(&simulation.scene).collect();
    let mut edit = simulation.scene.edit();
    let values = [("scale".to_owned(), serde_json::json!([0.5, 1.0, 2.0]))].into_iter().collect();
    edit.set_light("sky", &values).unwrap();
    let dimmed = edit.finish();
    assert_eq!(dimmed.lights, build("[0.5, 1, 2]").lights);
    let after: Vec<_> = ledger.readings(&dimmed).collect();
    assert!(before.iter().any(|r| r.flux.x > 0.0));
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(before.flux * glam::Vec3::new(0.5, 1.0, 2.0), after.flux);
    }
}
