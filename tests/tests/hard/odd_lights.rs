//! Turns lights where none should stand (on, in, behind and just above surfaces), and lights that see nothing, into light.

use crate::rooms::{CAMERA, Lit, closed_box, figure, pixels, scene};
use glam::Vec3;
use std::f64::consts::PI;

/// A lamp 1 m to 10⁻⁶ m above a floor: the floor has ρ P times its share of all directions, in the limit one half.
///
/// N = 65 536, 4.5 σ (binomial, seed 2). At 10⁻⁶ m f32 coordinates of 1 m are 10⁻⁷ apart; a test of rays with a t_min of
/// 10⁻⁵ would pass through the floor, and half of the light would be lost.
#[test]
fn a_lamp_just_above_a_floor() {
    for height in [1.0, 1e-3, 1e-5, 1e-6] {
        let scene = scene(&format!(
            "{CAMERA}[material.a]\nalbedo = 0.5\n\
             [object.floor]\nmaterial = \"a\"\nquad = {{ corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }}\n\
             [light.lamp]\npower_w = 10\npoint = {{ position_m = [0.2, {height}, 0.3] }}\n\
             [streaming]\nvsls = 50\npool_paths = 65536\nseed = 2\n"
        ));
        let lit = Lit::new(&scene);
        // The solid angle of the four rectangles that meet below the lamp.
        let quarter = |a: f64, b: f64| (a * b / (height * (a * a + b * b + height * height).sqrt())).atan();
        let share: f64 =
            [0.8, 1.2].iter().flat_map(|&a| [0.7, 1.3].map(|b| quarter(a, b))).sum::<f64>() / (4.0 * PI);
        let sigma = (share * (1.0 - share) / 65_536.0).sqrt();
        figure(&format!("lamp {height:e} m above a floor, σ"), (lit.total()[0] / 5.0 - share) / sigma, 4.5);
        let rendered = lit.picture(16);
        assert!(pixels(&rendered, "direct").iter().any(|p| p.x > 0.0));
    }
}

/// Lamps in a wall's plane, in an edge and in a corner of a closed room: rounding decides on which side they are, but all of
/// the light is in one counted place: reflected, absorbed by backs, or escaped; nothing is lost, nothing is not finite.
#[test]
fn a_lamp_on_a_wall_an_edge_a_corner() {
    for at in ["[1.0, 0.1, 0.2]", "[1.0, 0.5, 0.2]", "[1.0, 0.5, 1.5]", "[-1.0, -0.5, -1.5]"] {
        let lamp = format!("power_w = 10\npoint = {{ position_m = {at} }}");
        let lit = Lit::new(&closed_box(0.5, &lamp, "vsls = 50\npool_paths = 8192"));
        lit.assert_sane();
        let counters = lit.counters();
        assert!(counters.escaped + counters.absorbed_back <= 8192, "{at}: {counters:?}");
        // First reflections of what stays inside, and no more than P ρ/(1 − ρ) = 10 W and 5 σ of 1.6 %.
        assert!(lit.total()[0] <= 10.0 * (1.0 + 5.0 * (2.0f64 / 8192.0).sqrt()), "{at}");
        lit.picture(8);
    }
}

/// Lights that see nothing: above a roof, within a solid body, a spot at the sky, an emitter against a wall, a lamp of no
/// power. Exactly no flux, no NaN in its error, every path counted, and a picture without indirect light.
#[test]
fn lights_that_see_nothing() {
    let floor = "[material.a]\nalbedo = 0.5\n\
         [object.floor]\nmaterial = \"a\"\nquad = { corner_m = [-1, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }\n\
         [object.body]\nmaterial = \"a\"\nposition_m = [0.5, 0.3, 0]\nbox = { size_m = [0.2, 0.2, 0.2] }\n";
    for (case, light) in [
        ("below a floor", "power_w = 10\npoint = { position_m = [0, -1, 0] }"),
        ("in a body", "power_w = 10\npoint = { position_m = [0.5, 0.3, 0] }"),
        (
            "at the sky",
            "power_w = 10\nspot = { position_m = [0, 1, 0], direction = [0, 1, 0], outer_half_angle_deg = 30 }",
        ),
        ("from below", "irradiance_w_m2 = 10\ndirectional = { direction = [0, 1, 0] }"),
        ("of no power", "power_w = 0\npoint = { position_m = [0, 1, 0] }"),
    ] {
        // The body would see what comes from below.
        let floor = if case == "from below" { floor.split("[object.body]").next().unwrap() } else { floor };
        let text =
            format!("{CAMERA}{floor}[light.lamp]\n{light}\n[streaming]\nvsls = 40\npool_paths = 4096\n");
        let lit = Lit::new(&scene(&text));
        lit.assert_sane();
        assert_eq!(lit.total(), [0.0; 3], "{case}");
        let counters = lit.counters();
        if case != "of no power" {
            assert_eq!(counters.escaped + counters.absorbed_back, 4096, "{case}: {counters:?}");
            assert_eq!(lit.ledger.relative_error(), 0.0);
        }
        assert!(pixels(&lit.picture(8), "indirect").iter().all(|p| *p == Vec3::ZERO), "{case}");
    }
}

/// As many lights as objects, one light, fewer lights than objects, and no light at all: each object has at least one,
/// their areas are the objects', energy is kept with the fewest, and a scene without lights rests.
#[test]
fn one_virtual_light_and_none() {
    for vsls in [1, 2, 3, 7] {
        let text = format!(
            "{CAMERA}[material.a]\nalbedo = 0.8\n\
             [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 3] }}\n\
             [object.a]\nmaterial = \"a\"\nposition_m = [0.6, 0, 0]\nsphere = {{ radius_m = 0.2, segments = 8 }}\n\
             [object.b]\nmaterial = \"a\"\nposition_m = [-0.6, 0, 0]\nbox = {{ size_m = [0.2, 0.3, 0.4] }}\n\
             [light.lamp]\npower_w = 10\npoint = {{ position_m = [0, 0.5, 0] }}\n\
             [streaming]\nvsls = {vsls}\npool_paths = 16384\nseed = 3\n"
        );
        let lit = Lit::new(&scene(&text));
        assert_eq!(lit.simulation.placement.vsls.len(), vsls.max(3));
        figure(&format!("{vsls} virtual lights, σ"), (lit.total()[0] - 40.0) / lit.sigma(), 4.5);
        lit.picture(8);
    }
    let dark = format!(
        "{CAMERA}[material.a]\nalbedo = 0.8\n[object.a]\nmaterial = \"a\"\nsphere = {{ radius_m = 0.2, segments = 8 }}\n"
    );
    let lit = Lit::new(&scene(&dark));
    assert!(lit.ledger.is_done());
    assert!(pixels(&lit.picture(8), "full").iter().all(|p| *p == Vec3::ZERO));
}
