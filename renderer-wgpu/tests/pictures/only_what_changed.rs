//! Nothing is uploaded or drawn twice.

use crate::scenes::{self, LAMPS};
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Show, View};

/// A still scene before a still camera gives the device no work; each change gives it the least.
#[test]
fn an_unchanged_picture_is_not_drawn_again() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 200\npool_paths = 4096");
    let Some(mut renderer) = lit.renderer() else { return };
    renderer.set_timed(true);
    let view = lit.view(64, 64);
    let names =
        |passes: &[photonstream_renderer_wgpu::PassTime]| passes.iter().map(|p| p.name).collect::<Vec<_>>();
    let first = renderer.draw(&view).unwrap();
    assert!(first.redrawn && first.objects_drawn == lit.scene.objects.len() as u32);
    let all = names(&first.passes);
    assert!(
        ["G-buffer", "shadow maps", "direct light", "indirect light"].iter().all(|n| all.contains(n)),
        "{all:?}"
    );
    let submissions = renderer.submissions();
    for _ in 0..3 {
        renderer.set_scene(&lit.scene).unwrap();
        let upload = renderer.set_frame(&lit.frame).unwrap();
        assert_eq!((upload.records, upload.bytes), (0, 0));
        assert!(!renderer.draw(&view).unwrap().redrawn);
    }
    assert_eq!(renderer.submissions(), submissions);
    // Other lights of the surfaces: neither geometry nor direct light.
    let mut frame = lit.frame.clone();
    frame.frame = 2;
    frame.vsls[..64].iter_mut().for_each(|r| (r.changed_frame, r.flux) = (2, [0.0; 3]));
    assert_eq!(renderer.set_frame(&frame).unwrap().records, 64);
    let drawn = names(&renderer.draw(&view).unwrap().passes);
    assert!(drawn.contains(&"indirect light"), "{drawn:?}");
    assert!(!drawn.contains(&"G-buffer") && !drawn.contains(&"shadow maps"), "{drawn:?}");
    assert!(!drawn.contains(&"direct light"), "{drawn:?}");
    // A lamp that is dimmed: its shadows stay.
    let mut scene = lit.scene.clone();
    scene.lights[0].light.power *= 0.5;
    renderer.set_scene(&scene).unwrap();
    let drawn = names(&renderer.draw(&view).unwrap().passes);
    assert_eq!(drawn, ["direct light", "composite"]);
    // Only a layer without light: no light is summed.
    let drawn = names(&renderer.draw(&View { show: Show::Layer(LayerKind::Albedo), ..view }).unwrap().passes);
    assert_eq!(drawn, ["composite"]);
}

/// Of 10 000 records in 157 chunks, those of the changed chunks alone are sent, and the picture is that of a renderer
/// that got them all.
#[test]
fn changed_chunks_alone_are_uploaded() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 10000\npool_paths = 4096");
    let Some(mut renderer) = lit.renderer() else { return };
    let view = View { epsilon: 1e-4, ..lit.view(40, 40) };
    renderer.draw(&view).unwrap();
    let mut changed = lit.frame.clone();
    changed.frame = 5;
    for chunk in [3, 77, 156] {
        for record in changed.vsls.iter_mut().skip(chunk * 64).take(64) {
            record.changed_frame = 5;
            record.flux = record.flux.map(|f| f * 3.0);
        }
    }
    let upload = renderer.set_frame(&changed).unwrap();
    let last = changed.vsls.len() - 156 * 64;
    assert_eq!((upload.records, upload.complete), (128 + last.min(64) as u64, false));
    renderer.draw(&view).unwrap();
    let found = renderer.pixels().unwrap();
    let Some(mut fresh) = scenes::Lit { scene: lit.scene.clone(), frame: changed.clone() }.renderer() else {
        return;
    };
    fresh.draw(&view).unwrap();
    assert_eq!(found, fresh.pixels().unwrap());
    // Another segment: everything is sent.
    changed.epoch = 2;
    assert!(renderer.set_frame(&changed).unwrap().complete);
}

