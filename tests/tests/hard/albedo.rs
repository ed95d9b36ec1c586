//! Turns reflectances up to 1 into light: white furnaces, of which the answer is known.

use crate::rooms::{Lit, closed_box, figure, mean, pixels, scene};
use photonstream_scene::Visibility;
use photonstream_shading::Kernel;
use photonstream_simulator::tracer::MAX_SURVIVAL;
use std::f64::consts::PI;

const BULB: &str = "power_w = 40\npoint = { position_m = [0.3, 0.2, -0.7] }";

/// In a closed room all deposits sum to P ρ/(1 − ρ), as far as 999 P at ρ = 0.999.
///
/// N = 16 384 and 8 192 paths (8.2 million rays), seed 5; 4.5 σ of independent paths: of ten such tests one in 15 000 fails,
/// and the seed is fixed. Without survival by the albedo itself (a survival of 0.95, say, with the weight passed on) the
/// weights would grow and pass the largest deposit; without exact sums 10⁶ deposits of 1 on one light would be rounded.
#[test]
fn furnaces_up_to_0_999() {
    for (rho, paths) in [(0.5, 16_384), (0.99, 16_384), (0.999, 8_192)] {
        let lit = Lit::new(&closed_box(rho, BULB, &format!("vsls = 50\npool_paths = {paths}\nseed = 5")));
        let exact = 40.0 * rho / (1.0 - rho);
        figure(&format!("furnace of {rho}, σ"), (lit.total()[0] - exact) / lit.sigma(), 4.5);
        let counters = lit.counters();
        // The longest of 8 192 paths has about 9 000 points at 0.999: those beyond 8 192 are cut, and told.
        let cut = 0.999f64.powi(8192) * f64::from(paths);
        assert!(counters.truncated as f64 <= 10.0 * cut + if rho > 0.99 { 20.0 } else { 0.0 });
        assert_eq!(counters.escaped + counters.rejected + counters.absorbed_back, 0);
    }
}

/// A closed room that reflects everything has no steady state. It is neither refused nor endless: a path's weight grows by
/// 1/0.999 a bounce and the path is cut when it passes 4, after 1 386 bounces, which 0.999^1386 = 1/4 of all paths reach.
/// So the light is that of 1 386 bounces, and the cut paths are counted, so that whoever looks sees what is lost.
///
/// N = 4 096 paths, seed 3: 4.5 σ of the share (binomial) and of the flux. Without the cut the simulator would hang at the
/// first such room; without the count the loss would be silent.
#[test]
fn a_closed_room_of_albedo_1_is_cut_and_the_loss_told() {
    let lit = Lit::new(&closed_box(1.0, BULB, "vsls = 50\npool_paths = 4096\nseed = 3"));
    let bounces = (4f64.ln() / -f64::from(MAX_SURVIVAL).ln()).floor();
    let share = f64::from(MAX_SURVIVAL).powf(bounces + 1.0);
    let found = lit.counters().truncated as f64 / 4096.0;
    figure("share cut at ρ = 1, σ", (found - share) / (share * (1.0 - share) / 4096.0).sqrt(), 4.5);
    let exact = 40.0 * (bounces + 1.0);
    figure("flux at ρ = 1, σ", (lit.total()[0] - exact) / lit.sigma(), 4.5);
    lit.assert_sane();
    lit.picture(16);
}

/// The picture of a furnace: with the lamp in the middle of a sphere the light is the same everywhere,
/// L = P ρ/(4 π² R² (1 − ρ)), direct and indirect together, for dark and for white walls.
///
/// 24 × 24 pixels, 2 000 VSLs, 16 384 paths, seed 1, kernel `paper`: on a sphere its sum is exact, whatever the VSLs' places.
/// Facets of 64 segments take up to 0.25 % off R², which indirect light sees twice; noise 1/√(N(1−ρ)) of the total: 4 σ.
/// A kernel or a cosine that is wrong by 2 % anywhere shows as a bright or dark furnace.
#[test]
fn the_picture_of_a_furnace_is_of_one_brightness() {
    for rho in [0.2f64, 0.5, 0.9, 0.99] {
        let scene = scene(&format!(
            "[camera]\nposition_m = [0.3, 0.2, -0.1]\ntarget_m = [-0.4, 0.1, 0.3]\nvertical_fov_deg = 100\n\
             [material.a]\nalbedo = {rho}\n\
             [object.shell]\nmaterial = \"a\"\nsides = \"back\"\nsphere = {{ radius_m = 1, segments = 64 }}\n\
             [light.lamp]\npower_w = 10\npoint = {{ position_m = [0, 0, 0] }}\n\
             [streaming]\nvsls = 2000\npool_paths = 16384\n"
        ));
        let lit = Lit::new(&scene);
        let rendered = lit.picture_with(24, Kernel::Paper, Visibility::None, 0.0);
        let exact = 10.0 * rho / (4.0 * PI * PI * (1.0 - rho));
        let noise = lit.sigma() / lit.total()[0] * rho;
        let found = mean(pixels(&rendered, "full")) / exact - 1.0;
        figure(&format!("picture of a furnace of {rho}"), found, 0.015 + 4.0 * noise);
    }
}
