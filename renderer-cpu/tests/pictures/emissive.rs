//! Turns emitting meshes into pictures, and compares them with closed forms and with lights of one face.
#![allow(clippy::unwrap_used)]

use crate::scenes::{floor, mean, on_floor, options, scene};
use glam::Vec3;
use photonstream_renderer::{LayerKind, VslSet, Watch};
use photonstream_renderer_cpu::{ReferenceOptions, reference, reference::Stop, render};
use photonstream_scene::{RenderSettings, Scene};
use photonstream_shading::LightShape;
use std::{f64::consts::PI, fmt::Write, path::Path};

/// An OBJ file of a material that emits 5 W m⁻² sr⁻¹.
fn write(folder: &Path, vertices: &[Vec3], faces: &[[usize; 3]]) -> String {
    std::fs::write(folder.join("lamp.mtl"), "newmtl lamp\nKd 0 0 0\nKe 5 5 5\n").unwrap();
    let mut obj = String::from("mtllib lamp.mtl\nusemtl lamp\n");
    vertices.iter().for_each(|v| writeln!(obj, "v {} {} {}", v.x, v.y, v.z).unwrap());
    faces.iter().for_each(|[a, b, c]| writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap());
    let path = folder.join("lamp.obj");
    std::fs::write(&path, obj).unwrap();
    format!("{:?}", path.to_str().unwrap())
}

/// A ball of 0.1 m, of 2 · 48 · 96 triangles.
fn ball(folder: &Path) -> String {
    let (rows, columns) = (48, 96);
    let mut vertices = Vec::new();
    for row in 0..=rows {
        for column in 0..columns {
            let (s, c) = (PI * row as f64 / rows as f64).sin_cos();
            let (t, d) = (2.0 * PI * column as f64 / columns as f64).sin_cos();
            vertices.push(Vec3::new((s * d) as f32, c as f32, (s * t) as f32) * 0.1);
        }
    }
    let at = |row: usize, column: usize| row * columns + column % columns;
    let faces = (0..rows).flat_map(|row| {
        (0..columns).flat_map(move |column| {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
            [[a, b, c], [a, c, d]]
        })
    });
    write(folder, &vertices, &faces.collect::<Vec<_>>())
}

/// A ball of radiance L and radius r at the distance d above a floor lights it with π L r² h/d³, whatever is hidden of it
/// below its own horizon.
///
/// 24² pixels × 1 024 points of the light, stratified. Tolerance 0.7 %: the ball of facets has 0.25 % less cross section, and
/// the points' own error was 0.1 % in the mean; single pixels 5 %.
#[test]
fn a_ball_lights_a_floor() {
    let folder = tempfile::tempdir().unwrap();
    let path = ball(folder.path());
    let scene = floor(&format!("[object.lamp]\nposition_m = [0.15, 0.4, -0.1]\nobj = {{ path = {path} }}\n"));
    assert_eq!(scene.lights.len(), 1);
    assert!(matches!(scene.lights[0].light.shape, LightShape::Mesh { .. }));
    let mut settings = options(24, 24, &[LayerKind::Direct, LayerKind::Albedo]);
    settings.light_samples = 1024;
    let film = render(&scene, &VslSet::default(), &settings, Watch::default()).unwrap().film;
    let (direct, albedo) = (&film.layer("direct").unwrap().pixels, &film.layer("albedo").unwrap().pixels);
    let mut sums = [0.0; 2];
    for (i, (found, albedo)) in direct.iter().zip(albedo).enumerate().filter(|(_, (_, a))| a.x > 0.0) {
        let d = Vec3::new(0.15, 0.4, -0.1) - on_floor(&scene, i, 24, 24);
        let arriving = PI * 5.0 * 0.01 * f64::from(d.y) / f64::from(d.length()).powi(3);
        let expected = f64::from(albedo.x) / PI * arriving;
        assert!((f64::from(found.x) / expected - 1.0).abs() < 0.05, "{i}: {found}, expected {expected}");
        sums[0] += f64::from(found.x);
        sums[1] += expected;
    }
    assert!((sums[0] / sums[1] - 1.0).abs() < 0.007, "{sums:?}");
    // Where the camera sees the ball it sees its radiance.
    let seen = direct.iter().zip(albedo).filter(|(_, a)| **a == Vec3::ZERO);
    assert!(seen.clone().count() > 3 && seen.clone().all(|(d, _)| (*d - Vec3::splat(5.0)).length() < 1e-4));
}