/// Objects beside and behind the eye are not drawn.
#[test]
fn unseen_objects_are_not_drawn() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 50\npool_paths = 1024");
    let Some(mut renderer) = lit.renderer() else { return };
    let mut view = lit.view(32, 32);
    let all = renderer.draw(&view).unwrap().objects_drawn;
    view.camera.forward = -view.camera.forward;
    let behind = renderer.draw(&view).unwrap().objects_drawn;
    assert!(all == lit.scene.objects.len() as u32 && behind < all, "{behind} of {all}");
}

/// An object that moves while a picture without direct light is shown takes its shadow along; a camera that moves leaves
/// the maps as they are.
#[test]
fn shadows_follow_what_moved_behind_another_layer() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 50\npool_paths = 1024");
    let Some(mut renderer) = lit.renderer() else { return };
    renderer.set_timed(true);
    let view = View { show: Show::Layer(LayerKind::Direct), ..lit.view(64, 64) };
    renderer.draw(&view).unwrap();
    let before = renderer.pixels().unwrap();
    let sphere = lit.scene.object("sphere").unwrap();
    let mut place = lit.scene.objects[sphere.0 as usize].world_from_rest;
    place.translation.x -= 0.3;
    let moved = lit.scene.with_object_placed(sphere, place).unwrap();
    renderer.set_scene(&moved).unwrap();
    renderer.draw(&View { show: Show::Layer(LayerKind::Albedo), ..view }).unwrap();
    renderer.draw(&view).unwrap();
    let found = renderer.pixels().unwrap();
    let Some(mut fresh) = scenes::Lit { scene: moved, frame: lit.frame.clone() }.renderer() else { return };
    fresh.draw(&view).unwrap();
    assert!(found == fresh.pixels().unwrap() && found != before);
    let passes = renderer.draw(&View { jitter: [0.4, 0.5], ..view }).unwrap().passes;
    let names: Vec<_> = passes.iter().map(|p| p.name).collect();
    assert!(names.contains(&"direct light") && !names.contains(&"shadow maps"), "{names:?}");
}

/// Changed records are on the device even if the picture that should have taken them there was given up, and layers of one
/// light show that light alone.
#[test]
fn a_picture_that_is_refused_loses_no_records() {
    let lit = scenes::cornell(LAMPS[1].1, "vsls = 200\npool_paths = 4096");
    let Some(mut renderer) = lit.renderer() else { return };
    let view = lit.view(32, 32);
    renderer.draw(&view).unwrap();
    let mut changed = lit.frame.clone();
    changed.frame = 2;
    changed.vsls.iter_mut().for_each(|r| (r.changed_frame, r.flux) = (2, r.flux.map(|f| 2.0 * f)));
    assert!(!renderer.set_frame(&changed).unwrap().complete);
    let stop = std::sync::atomic::AtomicBool::new(true);
    let watch = photonstream_renderer::Watch { progress: None, cancelled: Some(&stop) };
    let rays = View { visibility: photonstream_scene::Visibility::Rays, ..view };
    assert!(renderer.draw_watched(&rays, watch).unwrap().stopped);
    renderer.draw(&view).unwrap();
    let found = renderer.pixels().unwrap();
    let Some(mut fresh) = scenes::Lit { scene: lit.scene.clone(), frame: changed }.renderer() else { return };
    fresh.draw(&view).unwrap();
    assert!(found == fresh.pixels().unwrap());
    let alone = View { only_light: Some(0), show: Show::Layer(LayerKind::Indirect), ..view };
    let moved = View { jitter: [0.1, 0.9], ..alone };
    renderer.draw(&moved).unwrap();
    let found = renderer.pixels().unwrap();
    fresh.draw(&moved).unwrap();
    assert!(found == fresh.pixels().unwrap());
}
