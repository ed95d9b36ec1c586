//! Turns meshes that no modeller meant (intersecting, open, inside out, self-touching, doubled, sheared) into light.

use crate::rooms::{CAMERA, Lit, build, figure, pixels, scene};
use glam::{DAffine3, DMat3, DVec3};
use photonstream_scene::{Scene, Side};
use std::{fmt::Write, sync::Arc};

const LAMP: &str = "[light.lamp]\npower_w = 10\npoint = { position_m = [0.1, 0.2, 0.3] }\n";
const STREAMING: &str = "[streaming]\nvsls = 100\npool_paths = 16384\nseed = 4\n";

/// The corners and faces of a box from `low` to `high` as OBJ, looking outwards; `first` vertices come before.
fn cuboid(low: [f64; 3], high: [f64; 3], first: usize) -> String {
    let mut obj = String::new();
    for i in 0..8 {
        let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        writeln!(obj, "v {} {} {}", pick(0), pick(1), pick(2)).unwrap();
    }
    for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        let [a, b, c, d] = face.map(|i| i + first);
        writeln!(obj, "f {a} {b} {c} {d}").unwrap();
    }
    obj
}

/// A scene of one imported mesh around the lamp.
fn of_mesh(obj: &str, albedo: f64, sides: &str) -> Arc<Scene> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    std::fs::write(&path, obj).unwrap();
    scene(&format!(
        "{CAMERA}[material.a]\nalbedo = {albedo}\n\
         [object.mesh]\nmaterial = \"a\"\nsides = \"{sides}\"\nobj = {{ path = {path:?} }}\n{LAMP}{STREAMING}"
    ))
}

/// A closed room keeps P ρ/(1 − ρ): 16 384 paths, seed 4, 4.5 σ.
fn assert_furnace(case: &str, lit: &Lit, rho: f64) {
    let exact = 10.0 * rho / (1.0 - rho);
    figure(&format!("{case}, σ"), (lit.total()[0] - exact) / lit.sigma(), 4.5);
    let counters = lit.counters();
    assert_eq!((counters.escaped, counters.rejected, counters.truncated), (0, 0, 0), "{case}: {counters:?}");
}

/// Every triangle twice and three times over, in one object: a hit belongs to one of them alone, deposits count once, and
/// rays that leave one do not hit its twin. Were ties not given to the lowest number, paths would stick between twins.
#[test]
fn a_room_of_doubled_walls_keeps_its_energy() {
    let (low, high) = ([-1.0, -0.5, -1.5], [1.0, 0.5, 1.5]);
    for copies in [1, 2, 3] {
        let obj: String = (0..copies).map(|i| cuboid(low, high, i * 8)).collect();
        for sides in ["back", "both"] {
            let lit = Lit::new(&of_mesh(&obj, 0.8, sides));
            assert_furnace(&format!("{copies} × each wall, {sides}"), &lit, 0.8);
            lit.picture(8);
        }
    }
}

/// Rooms that touch along a wall, an edge and at a corner, with the lamp in one of them. As objects of their own no light gets
/// into the other: exactly none. As one mesh light passes by ownership, not by rays: a hit belongs to the nearest virtual
/// light of the same object and orientation, which may stand beyond the wall. It ends within the reach of a cell.
///
/// Of two walls in one plane the one with the lower number is hit. Two-sided, the energy is kept; one-sided, the other room's
/// wall may stand in the way with a side that does not reflect: what it takes is counted, and nothing gets through.
///
/// 100 lights on 48 m², 0.7 m apart: twice that, √A of their own cell, is the limit. Rays that leaked through the shared edge
/// would light the other room throughout.
#[test]
fn rooms_that_touch_do_not_share_light() {
    for (case, centre) in [("wall", [2.0, 0.0, 0.0]), ("edge", [2.0, 2.0, 0.0]), ("corner", [2.0, 2.0, 2.0])]
    {
        for sides in ["both", "back"] {
            let room = format!("material = \"a\"\nsides = \"{sides}\"\nbox = {{ size_m = [2, 2, 2]");
            let apart = scene(&format!(
                "{CAMERA}[material.a]\nalbedo = 0.8\n[object.lit]\n{room} }}\n\
                 [object.dark]\n{room}, centre_m = {centre:?} }}\n{LAMP}{STREAMING}"
            ));
            let lit = Lit::new(&apart);
            if case == "wall" && sides == "back" {
                assert!(lit.counters().absorbed_back > 1000);
                assert_eq!(lit.counters().escaped, 0);
            } else {
                assert_furnace(&format!("rooms touch at a {case}, {sides}"), &lit, 0.8);
            }
            let dark = apart.object("dark").unwrap();
            for (vsl, reading) in lit.simulation.placement.vsls.iter().zip(lit.ledger.readings(&apart)) {
                let is_within = vsl.surface.object == dark && vsl.surface.side == Side::Back;
                assert!(!is_within || reading.flux == glam::Vec3::ZERO, "{case}, {sides}");
            }
        }
        let inner = cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], 0);
        let outer = cuboid(centre.map(|x| x - 1.0), centre.map(|x| x + 1.0), 8);
        let one = of_mesh(&format!("{inner}{outer}"), 0.8, "back");
        let lit = Lit::new(&one);
        let (mut leaked, mut farthest) = (0.0, 0.0f64);
        for (vsl, reading) in lit.simulation.placement.vsls.iter().zip(lit.ledger.readings(&one)) {
            let at = vsl.position_ws(&one.geometry).as_dvec3() + one.origin_m;
            let beyond = at.abs().max_element() - 1.0;
            if beyond > 1e-3 && reading.flux.x > 0.0 {
                leaked += f64::from(reading.flux.x);
                farthest = farthest.max(beyond / f64::from(vsl.area).sqrt());
            }
        }
        println!(
            "one mesh, {case}: {:.1} % of the flux stands in the other room",
            100.0 * leaked / lit.total()[0]
        );
        figure(&format!("one mesh, {case}, reach in cells"), farthest, 2.0);
    }
}

