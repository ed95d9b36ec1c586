//! The GPU's pictures are the CPU's.

use crate::scenes::{self, LAMPS, Lit, layer, rel_rmse};
use glam::Vec3;
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, Shadows, View};
use photonstream_scene::Visibility;
use photonstream_shading::Kernel;

/// Pixels at which both see the same surface.
///
/// A pixel's centre within 1/256 pixel of an edge (the rasteriser's grid) may fall on either side; this camera looks
/// at the room so that the edges of its walls run through the centres of pixels on the diagonals.
pub(crate) fn same_surface(normals: [&[Vec3]; 2], albedos: [&[Vec3]; 2]) -> Vec<bool> {
    let same = |[a, b]: [&[Vec3]; 2], i: usize| (a[i] - b[i]).abs().max_element() < 1e-3;
    (0..normals[0].len()).map(|i| same(normals, i) && same(albedos, i)).collect()
}

/// Every layer, kernel and light against the CPU, direct light by rays: relative RMSE ≤ 1e-3 over the pixels that see
/// the same surface, which are all but 1 %. 80 × 60 pixels, 200 lights of 4 096 paths, seed 1.
#[test]
fn every_layer_kernel_and_light_is_the_cpus() {
    let lamps = LAMPS.map(|(name, lamp)| (name, scenes::cornell(lamp, "vsls = 200\npool_paths = 4096")));
    let rooms = scenes::config("two-rooms.toml", |text| {
        format!("{text}\n[streaming]\nvsls = 200\npool_paths = 4096\n")
    });
    for (name, lit) in lamps.into_iter().chain([("two rooms", rooms)]) {
        let Some(mut renderer) = lit.renderer() else { return };
        for kernel in Kernel::ALL {
            let view = View { kernel, shadows: Shadows::Rays, light_samples: 4, ..lit.view(80, 60) };
            let expected = lit.on_cpu(&view, &LayerKind::ALL);
            let found: Vec<_> = LayerKind::ALL.iter().map(|&l| layer(&mut renderer, &view, l)).collect();
            let of = |kind: LayerKind| LayerKind::ALL.iter().position(|&l| l == kind).unwrap();
            let pair = |kind| [found[of(kind)].as_slice(), expected[of(kind)].as_slice()];
            let same = same_surface(pair(LayerKind::Normal), pair(LayerKind::Albedo));
            let others = same.iter().filter(|&&s| !s).count();
            assert!(others * 100 <= same.len(), "{name}, {kernel}: {others} pixels see another surface");
            for kind in LayerKind::ALL {
                // Which of two lights is nearer is decided by the last bit where a boundary runs through a pixel.
                let decided = |i: usize| match kind {
                    LayerKind::Vsl | LayerKind::Flux => {
                        let [a, b] = pair(LayerKind::Vsl);
                        (a[i] - b[i]).length() < 1e-3
                    }
                    _ => true,
                };
                let undecided = (0..same.len()).filter(|&i| same[i] && !decided(i)).count();
                assert!(
                    undecided * 1000 <= same.len(),
                    "{name}, {kernel}, {kind}: {undecided} owners differ"
                );
                let [a, b] = pair(kind);
                let error = rel_rmse(a, b, |i| same[i] && decided(i));
                assert!(error <= 1e-3, "{name}, {kernel}, {kind}: {error:e}");
            }
        }
    }
}

/// Indirect light with a shadow ray to every light, against the CPU's, every kernel: relative RMSE ≤ 1e-3.
/// 40 × 30 pixels, 60 lights.
#[test]
fn rays_to_every_light_are_the_cpus() {
    let lit = scenes::cornell(LAMPS[0].1, "vsls = 60\npool_paths = 4096");
    let Some(mut renderer) = lit.renderer() else { return };
    for kernel in Kernel::ALL {
        let view = View { kernel, visibility: Visibility::Rays, rays_per_pixel: 0, ..lit.view(40, 30) };
        let layers = [LayerKind::Indirect, LayerKind::Normal, LayerKind::Albedo];
        let expected = lit.on_cpu(&view, &layers);
        let found = layers.map(|l| layer(&mut renderer, &view, l));
        let same = same_surface([&found[1], &expected[1]], [&found[2], &expected[2]]);
        let error = rel_rmse(&found[0], &expected[0], |i| same[i]);
        assert!(error <= 1e-3, "{kernel}: {error:e}");
        // Without shadows it is another picture: the test can fail.
        let open = layer(&mut renderer, &View { visibility: Visibility::None, ..view }, LayerKind::Indirect);
        assert!(rel_rmse(&open, &expected[0], |i| same[i]) > 0.01);
    }
}