/// A lamp of 1 × 0.5 m, cut into 2 · 5² triangles of all sizes or given as a rectangle, in an open box.
fn lamp(folder: &Path, is_mesh: bool) -> Scene {
    let place = |k: usize| [0.0f32, 0.05, 0.3, 0.35, 0.9, 1.0][k];
    let vertices: Vec<Vec3> =
        (0..36).map(|i| Vec3::new(place(i % 6) - 0.5, 1.8, 0.5 * place(i / 6) - 0.25)).collect();
    let faces: Vec<[usize; 3]> = (0..25)
        .flat_map(|i| {
            let a = i / 5 * 6 + i % 5;
            [[a, a + 1, a + 7], [a, a + 7, a + 6]]
        })
        .collect();
    let path = write(folder, &vertices, &faces);
    let lamp = if is_mesh {
        format!("[object.lamp]\nobj = {{ path = {path} }}\n")
    } else {
        format!(
            "[light.lamp]\npower_w = {}\nrectangle = {{ corner_m = [-0.5, 1.8, -0.25], edge_u_m = [1, 0, 0], \
             edge_v_m = [0, 0, 0.5] }}\n",
            5.0 * PI * 0.5
        )
    };
    scene(&format!(
        "origin_m = [0, 0, 0]\n[camera]\nposition_m = [0, 1, 0.9]\ntarget_m = [0, 0.8, 0]\nvertical_fov_deg = 90\n\
         [material.grey]\nalbedo = 0.6\n\
         [object.room]\nmaterial = \"grey\"\nsides = \"back\"\nposition_m = [0, 1, 0]\nbox = {{ size_m = [2, 2, 2] }}\n{lamp}"
    ))
}

/// The same lamp as a mesh and as a rectangle, by 24² pixels × 256 paths, seed 1: means of direct and indirect light agree
/// within 4 σ of both references' own noise, and so do emitted radiance and power, to rounding.
#[test]
fn a_mesh_shines_as_its_outline() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = [true, false].map(|is_mesh| lamp(folder.path(), is_mesh));
    let lights = scenes.each_ref().map(|s| &s.lights[0].light);
    assert!(matches!(lights[0].shape, LightShape::Mesh { .. }));
    assert!((lights[0].power - lights[1].power).abs().max_element() < 1e-5);
    assert!((lights[0].emitted_radiance() - Vec3::splat(5.0)).abs().max_element() < 1e-5);
    let layers = vec![LayerKind::Direct, LayerKind::Indirect];
    let [a, b] = scenes.each_ref().map(|scene| {
        let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), Stop::Samples(256));
        let settings = ReferenceOptions { width: 24, height: 24, layers: layers.clone(), ..defaults };
        reference(scene, &settings, Watch::default()).unwrap()
    });
    for (layer, noise) in [
        ("direct", [a.stats.noise_direct_rel_rmse, b.stats.noise_direct_rel_rmse]),
        ("indirect", [a.stats.noise_indirect_rel_rmse, b.stats.noise_indirect_rel_rmse]),
    ] {
        let [of_mesh, of_rectangle] = [&a, &b].map(|r| mean(&r.film.layer(layer).unwrap().pixels));
        let tolerance = 4.0 * noise[0].hypot(noise[1]) / 24.0;
        assert!(
            (of_mesh / of_rectangle - 1.0).abs() < tolerance,
            "{layer}: {of_mesh}, {of_rectangle} ± {tolerance}"
        );
        assert!(tolerance < 0.03 && of_mesh > 0.0, "{tolerance}");
    }
}
