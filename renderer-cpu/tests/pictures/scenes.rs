//! Turns short TOML into scenes whose light is known in closed form.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, Vsl, VslSet};
use photonstream_scene::{RenderSettings, Scene, SceneConfig, Visibility};
use photonstream_shading::{Camera, Kernel, sobol::Sequence, surface};
use std::path::Path;

pub(crate) fn scene(text: &str) -> Scene {
    SceneConfig::from_text(text, Path::new("test.toml")).unwrap().build().unwrap()
}

/// The inside of a sphere of radius 1 m and albedo 0.5 with a point light of 4π² W at `light`: with the light in the
/// centre the direct radiance is 0.5 and the full radiance 1, everywhere.
pub(crate) fn sphere(light: [f32; 3]) -> Scene {
    scene(&format!(
        "[camera]\nposition_m = [0.3, 0.2, -0.1]\ntarget_m = [-0.4, 0.1, 0.3]\nvertical_fov_deg = 100\n\
         [material.grey]\nalbedo = 0.5\n\
         [object.sphere]\nmaterial = \"grey\"\nsides = \"back\"\nsphere = {{ radius_m = 1, segments = 96 }}\n\
         [light.lamp]\npower_w = {}\npoint = {{ position_m = {light:?} }}\n",
        4.0 * std::f64::consts::PI.powi(2)
    ))
}

/// A floor of 4 m by 4 m and albedo 0.8 at height 0, seen from straight above, with further TOML behind it.
pub(crate) fn floor(rest: &str) -> Scene {
    let mut scene = scene(&format!(
        "origin_m = [0, 0, 0]\n\
         [camera]\nposition_m = [0, 0.9, 0]\ntarget_m = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov_deg = 80\n\
         [material.grey]\nalbedo = [0.8, 0.4, 0.2]\n\
         [object.floor]\nmaterial = \"grey\"\n\
         quad = {{ corner_m = [-2, 0, 2], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -4] }}\n{rest}"
    ));
    scene.camera = Camera::look_at(Vec3::Y * 0.9, Vec3::ZERO, Vec3::NEG_Z, 80.0).unwrap();
    scene
}

/// A lamp that adds nothing: scenes need a light.
pub(crate) const NO_LIGHT: &str = "[light.none]\npower_w = 0\npoint = { position_m = [0, 3, 0] }\n";

/// Where the floor is seen through the centre of a pixel.
pub(crate) fn on_floor(scene: &Scene, index: usize, width: u32, height: u32) -> Vec3 {
    let (x, y) = (index as u32 % width, index as u32 / width);
    let direction = scene.camera.direction(x as f32 + 0.5, y as f32 + 0.5, width, height);
    scene.camera.position - direction * (scene.camera.position.y / direction.y)
}

pub(crate) fn options(width: u32, height: u32, layers: &[LayerKind]) -> RenderOptions {
    RenderOptions {
        width,
        height,
        kernel: Kernel::Disc,
        visibility: Visibility::None,
        epsilon: 0.0,
        layers: layers.to_vec(),
        ..RenderOptions::from_settings(&RenderSettings::default())
    }
}

/// `count` lights of random flux over the surface of a scene, by area. Seed 11.
pub(crate) fn scattered_vsls(scene: &Scene, count: usize) -> VslSet {
    let geometry = &scene.geometry;
    let areas: Vec<f64> =
        (0..geometry.triangles.len()).map(|t| surface::area(geometry.triangle(t as u32))).collect();
    let total: f64 = areas.iter().sum();
    let mut vsls = Vec::new();
    let mut sum = 0.0;
    for (t, area) in areas.iter().enumerate() {
        sum += area / total * count as f64;
        while (vsls.len() as f64) + 0.5 < sum {
            let mut sample = Sequence::new(11, 0).sample(vsls.len() as u64);
            let [u, v] = photonstream_shading::sampling::triangle(sample.next_2d());
            let object = geometry.object_of[t];
            let sides = scene.objects[object.0 as usize].sides;
            let side = sides.iter().next().unwrap();
            vsls.push(Vsl {
                position: surface::point(geometry.triangle(t as u32), u, v),
                normal: geometry.normals[t] * side.sign(),
                flux: Vec3::new(sample.next_1d(), sample.next_1d(), sample.next_1d()) / count as f32,
                area: (total / count as f64) as f32,
                object: object.0,
            });
        }
    }
    VslSet::new(vsls).unwrap()
}

pub(crate) fn cornell() -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml")).unwrap()
}

pub(crate) fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|p| f64::from(p.element_sum())).sum::<f64>() / (3 * pixels.len()) as f64
}