/// Indirect light with the shadows of distance maps, against the CPU's, every accumulation and interleaving: relative RMSE
/// ≤ 2e-3, for the last bit decides about a texel that is just as far as its receiver. 80 × 60 pixels, 200 lights with maps of
/// 16² texels.
#[test]
fn shadows_of_distance_maps_are_the_cpus() {
    let lit = scenes::cornell(LAMPS[0].1, "vsls = 200\npool_paths = 4096\ndistance_map_px = 16");
    let Some(mut renderer) = lit.renderer() else { return };
    for kernel in Kernel::ALL {
        let view = View { kernel, visibility: Visibility::Octahedral, ..lit.view(80, 60) };
        let layers = [LayerKind::Indirect, LayerKind::Normal, LayerKind::Albedo];
        let expected = lit.on_cpu(&view, &layers);
        let [_, normal, albedo] = layers.map(|l| layer(&mut renderer, &view, l));
        let same = same_surface([&normal, &expected[1]], [&albedo, &expected[2]]);
        for &accumulation in Accumulation::ALL {
            let found = layer(&mut renderer, &View { accumulation, ..view }, LayerKind::Indirect);
            let error = rel_rmse(&found, &expected[0], |i| same[i]);
            assert!(error <= 2e-3, "{kernel}, {accumulation}: {error:e}");
        }
        // Without shadows it is another picture, and by rays almost the same: the test can fail.
        let open = layer(&mut renderer, &View { visibility: Visibility::None, ..view }, LayerKind::Indirect);
        let rays = View { visibility: Visibility::Rays, rays_per_pixel: 0, ..view };
        let rays = layer(&mut renderer, &rays, LayerKind::Indirect);
        let error = |picture: &[Vec3]| rel_rmse(picture, &rays, |i| same[i]);
        assert!(error(&open) > 0.1 && error(&expected[0]) < 0.05, "{} {}", error(&open), error(&expected[0]));
    }
}

/// Pixels at which GPU and CPU see the same surface.
fn seen_alike(lit: &Lit, view: &View) -> Vec<bool> {
    let layers = [LayerKind::Normal, LayerKind::Albedo];
    let Some(mut renderer) = lit.renderer() else { return Vec::new() };
    let cpu = lit.on_cpu(view, &layers);
    let gpu = layers.map(|l| layer(&mut renderer, view, l));
    same_surface([&gpu[0], &cpu[0]], [&gpu[1], &cpu[1]])
}

/// Pixels within `reach` of where a shadow begins: the lamp's visible share, which is the picture with shadow rays by the
/// one without shadows, takes different values there, or lies between none and all of the lamp.
fn near_shadow_edges(shadowed: &[Vec3], open: &[Vec3], width: usize, reach: isize) -> Vec<bool> {
    let share =
        |(s, o): (&Vec3, &Vec3)| if o.max_element() > 0.0 { s.max_element() / o.max_element() } else { 0.0 };
    let visible: Vec<f32> = shadowed.iter().zip(open).map(share).collect();
    let height = (visible.len() / width) as isize;
    let is_near = |i: usize| {
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        let around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (x + dx, y + dy)));
        let around = around
            .filter(|(x, y)| (0..width as isize).contains(x) && (0..height).contains(y))
            .map(|(x, y)| visible[y as usize * width + x as usize]);
        let (low, high) = around.fold((1f32, 0f32), |(low, high), v| (low.min(v), high.max(v)));
        low < 0.98 && high > 0.02
    };
    (0..visible.len()).map(is_near).collect()
}

