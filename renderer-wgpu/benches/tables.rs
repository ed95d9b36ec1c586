//! Turns scenes and numbers of lights into the tables of paper A: time of a picture by each accumulation, with its error.
//!
//! `cargo bench -p photonstream-renderer-wgpu --bench tables [PART [SIZE]]` writes Markdown; PART is `accumulations`,
//! `many`, `uploads` or `passes`, SIZE one of the accumulations' (`800x600`, `1280x1024`). Times are medians of the wall clock until the device has finished. Scenes whose files are
//! missing are left out, loudly.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use glam::Vec3;
use photonstream_protocol::VslFrame;
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, AdapterChoice, Gpu, PassTime, Renderer, Show, View};
use photonstream_scene::{RangeCulling, Scene, SceneConfig, Visibility};
use photonstream_simulator::{records, simulation::Simulation};
use std::{path::Path, sync::Arc, time::Instant};

const SCENES: [&str; 4] = ["cornell-box", "cornell-original", "cornell-knot", "two-rooms"];
const SIZES: [(u32, u32); 2] = [(800, 600), (1280, 1024)];
/// What a range may lose: relative RMSE of the indirect light.
const ALLOWED: f64 = 0.02;

fn main() {
    let only = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    let gpu = Gpu::headless(&AdapterChoice::default()).unwrap();
    println!("Device: {}\n", gpu.name());
    type Part = (&'static str, fn(&Gpu));
    let parts: [Part; 4] =
        [("uploads", uploads), ("passes", passes), ("many", many_lights), ("accumulations", accumulations)];
    for (_, part) in parts.iter().filter(|(name, _)| name.contains(&only)) {
        part(&gpu);
        println!();
    }
}

fn load(name: &str, vsls: u32, pool_paths: u32) -> Option<(Scene, VslFrame)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name).with_extension("toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let text = format!("{text}\n[streaming]\nvsls = {vsls}\npool_paths = {pool_paths}\n");
    let scene = match SceneConfig::from_text(&text, &path).and_then(|config| config.build()) {
        Ok(scene) => Arc::new(scene),
        Err(error) => {
            eprintln!("SKIP {name}: {error}");
            return None;
        }
    };
    let simulation = Simulation::new(Arc::clone(&scene));
    let ledger = simulation.fill();
    let mut vsls = records::vsl_records(&scene, &simulation.placement);
    records::write_flux(&mut vsls, ledger.readings(&scene), 0);
    vsls.iter_mut().for_each(|record| record.changed_frame = 1);
    drop(simulation);
    let frame = VslFrame { epoch: 1, frame: 1, vsls, scene_hash: scene.hash, ..VslFrame::default() };
    Some((Arc::unwrap_or_clone(scene), frame))
}

fn renderer(gpu: &Gpu, scene: &Scene, frame: &VslFrame) -> Renderer {
    let mut renderer = Renderer::new(gpu.clone()).unwrap();
    renderer.set_scene(scene).unwrap();
    renderer.set_frame(frame).unwrap();
    renderer
}

fn view(scene: &Scene, (width, height): (u32, u32)) -> View {
    View {
        width,
        height,
        visibility: Visibility::None,
        epsilon: 0.0,
        culling: RangeCulling::Cut,
        ..View::from_settings(&scene.render, &scene.camera)
    }
}

/// Wall time in ms of a whole picture of a moved camera, until the device has finished: median of `n`.
fn time(renderer: &mut Renderer, view: &View, n: usize) -> f64 {
    let mut times: Vec<f64> = (0..=n)
        .map(|i| {
            let mut view = *view;
            // Another picture each time, so that all of it is drawn, and of the same cost.
            view.jitter[0] = 0.5 + 1e-4 * i as f32;
            let start = Instant::now();
            assert!(renderer.draw(&view).unwrap().redrawn);
            renderer.gpu().wait().unwrap();
            start.elapsed().as_secs_f64() * 1e3
        })
        // The first compiles the shaders.
        .skip(1)
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn indirect(renderer: &mut Renderer, view: &View) -> Vec<Vec3> {
    renderer.draw(&View { show: Show::Layer(LayerKind::Indirect), ..*view }).unwrap();
    renderer.pixels().unwrap()
}

fn rel_rmse(a: &[Vec3], b: &[Vec3]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (*a - *b).as_dvec3().length_squared()).sum();
    let sum: f64 = b.iter().map(|b| b.as_dvec3().element_sum()).sum();
    let n = 3.0 * a.len() as f64;
    (squares / n).sqrt() / (sum / n)
}

/// The largest epsilon, to a factor of 2, whose range loses at most [`ALLOWED`].
fn range(renderer: &mut Renderer, view: &View) -> f32 {
    let small = View { width: 200, height: 150, ..*view };
    let exact = indirect(renderer, &small);
    let mut epsilon = 1e-8;
    while epsilon < 1.0
        && rel_rmse(&indirect(renderer, &View { epsilon: epsilon * 2.0, ..small }), &exact) <= ALLOWED
    {
        epsilon *= 2.0;
    }
    epsilon
}

