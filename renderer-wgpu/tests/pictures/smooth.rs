//! Shading normals weigh light on the device as on the CPU.

use crate::{
    scenes::{Lit, layer, lit, rel_rmse},
    twins::{check, uniform, vector},
};
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, View};
use photonstream_scene::Visibility;
use photonstream_shading::{sampling, surface, wgsl};
use std::fmt::Write;

/// N = 4 096 sums of corners' normals of any length, up to 90° off the triangle's.
#[test]
fn shading_normals() {
    let mut inputs = uniform();
    inputs.iter_mut().for_each(|x| {
        let flat = sampling::sphere([x[0], x[1]]).normalize();
        let bent = (flat + sampling::sphere([x[2], x[3]])) * x[4];
        x[..3].copy_from_slice(&flat.to_array());
        x[3..6].copy_from_slice(&bent.to_array());
        // The choice at 60° is not to hang on a rounding.
        if (flat.dot(bent) / bent.length() - surface::SHADING_COS).abs() < 1e-4 {
            x[3..6].copy_from_slice(&[0.0; 3]);
        }
    });
    let body = "let n = shading_normal(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]));
        y = array<f32, 4>(n.x, n.y, n.z, 0.0);";
    check("shading_normal", &[wgsl::SURFACE], body, 1.0, &inputs, |x| {
        surface::shading_normal(vector(x, 0), vector(x, 3)).extend(0.0).to_array()
    });
}

/// A ball of 12 × 6 quadrilaterals of one smoothing group over a flat floor with a wall behind.
fn room(folder: &std::path::Path) -> Lit {
    let mut obj = String::from(
        "g walls\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nv 2 3 -2\nv -2 3 -2\nf 1 2 3 4\nf 4 3 5 6\ng ball\ns 1\n",
    );
    for row in 0..=6 {
        for column in 0..12 {
            let (s, c) = (f64::from(row) * 30f64.to_radians()).sin_cos();
            let (t, d) = (f64::from(column) * 30f64.to_radians()).sin_cos();
            writeln!(obj, "v {} {} {}", 0.7 * s * d, 0.8 + 0.7 * c, 0.7 * s * t).unwrap();
        }
    }
    for row in 0..6 {
        for column in 0..12 {
            let at = |row: i32, column: i32| 7 + row * 12 + column % 12;
            let corners =
                [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
            let [a, b, c, d] = corners;
            writeln!(obj, "f {a} {b} {c} {d}").unwrap();
        }
    }
    let path = folder.join("room.obj");
    std::fs::write(&path, obj).unwrap();
    lit(&format!(
        "[camera]\nposition_m = [1.2, 1.6, 3.1]\ntarget_m = [0, 0.7, 0]\nvertical_fov_deg = 40\n\
         [material.grey]\nalbedo = 0.7\n\
         [object.room]\nmaterial = \"grey\"\nsides = \"both\"\nrotation_deg = [0, 10, 0]\nobj = {{ path = {:?} }}\n\
         [light.lamp]\npower_w = 40\npoint = {{ position_m = [1.1, 2.1, 1.2] }}\n\
         [streaming]\nvsls = 300\npool_paths = 16384\n",
        path.to_str().unwrap()
    ))
}

/// Normals to 1e-4 where both see the same surface (corners' normals of 16 bits are 5e-5 off), indirect light of all
/// accumulations to twice that; direct light but for 1 % of the pixels, at the outlines of shadows. 160 × 120 pixels, 300
/// lights.
#[test]
fn curved_surfaces_look_as_on_the_cpu() {
    let folder = tempfile::tempdir().unwrap();
    let lit = room(folder.path());
    let Some(mut renderer) = lit.renderer() else { return };
    let view = View { visibility: Visibility::None, ..lit.view(160, 120) };
    let layers = [LayerKind::Normal, LayerKind::Depth, LayerKind::Direct, LayerKind::Indirect];
    let expected = lit.on_cpu(&view, &layers);
    let [normal, depth, direct, _] = layers.map(|l| layer(&mut renderer, &view, l));
    let count = normal.len();
    let close = |i: usize| (depth[i].x - expected[1][i].x).abs() <= 1e-3 * expected[1][i].x;
    assert!((0..count).filter(|&i| close(i)).count() * 100 > 97 * count);
    let error = rel_rmse(&normal, &expected[0], close);
    assert!(error < 1e-4, "normals: {error}");
    for accumulation in [Accumulation::Forward, Accumulation::Splat, Accumulation::Tiled] {
        let found = layer(&mut renderer, &View { accumulation, ..view }, LayerKind::Indirect);
        let error = rel_rmse(&found, &expected[3], close);
        assert!(error < 2e-4, "{accumulation}: {error}");
    }
    let differs = |i: &usize| {
        let size = expected[2][*i].max_element().max(0.05);
        close(*i) && (direct[*i] - expected[2][*i]).abs().max_element() > 0.03 * size
    };
    let otherwise = (0..count).filter(differs).count();
    assert!(otherwise * 100 <= count, "{otherwise} pixels are lit otherwise");
    // The ball is not drawn flat: neighbours of a row differ by little, where flat faces would be the same or 30° apart.
    let turns = (0..count - 1).filter(|&i| {
        let step = (expected[0][i + 1] - expected[0][i]).length();
        step > 1e-3 && step < 0.05
    });
    assert!(turns.count() > 1000);
}