/// The room of the Cornell box with `lamp`, and a ball of 498 000 triangles, finer than the texels of a shadow map.
fn fine_ball(lamp: &str, streaming: &str) -> Lit {
    scenes::config("cornell-box.toml", |text| {
        let room = text.split("[light.").next().unwrap().to_owned();
        format!(
            "{room}\n[light.lamp]\n{lamp}\n[streaming]\n{streaming}\n[object.fine]\nmaterial = \"white\"\n\
             position_m = [0.35, 0.95, 0.3]\nsphere = {{ radius_m = 0.2, segments = 500 }}\n"
        )
    })
}

/// With shadow maps at most 2 % of the pixels are off the CPU's ray-traced picture by more than 5 %, and where direct light
/// is, they lie within two pixels of a shadow's edge. 160 × 120 pixels; the room of the box, two rooms, and for lights without
/// extent the box with a ball of triangles finer than a map's texels.
///
/// Maps of lights without extent name triangles, which are tested themselves: all but one pixel in a thousand are right.
/// The area light has 16 points of its own on both sides, of which the CPU draws others for each pixel: it is given 256, so
/// that its noise stays below the limit.
#[test]
fn shadow_maps_differ_on_shadow_edges_only() {
    const STREAMING: &str = "vsls = 100\npool_paths = 4096";
    let boxes = LAMPS.map(|(name, lamp)| (format!("{name}, box"), scenes::cornell(lamp, STREAMING)));
    let balls = LAMPS.into_iter().filter(|(name, _)| *name != "area");
    let balls = balls.map(|(name, lamp)| (format!("{name}, fine ball"), fine_ball(lamp, STREAMING)));
    // The lamp is in the room that the camera does not see: nothing comes through the wall between.
    let rooms = scenes::config("two-rooms.toml", |text| {
        let behind = text.replace("[-0.8, 1.6, 0.1]", "[0.8, 1.6, 0.1]");
        assert_ne!(behind, text);
        format!("{behind}\n[streaming]\n{STREAMING}\n")
    });
    for (name, lit) in boxes.into_iter().chain(balls).chain([("two rooms".to_owned(), rooms)]) {
        let Some(mut renderer) = lit.renderer() else { return };
        let view = View { shadows: Shadows::Maps, light_samples: 16, ..lit.view(160, 120) };
        let exact = View { light_samples: 256, ..view };
        let [full, direct]: [_; 2] =
            lit.on_cpu(&exact, &[LayerKind::Full, LayerKind::Direct]).try_into().unwrap();
        let same = seen_alike(&lit, &view);
        let off = |found: &[Vec3], expected: &[Vec3]| -> Vec<usize> {
            let is_off = |i: &usize| {
                let difference = (found[*i] - expected[*i]).abs().max_element();
                same[*i] && difference > 0.05 * full[*i].max_element().max(1e-3)
            };
            (0..same.len()).filter(is_off).collect()
        };
        let found = layer(&mut renderer, &view, LayerKind::Full);
        let share = off(&found, &full).len() as f64 / full.len() as f64;
        let limit = if name.starts_with("area") { 0.02 } else { 0.001 };
        assert!(share <= limit, "{name}: {:.2} % of the pixels", share * 100.0);
        let mut open = |shadows| layer(&mut renderer, &View { shadows, ..exact }, LayerKind::Direct);
        let edges = near_shadow_edges(&open(Shadows::Rays), &open(Shadows::None), 160, 2);
        let near = edges.iter().filter(|&&near| near).count();
        assert!(near * 2 < edges.len(), "{name}: edges are everywhere");
        let found = open(Shadows::Maps);
        let elsewhere: Vec<_> =
            off(&found, &direct).into_iter().filter(|&i| !edges[i]).map(|i| (i % 160, i / 160)).collect();
        assert!(elsewhere.is_empty(), "{name}: beside the edges: {elsewhere:?}");
        // Without shadows far more are off, also beside the edges: the limits say something.
        let bare = off(&open(Shadows::None), &direct);
        assert!(bare.len() * 25 > full.len(), "{name} without shadows: {}", bare.len());
        assert!(bare.iter().any(|&i| !edges[i]), "{name}: there is nothing beside the edges");
    }
}