/// Tables 2 and 3 of paper A, once with every light everywhere and once with a range.
fn accumulations(gpu: &Gpu) {
    let only = std::env::args().skip(1).filter(|a| !a.starts_with('-')).nth(1);
    let wanted = |(w, h): &(u32, u32)| only.as_ref().is_none_or(|only| *only == format!("{w}x{h}"));
    for size in SIZES.into_iter().filter(wanted) {
        println!(
            "### Pictures of {}x{}, ms without a range (with one that costs {:.0} % rel. RMSE at most)\n",
            size.0,
            size.1,
            ALLOWED * 100.0
        );
        println!("| scene | VSLs | forward | splat | tiled | splat / tiled |\n|---|---|---|---|---|---|");
        for name in SCENES {
            for vsls in [10, 50, 100, 200, 1000] {
                let Some((scene, frame)) = load(name, vsls, 1 << 15) else { break };
                let mut renderer = renderer(gpu, &scene, &frame);
                let view = view(&scene, size);
                let epsilon = range(&mut renderer, &view);
                let n = if vsls > 200 { 1 } else { 3 };
                let mut both = |accumulation| {
                    [0.0, epsilon]
                        .map(|epsilon| time(&mut renderer, &View { accumulation, epsilon, ..view }, n))
                };
                let pair = |[whole, ranged]: [f64; 2]| format!("{whole:.0} ({ranged:.0})");
                let tiled = both(Accumulation::Tiled);
                let forward = if vsls <= 200 { pair(both(Accumulation::Forward)) } else { String::new() };
                let splat = both(Accumulation::Splat);
                println!(
                    "| {name} | {} | {forward} | {} | {} | {:.1} ({:.1}) |",
                    frame.vsls.len(),
                    pair(splat),
                    pair(tiled),
                    splat[0] / tiled[0],
                    splat[1] / tiled[1]
                );
            }
        }
        println!();
    }
}

/// What 10 000 lights cost beside 200, at an error that is no larger.
fn many_lights(gpu: &Gpu) {
    let (name, size, paths) = ("cornell-box", (800, 600), 1 << 20);
    let Some((scene, frame)) = load(name, 40_000, paths) else { return };
    let truth = indirect(&mut renderer(gpu, &scene, &frame), &view(&scene, size));
    println!(
        "### {name}, {}x{}, tiled; error of the indirect light against 40 000 lights without a range\n",
        size.0, size.1
    );
    println!(
        "| VSLs | interleave | epsilon | ms | rel. RMSE | of it by range and interleaving | ns per pixel and VSL |"
    );
    println!("|---|---|---|---|---|---|---|");
    for vsls in [200, 1000, 10_000] {
        let Some((scene, frame)) = load(name, vsls, paths) else { return };
        let mut renderer = renderer(gpu, &scene, &frame);
        let view = view(&scene, size);
        let exact = indirect(&mut renderer, &view);
        let ranged = range(&mut renderer, &view);
        for (interleave, epsilon) in [(1, 0.0), (1, ranged), (2, ranged), (4, 0.0), (4, ranged)] {
            let view = View { interleave, epsilon, ..view };
            let found = indirect(&mut renderer, &view);
            let ms = time(&mut renderer, &view, if vsls > 1000 { 1 } else { 3 });
            let per = ms * 1e6 / f64::from(size.0 * size.1) / f64::from(vsls);
            println!(
                "| {vsls} | {interleave} | {epsilon:.1e} | {ms:.0} | {:.3} | {:.3} | {per:.2} |",
                rel_rmse(&found, &truth),
                rel_rmse(&found, &exact)
            );
        }
    }
}

/// Time until changed records are on the device.
fn uploads(gpu: &Gpu) {
    println!("### Uploads, ms until done\n\n| VSLs | all | 2 % changed | share |\n|---|---|---|---|");
    for vsls in [1000, 10_000, 100_000] {
        let Some((scene, mut frame)) = load("cornell-box", vsls, 1 << 12) else { return };
        let mut renderer = renderer(gpu, &scene, &frame);
        let mut median = |change: &dyn Fn(&mut VslFrame)| {
            let mut times: Vec<f64> = (0..21)
                .map(|_| {
                    frame.frame += 1;
                    change(&mut frame);
                    let start = Instant::now();
                    assert!(renderer.set_frame(&frame).unwrap().records > 0);
                    renderer.flush();
                    gpu.wait().unwrap();
                    start.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        let all = median(&|frame| frame.epoch += 1);
        let some = median(&|frame| {
            let number = frame.frame;
            // Whole chunks, spread over all.
            for chunk in frame.vsls.chunks_mut(64).step_by(50) {
                chunk.iter_mut().for_each(|r| r.changed_frame = number);
            }
            frame.chunk_frames = frame.vsls.chunks(64).map(|chunk| chunk[0].changed_frame).collect();
        });
        println!("| {vsls} | {all:.3} | {some:.3} | {:.1} % |", some / all * 100.0);
    }
}

/// Times of passes, and what an unchanged picture costs.
fn passes(gpu: &Gpu) {
    println!("### Passes of one picture of 800x600 with 200 VSLs, ms on the device\n");
    for name in SCENES {
        let Some((scene, frame)) = load(name, 200, 1 << 15) else { continue };
        let mut renderer = renderer(gpu, &scene, &frame);
        renderer.set_timed(true);
        let view = View { light_samples: 4, ..view(&scene, (800, 600)) };
        // The first picture compiles the shaders and draws the shadow maps, which then stay.
        renderer.draw(&View { jitter: [0.6, 0.5], ..view }).unwrap();
        let passes: Vec<PassTime> = renderer.draw(&view).unwrap().passes;
        let list: Vec<_> = passes.iter().map(|p| format!("{} {:.1}", p.name, p.ms)).collect();
        println!("- {name}: {}", list.join(", "));
        let still = renderer.submissions();
        let start = Instant::now();
        for _ in 0..1000 {
            renderer.set_frame(&frame).unwrap();
            assert!(!renderer.draw(&view).unwrap().redrawn);
        }
        assert_eq!(renderer.submissions(), still);
        let us = start.elapsed().as_secs_f64() * 1e3;
        println!("  - unchanged: no work for the device, {us:.2} µs of this process");
    }
}