/// Boxes that run through each other, seen from without: outside of both the faces within reflect nothing that leaves, and
/// with the lamp inside both the union is a closed room for rays that meet fronts from behind. Two-sided, energy is kept in
/// the common part; nothing escapes through the lines of intersection, which have no vertices.
#[test]
fn boxes_that_intersect_keep_light_where_it_is() {
    let obj =
        cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], 0) + &cuboid([-0.5, -2.0, -0.6], [2.0, 0.7, 0.9], 8);
    let lit = Lit::new(&of_mesh(&obj, 0.8, "both"));
    assert_furnace("intersecting boxes", &lit, 0.8);
    lit.picture(8);
}

/// A box without its lid: what escapes is counted, and every path ends in one of the counted ways. ρ = 0.5: flux is below
/// that of the closed box, and above ρ P times the walls' share of all directions.
#[test]
fn an_open_box_counts_what_escapes() {
    let closed = cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], 0);
    let open = closed.lines().filter(|line| *line != "f 3 7 8 4").collect::<Vec<_>>().join("\n");
    let lit = Lit::new(&of_mesh(&open, 0.5, "back"));
    let counters = lit.counters();
    assert!(counters.escaped > 1000, "{counters:?}");
    assert_eq!(
        (counters.paths, counters.absorbed_back, counters.rejected, counters.truncated),
        (16_384, 0, 0, 0)
    );
    assert!(lit.total()[0] < 10.0 && lit.total()[0] > 0.5 * 10.0 * 0.6, "{:?}", lit.total());
    assert_eq!(lit.simulation.scene.features.open_edges, 4);
}

/// A room turned inside out by its winding: its reflecting sides look away from the lamp, all light is absorbed by backs
/// and counted there, and the picture is exactly black. A renderer that turned normals towards the viewer would light it.
#[test]
fn a_room_inside_out_absorbs_and_says_so() {
    let lit = Lit::new(&of_mesh(&cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], 0), 0.8, "front"));
    assert_eq!(lit.counters().absorbed_back, 16_384);
    assert_eq!(lit.total(), [0.0; 3]);
    assert!(pixels(&lit.picture(8), "full").iter().all(|p| *p == glam::Vec3::ZERO));
}

/// A mesh of one triangle, of needles of 1 : 10⁷ among it, and of nothing but points: lit, lit and refused.
///
/// A two-sided triangle of 1 m² with the lamp above has ρ P times its share of directions: the sum of both sides' flux
/// is that of its lit side. 16 384 paths, 4.5 σ.
#[test]
fn one_triangle_is_a_scene_and_none_is_not() {
    let one = "v -1 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n";
    let lit = Lit::new(&of_mesh(one, 0.5, "both"));
    let [a, b, c] =
        lit.simulation.scene.geometry.triangle(0).map(|v| v.as_dvec3() + lit.simulation.scene.origin_m);
    let lamp = DVec3::new(0.1, 0.2, 0.3);
    let [a, b, c] = [a, b, c].map(|v| (v - lamp).normalize());
    // Van Oosterom & Strackee 1983.
    let solid_angle = 2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    let exact = 0.5 * 10.0 * solid_angle / (4.0 * std::f64::consts::PI);
    figure("one triangle, σ", (lit.total()[0] - exact) / lit.sigma(), 4.5);
    let needles = format!("{one}v 0 0.5 0\nv 1 0.5 0\nv 1 0.5 1e-7\nf 4 5 6\nf 4 6 5\nf 1 1 2\nf 1 4 4\n");
    let lit = Lit::new(&of_mesh(&needles, 0.5, "both"));
    assert_eq!(lit.simulation.scene.geometry.triangles.len(), 3);
    lit.assert_sane();
    lit.picture(8);
}

/// Mirrored shapes, by one, two and three negative factors, keep their fronts outside: a room keeps its energy.
/// Zero is refused with its place, by files and by edits; so are shears, which no config can say.
#[test]
fn mirrored_rooms_are_rooms_and_sheared_ones_are_refused() {
    let text = |scale: &str| {
        format!(
            "{CAMERA}[material.a]\nalbedo = 0.8\n[object.room]\nmaterial = \"a\"\nsides = \"back\"\nscale = {scale}\n\
             rotation_deg = [20, 30, 40]\nbox = {{ size_m = [2, 2, 3] }}\n{LAMP}{STREAMING}"
        )
    };
    for scale in ["[-1, 1, 1]", "[-1, -2, 1]", "[-1, -1, -1]", "-0.8"] {
        assert_furnace(&format!("room × {scale}"), &Lit::new(&scene(&text(scale))), 0.8);
    }
    for scale in ["0", "[1, 0, 1]", "[1, 1, -0.0]", "1e-10", "1e-310"] {
        let error = build(&text(scale)).unwrap_err().to_string();
        assert!(error.contains("object.room.scale: found") && error.contains("test.toml:"), "{error}");
    }
    let room = scene(&text("1"));
    let id = room.object("room").unwrap();
    for map in [
        DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z),
        DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::ZERO),
        DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z),
        DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::Z * f64::INFINITY),
    ] {
        let map = DAffine3 { matrix3: map, translation: DVec3::ZERO };
        let error = room.with_object_placed(id, map).unwrap_err().to_string();
        assert!(error.contains("orthogonal axes"), "{error}");
    }
}
