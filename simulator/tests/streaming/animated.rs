//! Scenes that move: each frame's light is that of the scene standing still where it is.
#![allow(clippy::unwrap_used)]

use crate::{
    service::{PATIENCE, start, start_with},
    service_edits::{flux, frame_where, is_converged},
};
use photonstream_protocol::{Reply, Request};
use photonstream_scene::{Scene, SceneConfig};
use photonstream_simulator::{service::Options, simulation::Simulation};
use std::{path::Path, sync::Arc, time::Duration};

const CONFIGS: [&str; 3] = ["cornell-light.toml", "cornell-ball.toml", "door-room.toml"];

fn config(name: &str, vsls: u32, pool: u32) -> SceneConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
    let mut config = SceneConfig::from_file(&path).unwrap();
    config.streaming.vsls = Some(vsls);
    config.streaming.pool_paths = Some(pool);
    config
}

/// 20 instants of each animated config, 150 lights of 4 096 paths, in steps of fixed length: the published light is that
/// of a new simulation of the scene frozen there, bit for bit.
#[test]
fn every_frame_is_that_of_the_frozen_scene() {
    for name in CONFIGS {
        let mut moving = config(name, 150, 4096);
        let period = moving.clone().build().unwrap().animation.period_s().unwrap();
        // Not a part of the period, so that the instants differ.
        moving.streaming.fixed_step_ms = Some(period * 1e3 / 61.7);
        moving.streaming.publish_period_ms = Some(1.0);
        let simulation = Simulation::new(Arc::new(moving.clone().build().unwrap()));
        let service = start(&format!("moving-{}", &name[..6]), &simulation, 2, None);
        let mut subscriber = service.attach();
        let mut seen: Vec<(f64, Vec<[f32; 3]>)> = Vec::new();
        while seen.len() < 20 {
            let last = seen.last().map_or(-1.0, |(time, _)| *time);
            let frame = frame_where(&mut subscriber, 1, |_| (), |f| f.statistics.simulation_time_s > last);
            assert_eq!(frame.statistics.stale_share, 0.0, "{name}: only whole light is shown");
            seen.push((frame.statistics.simulation_time_s, flux(&frame)));
        }
        service.end();
        let mut differ = 0;
        for (time, flux) in &seen {
            let frozen = Arc::new(moving.at(*time).unwrap().build().unwrap());
            let still = Simulation::new(frozen);
            let expected: Vec<_> = still.fill().readings(&still.scene).map(|r| r.flux.to_array()).collect();
            assert!(*flux == expected, "{name} at {time} s");
            differ += u32::from(*flux != seen[0].1);
        }
        assert!(differ > 5, "{name} moves");
    }
}

/// Light that falls into the room, W: the flux of what is wholly inside.
fn inside(scene: &Scene, simulation: &Simulation) -> f64 {
    let outside = ["door", "left-post", "right-post", "lintel", "sill"];
    let is_inside = |object: u32| !outside.contains(&scene.objects[object as usize].name.as_str());
    let vsls = simulation.placement.vsls.iter().map(|vsl| vsl.surface.object.0);
    let fluxes =
        simulation.fill().readings(scene).map(|r| f64::from(r.flux.element_sum())).collect::<Vec<_>>();
    vsls.zip(fluxes).filter(|(object, _)| is_inside(*object)).map(|(_, flux)| flux).sum()
}

/// The door room, 2¹⁷ paths: exactly no light inside until the door opens, and the more the wider it is open.
#[test]
fn no_light_enters_a_closed_room() {
    let config = config("door-room.toml", 500, 1 << 17);
    let at = |time: f64| {
        let simulation = Simulation::new(Arc::new(config.at(time).unwrap().build().unwrap()));
        inside(&simulation.scene, &simulation)
    };
    for closed in [0.0, 0.9, 13.5] {
        assert_eq!(at(closed), 0.0, "at {closed} s");
    }
    let opening: Vec<f64> = [1.0, 2.0, 2.5, 3.0, 3.5, 4.0].into_iter().map(at).collect();
    assert!(opening[1] > 0.0 && opening.windows(2).all(|pair| pair[1] > pair[0]), "{opening:?}");
}

