//! Photon streaming against closed forms: energy in closed scenes, and the uniform light in a sphere.
#![allow(clippy::unwrap_used)]

use crate::support::{closed_box, closed_sphere, filled};
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_shading::{Kernel, surface};
use photonstream_simulator::{flux::QUANTUM, ledger::Ledger, simulation::Simulation};

const POWER: f32 = 40.0;
const STREAMING: &str = "vsls = 300\npool_paths = 65536\nseed = 5";

/// Sum of all flux, W, first channel, and its standard error from the variance between paths.
fn total_flux(simulation: &Simulation, ledger: &Ledger) -> (f64, f64) {
    let total: f64 = ledger.readings(&simulation.scene).map(|r| f64::from(r.flux.x)).sum();
    let pool = ledger.pool();
    let n = f64::from(pool.slots());
    let sums: Vec<f64> = (0..pool.slots())
        .map(|slot| pool.path(slot).unwrap().iter().map(|d| f64::from(d.rgb[0])).sum::<f64>() * QUANTUM)
        .collect();
    let mean = sums.iter().sum::<f64>() / n;
    let variance = sums.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (n - 1.0);
    (total, f64::from(POWER) * (variance / n).sqrt())
}

/// Σ deposits = P ρ/(1 - ρ). N = 65 536 paths, seed 5; 4 σ of independent paths (stratified ones scatter less), and the
/// quantum of the sums.
fn energy(scene: impl Fn(f32) -> Scene) {
    for rho in [0.0f32, 0.1, 0.5, 0.9, 0.99] {
        let (simulation, ledger) = filled(scene(rho));
        let (total, sigma) = total_flux(&simulation, &ledger);
        let rho = f64::from(rho);
        let exact = f64::from(POWER) * rho / (1.0 - rho);
        let tolerance = 4.0 * sigma + 1e-6 * exact;
        assert!(
            (total - exact).abs() <= tolerance,
            "ρ = {rho}: {total} W, exactly {exact}, tolerance {tolerance}"
        );
        let counters = ledger.counters();
        assert_eq!(
            (counters.escaped, counters.rejected, counters.truncated, counters.absorbed_back),
            (0, 0, 0, 0)
        );
        assert_eq!(counters.paths, 65_536);
    }
}

#[test]
fn energy_in_a_closed_box() {
    energy(|rho| closed_box(rho, POWER, STREAMING));
}

#[test]
fn energy_in_a_closed_sphere() {
    energy(|rho| closed_sphere(rho, POWER, 0.4, STREAMING));
}

/// In a diffuse sphere the light by reflection is the same everywhere: P ρ/(4 π R² (1 - ρ)).
///
/// The sum over VSLs at 500 receivers on facets, kernel `paper`: N = 65 536 paths, 4 000 VSLs. On the true sphere every
/// pair transfers 1/(4 π R²); facets of 96 segments lower R² by 0.1 %, and bend pairs within a facet's size of each other,
/// which hold r²/(4 R²) of the light: the mean is held to 1 % + 4 σ, each receiver to 6 %.
#[test]
fn light_in_a_sphere_is_uniform_wherever_the_light_stands() {
    let rho = 0.5f32;
    for x in [0.0, 0.35, 0.8] {
        let scene = closed_sphere(rho, POWER, x, "vsls = 4000\npool_paths = 65536\nseed = 5");
        let (simulation, ledger) = filled(scene);
        let (_, sigma) = total_flux(&simulation, &ledger);
        let geometry = &simulation.scene.geometry;
        let vsls: Vec<(Vec3, Vec3, f32)> = simulation
            .placement
            .vsls
            .iter()
            .zip(ledger.readings(&simulation.scene))
            .map(|(vsl, reading)| (vsl.position_ws(geometry), vsl.normal_ws(geometry), reading.flux.x))
            .collect();
        let exact = POWER * rho / (4.0 * std::f32::consts::PI * (1.0 - rho));
        let receivers = (0..geometry.triangles.len() as u32).step_by(geometry.triangles.len() / 500);
        let (mut sum, mut count) = (0.0, 0.0);
        for triangle in receivers {
            let at = surface::point(geometry.triangle(triangle), 0.3, 0.3);
            let normal = -geometry.normals[triangle as usize];
            let irradiance: f32 =
                vsls.iter().map(|&(p, n, flux)| flux * Kernel::Paper.transfer(p - at, normal, n, 0.0)).sum();
            assert!(
                (irradiance / exact - 1.0).abs() < 0.06,
                "light at {x}: {irradiance} at {at}, exactly {exact}"
            );
            sum += irradiance;
            count += 1.0;
        }
        let tolerance = 0.01 * exact + 4.0 * sigma as f32 / (4.0 * std::f32::consts::PI);
        assert!(
            (sum / count - exact).abs() < tolerance,
            "light at {x}: mean {}, exactly {exact}",
            sum / count
        );
    }
}

/// Light passes from room to room through no wall: every VSL that faces the dark room holds exactly nothing.
#[test]
fn the_dark_room_is_exactly_dark() {
    let scene = crate::support::config("two-rooms.toml", |c| c.streaming.pool_paths = Some(1 << 16));
    let (simulation, ledger) = filled(scene);
    let (mut dark, mut lit) = (0, 0.0);
    for (vsl, reading) in simulation.placement.vsls.iter().zip(ledger.readings(&simulation.scene)) {
        let geometry = &simulation.scene.geometry;
        let inside = vsl.position_ws(geometry) + vsl.normal_ws(geometry) * 0.01;
        if f64::from(inside.x) + simulation.scene.origin_m.x > 0.0 {
            assert_eq!(reading.flux, Vec3::ZERO, "{vsl:?}");
            dark += 1;
        } else {
            lit += reading.flux.x;
        }
    }
    assert!(dark > 100 && lit > 10.0, "{dark} lights in the dark room, {lit} W in the other");
    assert_eq!(ledger.counters().escaped, 0);
}

/// Without light, or with nothing to hit, nothing is traced, and nothing fails.
#[test]
fn nothing_to_do_is_done_at_once() {
    let dark = crate::support::scene(
        "[material.a]\nalbedo = 0.5\n[object.a]\nmaterial = \"a\"\nbox = { size_m = [1, 1, 1] }",
    );
    let (simulation, ledger) = filled(dark);
    assert!(ledger.is_converged());
    assert!(ledger.readings(&simulation.scene).all(|r| r.flux == Vec3::ZERO));
}

/// Lights of no power give exactly nothing, in a column of their own and in a shared one, though their slots are filled.
#[test]
fn no_power_is_exactly_no_flux() {
    for columns in [1, 8] {
        let lights: String = (0..3)
            .map(|i| format!("[light.l{i}]\npower_w = 0\npoint = {{ position_m = [0.{i}, 0, 0.1] }}\n"))
            .collect();
        let (simulation, ledger) = filled(crate::support::scene(&format!(
            "[material.a]\nalbedo = 0.5\n[object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
             {lights}[streaming]\nvsls = 50\npool_paths = 3000\nlight_columns = {columns}\n"
        )));
        assert_eq!(ledger.counters().paths, 3000);
        assert!(ledger.readings(&simulation.scene).all(|r| r.flux == Vec3::ZERO && r.standard_error == 0.0));
    }
}
