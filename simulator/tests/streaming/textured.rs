//! Deposits on textured surfaces, and photons that pass through their holes.
#![allow(clippy::unwrap_used)]

use crate::support::{filled, scene};
use glam::Vec3;
use image::{Rgba, RgbaImage};
use photonstream_scene::Scene;
use std::path::Path;

/// A square of 4 m under a sun of 10 W m⁻², whose picture is black in its left half and white in its right, or with `holes`
/// has a hole there; below it a grey floor of 40 m. `vsls` lights.
fn lit_square(folder: &Path, holes: bool, vsls: u32) -> Scene {
    let picture = RgbaImage::from_fn(64, 64, |x, _| match x < 32 {
        true => Rgba([0, 0, 0, if holes { 0 } else { 255 }]),
        false => Rgba([255, 255, 255, 255]),
    });
    picture.save(folder.join("half.png")).unwrap();
    let mask = if holes { "map_d half.png\n" } else { "" };
    let mtl = format!("newmtl half\nKd 0.8 0.4 0.2\nmap_Kd -clamp on half.png\n{mask}");
    std::fs::write(folder.join("square.mtl"), mtl).unwrap();
    let obj = "mtllib square.mtl\nusemtl half\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.join("square.obj"), obj).unwrap();
    scene(&format!(
        "[material.grey]\nalbedo = 0.5\n\
         [object.floor]\nmaterial = \"grey\"\nquad = {{ corner_m = [-20, -1, 20], edge_u_m = [40, 0, 0], edge_v_m = [0, 0, -40] }}\n\
         [object.square]\nobj = {{ path = {:?} }}\n\
         [light.sun]\nirradiance_w_m2 = 10\ndirectional = {{ direction = [0, -1, 0] }}\n\
         [streaming]\nvsls = {vsls}\npool_paths = 1048576\nseed = 7\n",
        folder.join("square.obj").to_str().unwrap()
    ))
}

/// Flux on the left and on the right half of the square, and on the floor below the left half, W; and the number of lights
/// of the square.
fn fluxes(scene: Scene) -> ([Vec3; 3], usize) {
    let (simulation, ledger) = filled(scene);
    let geometry = &simulation.scene.geometry;
    let square = simulation.scene.object("square/unnamed_object/half").unwrap();
    let mut sums = [Vec3::ZERO; 3];
    let mut count = 0;
    for (vsl, reading) in simulation.placement.vsls.iter().zip(ledger.readings(&simulation.scene)) {
        let position = vsl.position_ws(geometry) + simulation.scene.origin_m.as_vec3();
        if geometry.object_of[vsl.triangle as usize] == square {
            count += 1;
            sums[usize::from(position.x > 0.0)] += reading.flux;
        } else {
            sums[2] += reading.flux;
        }
    }
    (sums, count)
}

/// The white half sends back irradiance · area · albedo = 10 · 8 · ρ; the black one nothing but what the filter of the
/// texture and the lights on the border carry over: at 20 000 lights on 1 616 m² a light of the square has the edge of 0.28 m,
/// and the filter is half as wide: over 4 m of border 0.14 + 0.14 m at most, 14 % of a half. The sun's beam covers
/// π 28.3² = 2 516 m² with 1 048 576 stratified paths: 3 334 hit a half, 1/√N = 1.7 %, 4 σ = 7 %.
#[test]
fn deposits_follow_the_texture() {
    let folder = tempfile::tempdir().unwrap();
    let ([black, white, _], lights) = fluxes(lit_square(folder.path(), false, 20_000));
    let albedo = Vec3::new(0.8, 0.4, 0.2);
    let both = (black + white) / (albedo * 80.0);
    assert!((both - 1.0).abs().max_element() < 0.07, "{both}");
    assert!(black.x < 0.14 * white.x, "{black} beside {white}");
    assert!(lights > 100);
    // The level that is looked at is one of texels half as wide as a light: 4 m / 64 = 0.0625 m, so the second.
    let scene = lit_square(folder.path(), false, 20_000);
    let square = scene.object("square/unnamed_object/half").unwrap();
    assert_eq!(scene.objects[square.0 as usize].transport_level, 1);
}

/// Through the holes the sun shines on the floor: all of it, less what the right half catches. Of 10 W m⁻² on 1 600 m² of
/// albedo 0.5, 8 m² are in the shade, 0.5 % of it; what comes back from the square's white half to the floor cannot: it faces up.
#[test]
fn photons_pass_through_holes() {
    let folder = tempfile::tempdir().unwrap();
    let ([hole, white, floor], _) = fluxes(lit_square(folder.path(), true, 2_000));
    let ([_, _, under_all], _) = fluxes(lit_square(folder.path(), false, 2_000));
    assert!(hole.x < 0.14 * white.x, "{hole} beside {white}");
    // The difference is the light of 8 m²: 40 W; the same paths otherwise, so that only those 3 334 count, 7 %.
    let passed = floor.x - under_all.x;
    assert!((passed / 40.0 - 1.0).abs() < 0.07, "{passed} W more on the floor");
}