/// The same while the door swings, in one simulation that traces only what the door concerns: dark, lit, and exactly dark
/// again.
#[test]
fn light_leaves_no_trace_in_a_room_that_is_closed_again() {
    let config = config("door-room.toml", 200, 1 << 14);
    let mut simulation = Simulation::new(Arc::new(config.build().unwrap()));
    let mut ledger = simulation.fill();
    let mut seen = Vec::new();
    for time in [0.5, 2.0, 4.0, 7.0, 11.0, 14.0] {
        let mut edit = simulation.scene.edit();
        simulation.scene.animation.apply(time, &mut edit).unwrap();
        let next = simulation.with_scene(Arc::new(edit.finish()));
        let change = photonstream_simulator::change::Change::between(&simulation, &next);
        ledger.revise(&next, change, None);
        next.advance(&mut ledger, u64::MAX);
        simulation = next;
        let expected = inside(&simulation.scene, &simulation);
        let floor = simulation.scene.object("floor").unwrap();
        let lit: f64 = ledger
            .readings(&simulation.scene)
            .zip(&simulation.placement.vsls)
            .filter(|(_, vsl)| vsl.surface.object == floor)
            .map(|(reading, _)| f64::from(reading.flux.element_sum()))
            .sum();
        seen.push(lit);
        assert_eq!(lit > 0.0, expected > 0.0, "at {time} s");
    }
    assert!(seen[0] == 0.0 && seen[2] > 0.0 && seen[3] > seen[1] && seen[5] == 0.0, "{seen:?}");
}

/// Time stands still in a pause, goes on by steps, and with the clock again.
#[test]
fn a_pause_holds_time() {
    let mut config = config("cornell-ball.toml", 60, 1024);
    config.streaming.publish_period_ms = Some(5.0);
    let simulation = Simulation::new(Arc::new(config.build().unwrap()));
    let service = start_with("held", &simulation, Options { threads: Some(1), ..Options::default() });
    let mut subscriber = service.attach();
    let mut client = service.connect();
    let time = |frame: &photonstream_protocol::VslFrame| frame.statistics.simulation_time_s;
    frame_where(&mut subscriber, 1, |_| (), |f| time(f) > 0.05);
    let mut ask = |request: Request| {
        let Reply::Ok { frame } = client.request(&request, PATIENCE).unwrap() else { panic!() };
        frame
    };
    let number = ask(Request::Pause);
    let paused = frame_where(&mut subscriber, number, |_| (), |_| true);
    std::thread::sleep(Duration::from_millis(200));
    subscriber.read().unwrap();
    assert_eq!(time(subscriber.frame().unwrap()), time(&paused));
    let number = ask(Request::Step);
    let stepped = frame_where(&mut subscriber, number, |_| (), |_| true);
    assert!((time(&stepped) - time(&paused) - 0.005).abs() < 1e-9, "{} {}", time(&stepped), time(&paused));
    ask(Request::Resume);
    frame_where(&mut subscriber, 1, |_| (), |f| time(f) > time(&stepped) + 0.05);
    service.end();
}

/// A still scene: 1 000 frames that were asked for are identical, and of no light is ever a bit another.
#[test]
fn a_still_scene_does_not_flicker() {
    let mut still = config("cornell-box.toml", 100, 4096);
    still.streaming.publish_period_ms = Some(0.1);
    let simulation = Simulation::new(Arc::new(still.build().unwrap()));
    let service = start("still", &simulation, 2, None);
    let mut subscriber = service.attach();
    let mut client = service.connect();
    let first = frame_where(&mut subscriber, 1, |_| (), is_converged);
    let mut seen = 0;
    for _ in 0..1000 {
        // A step makes a frame, whether there is anything new or not.
        let Reply::Ok { frame: number } = client.request(&Request::Step, PATIENCE).unwrap() else { panic!() };
        let frame = frame_where(&mut subscriber, number, |_| (), |_| true);
        assert!(flux(&frame) == flux(&first) && frame.frame > first.frame);
        seen += 1;
    }
    assert_eq!(seen, 1000);
    service.end();
}
