//! Turns imported records into the claim that their picture is that of uploaded ones.
#![allow(clippy::unwrap_used)]

use super::{
    tests::{Channel, importing, publish},
    *,
};
use crate::{Renderer, Show, View};
use photonstream_protocol::{AccessMode, Reading};
use photonstream_renderer::LayerKind;
use photonstream_scene::{SceneConfig, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::{records, simulation::Simulation};
use std::{path::Path, sync::Arc};

/// Layers with light and with owners, bit for bit; and uploading goes on after importing. 200 lights, 40 × 40 pixels.
#[test]
fn imported_lights_make_the_picture_of_uploaded_ones() {
    let Some(gpu) = importing() else { return };
    let text = include_str!("../../../configs/cornell-box.toml");
    let text = format!("{text}\n[streaming]\nvsls = 200\npool_paths = 4096\n");
    let scene = SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap();
    let simulation = Simulation::new(Arc::new(scene.clone()));
    let ledger = simulation.fill();
    let mut vsls = records::vsl_records(&scene, &simulation.placement);
    records::write_flux(&mut vsls, ledger.readings(&scene), 0);
    let mut channel = Channel::new(vsls.len() as u32);
    let mut subscriber = channel.subscriber(AccessMode::Mapped);
    let mut imported = ImportedSegment::new(&gpu, &subscriber).unwrap();
    publish(&mut channel.publisher, &vsls);
    assert_eq!(subscriber.read().unwrap(), Reading::New);
    let frame = subscriber.frame().unwrap();
    assert!(imported.copy_newest(&gpu).unwrap().is_some());

    let mut renderer = Renderer::new(gpu).unwrap();
    renderer.set_scene(&scene).unwrap();
    let view = View {
        width: 40,
        height: 40,
        visibility: Visibility::None,
        kernel: Kernel::Disc,
        ..View::from_settings(&scene.render, &scene.camera)
    };
    let shows = [Show::Layer(LayerKind::Full), Show::Layer(LayerKind::Flux), Show::Discs];
    let draw = |renderer: &mut Renderer| {
        shows.map(|show| {
            renderer.draw(&View { show, ..view }).unwrap();
            renderer.pixels().unwrap()
        })
    };
    renderer.set_imported(&imported).unwrap();
    // Polygons do not come with a segment: that is told, not drawn as something else.
    let refused = renderer.draw(&View { kernel: Kernel::Patch, ..view }).unwrap_err().to_string();
    assert!(refused.contains("kernel patch"), "{refused}");
    let found = draw(&mut renderer);
    assert!(renderer.set_frame(frame).unwrap().complete);
    assert!(found == draw(&mut renderer));
    assert!(found[0].iter().any(|p| p.x > 0.0) && found[0] != found[1]);
}
