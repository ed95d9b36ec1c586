//! Turns things of very different sizes in one scene into light: a millimetre in a kilometre, a floor beyond a lamp's reach.

use crate::rooms::{Lit, figure, mean, pixels, scene};
use photonstream_scene::{Scene, Visibility};
use photonstream_shading::Kernel;
use std::{f64::consts::PI, sync::Arc};

/// A hall of 1 km with a white tile of 1 mm, 10 m above its floor and `east` m from its middle, under a lamp 10 mm above it;
/// the camera looks at the tile from beside the lamp, and sees nothing else.
fn hall(east: f64) -> Arc<Scene> {
    scene(&format!(
        "origin_m = [0, 0, 0]\n\
         [camera]\nposition_m = [{}, 10.002, 0]\ntarget_m = [{east}, 10, 0]\nup = [0, 0, 1]\nvertical_fov_deg = 4\n\
         [material.black]\nalbedo = 0\n[material.white]\nalbedo = 0.8\n\
         [object.hall]\nmaterial = \"black\"\nsides = \"back\"\nposition_m = [0, 500, 0]\nbox = {{ size_m = [1000, 1000, 1000] }}\n\
         [object.tile]\nmaterial = \"white\"\n\
         quad = {{ corner_m = [{}, 10, 0.0005], edge_u_m = [0.001, 0, 0], edge_v_m = [0, 0, -0.001] }}\n\
         [light.lamp]\npower_w = 1\npoint = {{ position_m = [{east}, 10.01, 0] }}\n\
         [streaming]\nvsls = 60\npool_paths = 262144\n",
        east + 0.0004,
        east - 0.0005,
    ))
}

/// A tile of 1 mm in a hall of 1 km has the light that it should have: directly P/(4 π h²) at its middle, and
/// as its flux ρ P times the share of directions that meet it (a square of side s at height h: its solid angle over 4 π).
///
/// Direct light at the middle: 0.5 % (the picture is 0.14 mm wide; f32 is 1 µm apart at 10 m, of 10 mm twice). Flux:
/// N = 262 144 paths, of which some 208 hit: 4.5 σ (binomial; stratified samples scatter less). At 400 m from the origin f32
/// is 31 µm apart, and so are corners and lamp: 1.5 % of the distance, and 6 % of the tile: both limits grow by that.
/// Rays start 2⁻¹⁸ of the largest coordinate off their surface, 1.5 mm there: light computed from where they start would be
/// 39 % too bright, as it was (and 0.8 % at 10 m). With an epsilon of 10⁻⁶ of the scene all rays would start beside the tile.
#[test]
fn a_millimetre_in_a_kilometre() {
    for (east, of_position, of_size) in [(0.0, 0.005, 0.005), (400.0, 0.02, 0.07)] {
        let lit = Lit::new(&hall(east));
        lit.assert_sane();
        let direct = mean(pixels(&lit.picture(8), "direct"));
        let exact = 0.8 / PI / (4.0 * PI * 0.01 * 0.01);
        figure(&format!("tile at {east} m, direct"), direct / exact - 1.0, of_position);
        let (s, h) = (0.0005f64, 0.01f64);
        let solid_angle = 4.0 * (s * s / (h * (2.0 * s * s + h * h).sqrt())).atan();
        let share = solid_angle / (4.0 * PI);
        let sigma = (share / 262_144.0).sqrt();
        let found = lit.total()[0] / 0.8;
        figure(&format!("tile at {east} m, flux"), found / share - 1.0, 4.5 * sigma / share + of_size);
    }
}

/// A floor of 10 km under a lamp of 1 W: with ε = 10⁻⁹ most pixels are beyond the reach of every virtual light. They are
/// exactly black, those near are not, and what is lost is at most what the picture states.
///
/// 24 × 24 pixels over the floor, a block above it so that there is light to receive, 100 VSLs; no tolerance but 10⁻⁶ of
/// rounding. A range without a statement would be darkness that nobody sees.
#[test]
fn a_floor_beyond_the_reach_of_its_lamp() {
    let scene = scene(
        "[camera]\nposition_m = [0, 3000, 0.1]\ntarget_m = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 70\n\
         [material.a]\nalbedo = 0.8\n\
         [object.floor]\nmaterial = \"a\"\nquad = { corner_m = [-5000, 0, 5000], edge_u_m = [10000, 0, 0], edge_v_m = [0, 0, -10000] }\n\
         [object.block]\nmaterial = \"a\"\nposition_m = [400, 100, 0]\nbox = { size_m = [200, 200, 200] }\n\
         [light.lamp]\npower_w = 1\npoint = { position_m = [0, 100, 0] }\n[streaming]\nvsls = 100\npool_paths = 8192\n",
    );
    let lit = Lit::new(&scene);
    let whole = lit.picture_with(24, Kernel::Disc, Visibility::None, 0.0);
    let cut = lit.picture_with(24, Kernel::Disc, Visibility::None, 1e-9);
    let dark = |r| pixels(r, "indirect").iter().filter(|p| p.x == 0.0).count();
    assert!(dark(&cut) > dark(&whole) && dark(&cut) < 24 * 24, "{} {}", dark(&cut), dark(&whole));
    let lost = mean(pixels(&whole, "indirect")) / mean(pixels(&cut, "indirect")) - 1.0;
    assert_eq!(whole.stats.range_loss_share, 0.0);
    assert!(lost > 0.0, "the range should cost something");
    figure("loss by range, of what is stated", lost, cut.stats.range_loss_share + 1e-6);
    // So large an ε that nothing is left: the loss has no bound, and is not told as none.
    let nothing = lit.picture_with(24, Kernel::Disc, Visibility::Rays, 1e-3);
    assert_eq!(dark(&nothing), 24 * 24);
    assert_eq!(nothing.stats.range_loss_share, f64::INFINITY);
}
