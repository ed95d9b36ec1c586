//! Shadow maps of few virtual surface lights give the picture that rays to them give.

use crate::{
    against_cpu::same_surface,
    fence,
    scenes::{self, LAMPS, Lit, layer, rel_rmse},
};
use glam::Vec3;
use photonstream_protocol::{VslFrame, VslRecord};
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, GpuError, Renderer, Show, View};
use photonstream_scene::{SHADOW_MAP_EDGES, Scene, Visibility, bvh::Ray};
use photonstream_shading::{Kernel, sampling, sobol::Sequence};

/// Lights of 1 W on what is seen from `from`, evenly in all directions, as a method with few lights publishes them: of one size, without
/// polygons and without distance maps. Seed 11.
fn few(scene: Scene, count: u32, from: Vec3) -> Lit {
    let mut vsls = Vec::new();
    let mut directions = (0..).map(|i| sampling::sphere(Sequence::new(11, 0).sample(i).next_2d()));
    while vsls.len() < count as usize {
        let ray = Ray { origin: from, direction: directions.next().unwrap(), t_max: f32::INFINITY };
        let Some(hit) = scene.bvh.closest(&ray) else { continue };
        let front = scene.geometry.normals[hit.triangle as usize];
        let normal = if front.dot(ray.direction) < 0.0 { front } else { -front };
        vsls.push(VslRecord {
            changed_frame: 1,
            position: (from + ray.direction * hit.t).to_array(),
            normal: normal.to_array(),
            object: scene.geometry.object_of[hit.triangle as usize].0,
            area: 0.3,
            flux: [1.0, 0.9, 0.8],
            ..VslRecord::default()
        });
    }
    let frame = VslFrame { epoch: 1, frame: 1, vsls, scene_hash: scene.hash, ..VslFrame::default() };
    Lit { scene, frame }
}

/// `count` lights in the Cornell box, from between its box and its sphere.
fn cornell(count: u32) -> Lit {
    let scene = scenes::cornell(LAMPS[0].1, "vsls = 1\npool_paths = 1").scene;
    few(scene, count, Vec3::new(0.15, 0.9, 0.5))
}

fn with_maps(lit: &Lit, shadow_map_px: u32) -> View {
    let visibility = Visibility::ShadowMaps;
    View { kernel: Kernel::Disc, visibility, shadow_map_px, ..lit.view(96, 96) }
}

/// The lights of `frame` with `edit`, as the frame after it.
fn edited(frame: &VslFrame, edit: impl Fn(usize, &mut VslRecord)) -> VslFrame {
    let mut frame = frame.clone();
    frame.frame += 1;
    for (i, record) in frame.vsls.iter_mut().enumerate() {
        edit(i, record);
        record.changed_frame = frame.frame;
    }
    frame
}

/// How many maps were drawn for a picture of indirect light, and the picture.
fn indirect(renderer: &mut Renderer, view: &View) -> (u32, Vec<Vec3>) {
    let drawn = renderer.draw(&View { show: Show::Layer(LayerKind::Indirect), ..*view }).unwrap();
    (drawn.vsl_maps, renderer.pixels().unwrap())
}

