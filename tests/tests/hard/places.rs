//! Turns one scene at many places and sizes into one picture.

use crate::rooms::{Lit, figure, pixels, scene};
use photonstream_evaluation::compare;
use photonstream_scene::Scene;
use std::sync::Arc;

/// A corner with a ball and a spot, `scale` times as large and moved by `shift` m along each axis; power by the square of the
/// scale, so that radiance stays.
fn corner(scale: f64, shift: f64) -> Arc<Scene> {
    let at = |v: [f64; 3]| format!("{:?}", v.map(|x| x * scale + shift));
    let by = |v: [f64; 3]| format!("{:?}", v.map(|x| x * scale));
    scene(&format!(
        "[camera]\nposition_m = {}\ntarget_m = {}\nvertical_fov_deg = 40\n\
         [material.white]\nalbedo = 0.7\n[material.red]\nalbedo = [0.6, 0.1, 0.1]\n\
         [object.floor]\nmaterial = \"white\"\nquad = {{ corner_m = {}, edge_u_m = {}, edge_v_m = {} }}\n\
         [object.wall]\nmaterial = \"red\"\nquad = {{ corner_m = {}, edge_u_m = {}, edge_v_m = {} }}\n\
         [object.ball]\nmaterial = \"white\"\nposition_m = {}\nsphere = {{ radius_m = {}, segments = 16 }}\n\
         [light.lamp]\npower_w = {}\nspot = {{ position_m = {}, target_m = {}, outer_half_angle_deg = 60 }}\n\
         [streaming]\nvsls = 150\npool_paths = 16384\n",
        at([0.0, 1.0, 4.0]),
        at([0.0, 1.0, 0.0]),
        at([-1.0, 0.0, 1.0]),
        by([2.0, 0.0, 0.0]),
        by([0.0, 0.0, -2.0]),
        at([-1.0, 0.0, 1.0]),
        by([0.0, 0.0, -2.0]),
        by([0.0, 2.0, 0.0]),
        at([0.3, 0.5, 0.0]),
        0.4 * scale,
        50.0 * scale * scale,
        at([0.5, 1.9, 0.5]),
        at([-0.3, 0.0, 0.0]),
    ))
}

/// The largest relative RMSE of any layer against the scene at its origin, in metres.
fn difference(scale: f64, shift: f64) -> f64 {
    let film = |scale, shift| {
        let lit = Lit::new(&corner(scale, shift));
        lit.assert_sane();
        let rendered = lit.picture(48);
        assert!(pixels(&rendered, "full").iter().any(|p| p.x > 0.5));
        rendered.film
    };
    let (plain, other) = (film(1.0, 0.0), film(scale, shift));
    let error = |layer| compare(&other, &plain, layer).unwrap().whole.rel_rmse;
    ["direct", "indirect", "full"].map(error).into_iter().fold(0.0, f64::max)
}

/// A scene 10⁴, 10⁵ and 10⁶ m from its coordinates' origin: positions are kept relative to the scene's own, taken off in f64.
/// f32 coordinates would be 0.06 m apart at 10⁶ m, and the ball a cube.
///
/// 16 384 paths with the same samples, 48 × 48 pixels: what is left is the rounding of the config's own decimal numbers
/// (10⁻¹⁰ m) and of paths that pass an edge on the other side: relative RMSE < 10⁻³.
#[test]
fn far_from_the_origin() {
    for shift in [1e4, -1e5, 1e6] {
        figure(&format!("scene at {shift:e} m"), difference(1.0, shift), 1e-3);
    }
}

/// Sizes 10⁻⁴ to 10⁴, some of them far away, too: offsets of rays are relative to triangles, and nothing has a length of its
/// own. An epsilon of 10⁻⁴ m would be as large as the smallest scene, and too small for the largest.
///
/// As above; 10⁻⁴ at 10⁴ m stands 10⁸ of its sizes away, where f64 has 10⁻⁸ of its size left: relative RMSE < 10⁻³.
#[test]
fn from_a_tenth_of_a_millimetre_to_ten_kilometres() {
    for (scale, shift) in [(1e-4, 0.0), (1e-2, 0.0), (1e2, 0.0), (1e4, 0.0), (1e-4, 1e4), (1e4, 1e6)] {
        figure(&format!("scene × {scale:e} at {shift:e} m"), difference(scale, shift), 1e-3);
    }
}