/// One light and 20 against rays of the CPU, which takes shadow maps for rays: relative RMSE of indirect light where both see the same
/// surface, 96 × 96 pixels. The error falls with each doubling of the edge. One light has hard shadows with nothing else to fill them; what is left at 256² is their
/// outlines, each a few pixels. Measured, from 32² to 256²: 14.5, 10.5, 7.3, 6.9 % and 4.1, 2.3, 1.5, 1.1 %; without shadows 44 % and
/// 34 %.
#[test]
fn maps_come_as_near_to_rays_as_their_texels_are_fine() {
    for count in [1, 20] {
        let lit = cornell(count);
        let Some(mut renderer) = lit.renderer() else { return };
        let view = with_maps(&lit, 32);
        let seen = [LayerKind::Indirect, LayerKind::Normal, LayerKind::Albedo];
        let expected = lit.on_cpu(&view, &seen);
        let rays = View { visibility: Visibility::Rays, ..view };
        assert!(lit.on_cpu(&rays, &seen[..1])[0] == expected[0], "shadow maps are rays on the CPU");
        let [normal, albedo] = [seen[1], seen[2]].map(|l| layer(&mut renderer, &view, l));
        let same = same_surface([&normal, &expected[1]], [&albedo, &expected[2]]);
        let errors = SHADOW_MAP_EDGES.map(|edge| {
            let (maps, found) = indirect(&mut renderer, &with_maps(&lit, edge));
            assert_eq!(maps, count);
            rel_rmse(&found, &expected[0], |i| same[i])
        });
        let open = layer(&mut renderer, &View { visibility: Visibility::None, ..view }, LayerKind::Indirect);
        let open = rel_rmse(&open, &expected[0], |i| same[i]);
        println!("{count} lights: {errors:.4?}; without shadows {open:.4}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
        let most = if count == 1 { [0.16, 0.115, 0.085, 0.075] } else { [0.05, 0.03, 0.018, 0.013] };
        assert!(errors.iter().zip(most).all(|(&error, most)| error <= most), "{count}: {errors:?}");
        assert!(open > 0.3, "{open}");
    }
}

/// Every accumulation, kernel and a pattern of interleaved sampling look the maps up alike.
#[test]
fn all_passes_look_maps_up() {
    let lit = cornell(20);
    let Some(mut renderer) = lit.renderer() else { return };
    for kernel in Kernel::ALL {
        let view = View { kernel, ..with_maps(&lit, 64) };
        let ways = [Accumulation::Tiled, Accumulation::Splat, Accumulation::Forward];
        let [tiled, splat, forward] =
            ways.map(|accumulation| indirect(&mut renderer, &View { accumulation, ..view }).1);
        for (name, found) in [("splat", splat), ("forward", forward)] {
            let error = rel_rmse(&found, &tiled, |_| true);
            assert!(error <= 2e-5, "{kernel}, {name}: {error:e}");
        }
        // Near lights are not interleaved, and of the others a pixel's neighbours bring the rest.
        let interleaved = indirect(&mut renderer, &View { interleave: 2, ..view }).1;
        let error = rel_rmse(&interleaved, &tiled, |_| true);
        let none = View { visibility: Visibility::None, ..view };
        let open = rel_rmse(&layer(&mut renderer, &none, LayerKind::Indirect), &tiled, |_| true);
        println!("{kernel}: interleaved {error:.4}, without shadows {open:.4}");
        assert!(error < 0.5 * open && open > 0.1, "{kernel}: {error}, without shadows {open}");
    }
}

/// Eight lights on the far wall of the left of two rooms, 0.8 to 1.15 m high. In the right room everything is dark but what is next to
/// the wall between them: there a receiver hardly farther away than the wall is within the bias of 4/edge, 8/edge m behind it, and
/// texels that show the floor before the wall's foot, at 1 m in 3 by the 1-norm, are filtered into those up to a texel, 2/edge, beyond:
/// 18/edge m, and twice as far on oblique ways. Measured, from 32² to 256²: 1.32, 0.56, 0.24 and 0.12 m.
#[test]
fn behind_a_wall_nothing_is_lit() {
    let scene = scenes::config("two-rooms.toml", |text| {
        let text = text.replace("position_m = [-1.8, 1.2, 0.9]", "position_m = [0.1, 1.4, 0.9]");
        let text = text.replace("target_m = [0, 0.9, -0.2]", "target_m = [1.2, 0.6, -0.4]");
        format!("{text}\n[streaming]\nvsls = 1\npool_paths = 1\n")
    })
    .scene;
    let origin = scene.origin_m.as_vec3();
    let mut lit = few(scene, 8, Vec3::new(-0.8, 1.0, 0.1) - origin);
    for (i, record) in lit.frame.vsls.iter_mut().enumerate() {
        let along = 0.05 * i as f32;
        record.position = (Vec3::new(-2.0, 0.8 + along, 2.0 * along - 0.3) - origin).to_array();
        record.normal = [1.0, 0.0, 0.0];
    }
    let Some(mut renderer) = lit.renderer() else { return };
    let view = with_maps(&lit, 32);
    let depth = layer(&mut renderer, &view, LayerKind::Depth);
    let camera = &lit.scene.camera;
    let behind: Vec<f32> = (0..96 * 96)
        .map(|i| {
            let direction = camera.direction((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5, 96, 96);
            (camera.position + direction * depth[i].x + origin).x
        })
        .collect();
    let open = layer(&mut renderer, &View { visibility: Visibility::None, ..view }, LayerKind::Indirect);
    let farthest = |picture: &[Vec3]| {
        (0..picture.len()).filter(|&i| picture[i] != Vec3::ZERO).map(|i| behind[i]).fold(0.0, f32::max)
    };
    assert!(farthest(&open) > 1.9, "without shadows");
    for edge in SHADOW_MAP_EDGES {
        let found = indirect(&mut renderer, &with_maps(&lit, edge)).1;
        let reach = farthest(&found);
        println!("{edge}: lit up to {reach} m behind the wall");
        assert!(reach < 48.0 / edge as f32, "{edge}: {reach}");
    }
}

/// Lights without flux have no map, and the picture is the bits of one without them; one that shines again gets its map.
#[test]
fn dark_lights_cost_no_map_and_change_nothing() {
    let mut lit = cornell(20);
    lit.frame = edited(&lit.frame, |i, record| {
        if i % 2 == 1 {
            record.flux = [0.0; 3];
        }
    });
    let Some(mut renderer) = lit.renderer() else { return };
    let view = with_maps(&lit, 64);
    let (maps, found) = indirect(&mut renderer, &view);
    assert_eq!(maps, 10);
    let shining = lit.frame.vsls.iter().copied().filter(|record| record.flux[0] > 0.0).collect();
    let alone = Lit { scene: lit.scene.clone(), frame: VslFrame { vsls: shining, ..lit.frame.clone() } };
    let Some(mut fresh) = alone.renderer() else { return };
    assert!(indirect(&mut fresh, &view) == (10, found));
    renderer
        .set_frame(&edited(&lit.frame, |i, record| {
            record.flux = [if i == 3 { 1.0 } else { record.flux[0] }; 3]
        }))
        .unwrap();
    assert_eq!(indirect(&mut renderer, &view).0, 1);
}

/// A light that moves has its map drawn again, and no other; one that is dimmed has not; after a change of the geometry all have. The
/// pictures are the bits of renderers that never knew anything else.
#[test]
fn only_what_moved_is_drawn_again() {
    let mut lit = cornell(20);
    let Some(mut renderer) = lit.renderer() else { return };
    let view = with_maps(&lit, 64);
    let before = indirect(&mut renderer, &view).1;
    let mut turn = |lit: &Lit, expected: u32| {
        renderer.set_scene(&lit.scene).unwrap();
        renderer.set_frame(&lit.frame).unwrap();
        let (maps, found) = indirect(&mut renderer, &view);
        assert_eq!(maps, expected);
        let Some(mut fresh) = lit.renderer() else { return found };
        assert!(indirect(&mut fresh, &view) == (20, found.clone()));
        found
    };
    lit.frame = edited(&lit.frame, |_, record| record.flux = record.flux.map(|f| f * 0.5));
    let dimmed = turn(&lit, 0);
    lit.frame = edited(&lit.frame, |i, record| record.position[1] += if i == 7 { 0.2 } else { 0.0 });
    let moved = turn(&lit, 1);
    assert!(before != dimmed && dimmed != moved);
    let sphere = lit.scene.object("sphere").unwrap();
    let mut place = lit.scene.objects[sphere.0 as usize].world_from_rest;
    place.translation.x -= 0.3;
    lit.scene = lit.scene.with_object_placed(sphere, place).unwrap();
    let around = turn(&lit, 20);
    assert!(around != moved);
    // Another view, or finer maps.
    let moved = View { jitter: [0.4, 0.5], ..view };
    assert_eq!(indirect(&mut renderer, &moved).0, 0);
    assert_eq!(indirect(&mut renderer, &View { shadow_map_px: 128, ..moved }).0, 20);
    // A picture without shadows in between loses none.
    indirect(&mut renderer, &View { visibility: Visibility::None, ..moved });
    assert_eq!(indirect(&mut renderer, &View { shadow_map_px: 128, ..view }).0, 0);
}

/// Through plates full of holes light falls where the CPU's rays do: relative RMSE of indirect light under the plates, whose holes are
/// a few texels of 256² wide, against the picture in which nothing has holes (measured: 24 % and 130 %).
#[test]
fn holes_let_light_through() {
    let room = |holes: bool| {
        let folder = tempfile::tempdir().unwrap();
        let scene = scenes::lit(&fence::scene_text(folder.path(), holes)).scene;
        let origin = scene.origin_m.as_vec3();
        let mut lit = few(scene, 1, Vec3::new(0.0, 0.3, 0.0) - origin);
        let record = &mut lit.frame.vsls[0];
        record.position = (Vec3::new(0.1, 2.3, 0.2) - origin).to_array();
        record.normal = [0.0, -1.0, 0.0];
        lit
    };
    let (holes, solid) = (room(true), room(false));
    let Some(mut renderer) = holes.renderer() else { return };
    let view = with_maps(&holes, 256);
    let seen = [LayerKind::Indirect, LayerKind::Depth, LayerKind::Albedo];
    let expected = holes.on_cpu(&view, &seen);
    let [depth, albedo] = [seen[1], seen[2]].map(|l| layer(&mut renderer, &view, l));
    let same = |i: usize| {
        (albedo[i] - expected[2][i]).abs().max_element() < 0.02
            && (depth[i].x - expected[1][i].x).abs() < 1e-3
    };
    let found = indirect(&mut renderer, &view).1;
    let error = rel_rmse(&found, &expected[0], same);
    renderer.set_scene(&solid.scene).unwrap();
    renderer.set_frame(&solid.frame).unwrap();
    let (maps, shut) = indirect(&mut renderer, &view);
    let closed = rel_rmse(&shut, &expected[0], same);
    println!("holes {error:.4}, with plates without holes {closed:.4}");
    assert!(maps == 1 && error < 0.3 * closed, "{error}, {closed}");
}

/// Of more than 1 024 lights the darkest have no map, and their number is told; an edge that no map has is refused.
#[test]
fn more_lights_than_maps_are_told() {
    let mut lit = cornell(20);
    let first = lit.frame.vsls.clone();
    lit.frame.vsls = (0..1030)
        .map(|i| VslRecord { flux: [if i < 6 { 1e-9 } else { 1e-3 }; 3], ..first[i % 20] })
        .collect();
    let Some(mut renderer) = lit.renderer() else { return };
    let view = View { width: 32, height: 32, ..with_maps(&lit, 32) };
    assert_eq!((indirect(&mut renderer, &view).0, renderer.unshadowed_vsls()), (1024, 6));
    let found = indirect(&mut renderer, &view).1;
    // What has no map does not matter here: the others are as rays have them.
    let error = rel_rmse(&found, &indirect(&mut renderer, &View { shadow_map_px: 64, ..view }).1, |_| true);
    assert!(error < 0.1, "{error}");
    let refused = renderer.draw(&View { shadow_map_px: 48, ..view }).unwrap_err();
    assert!(matches!(refused, GpuError::Option { option: "shadow_map_px", .. }), "{refused}");
}
