//! Distance maps: what they hold, that only what a change concerns is traced again, and that frames bring them.
#![allow(clippy::unwrap_used)]

use crate::{edits::Random, service, support};
use glam::Vec3;
use photonstream_protocol::{DISTANCE_TEXELS, Reading, Reply, Request, Subscriber, VslFrame};
use photonstream_shading::distance_map::{self, Axes};
use photonstream_simulator::{
    distance_maps::{self, Schedule},
    simulation::Simulation,
};
use serde_json::json;
use std::{sync::Arc, time::Duration};

fn room(edge: u32) -> Simulation {
    Simulation::new(Arc::new(support::scene(&format!(
        "origin_m = [0, 0, 0]\n[material.a]\nalbedo = 0.5\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 1, 3] }}\n\
         [object.ball]\nmaterial = \"a\"\nposition_m = [0.3, 0.1, 0.2]\nsphere = {{ radius_m = 0.2, segments = 12 }}\n\
         [object.crate]\nmaterial = \"a\"\nposition_m = [-0.5, -0.2, 0.8]\nbox = {{ size_m = [0.3, 0.4, 0.5] }}\n\
         [light.bulb]\npower_w = 10\npoint = {{ position_m = [0, 0.3, 0] }}\n\
         [streaming]\nvsls = 120\npool_paths = 2000\ndistance_map_px = {edge}\n"
    ))))
}

/// The maps of a schedule, one after the other.
pub(crate) fn maps(schedule: &Schedule) -> Vec<u32> {
    (0..schedule.len() as u32).flat_map(|vsl| schedule.map(vsl).to_vec()).collect()
}

/// Traces until there is nothing to trace. Returns the number of rays.
pub(crate) fn run(schedule: &mut Schedule) -> u64 {
    let mut rays = 0;
    while let Some(task) = schedule.next_task() {
        let traced = task.run();
        rays += traced.rays;
        schedule.finish(traced);
    }
    assert!(schedule.is_whole());
    rays
}

/// In an empty box of 2 × 1 × 3 m each texel holds the way to the wall, in closed form: within 2⁻¹⁰, the step of a texel, and
/// 10⁻⁵ for the offset of the ray. 50 lights, maps of 16² texels.
#[test]
fn maps_of_an_empty_box_are_its_walls() {
    let streaming = "vsls = 50\npool_paths = 100\ndistance_map_px = 16";
    let simulation = Simulation::new(Arc::new(support::closed_box(0.5, 1.0, streaming)));
    let maps = distance_maps::all(&simulation.scene, &simulation.placement);
    let half = 0.5 * Vec3::new(2.0, 1.0, 3.0);
    let centre = simulation.scene.bounds.centre;
    assert_eq!(maps.len(), 50 * 16 * 16 / 2);
    for (vsl, map) in simulation.placement.vsls.iter().zip(maps.chunks(128)) {
        let geometry = &simulation.scene.geometry;
        let (position, axes) = (vsl.position_ws(geometry) - centre, Axes::of(vsl.normal_ws(geometry)));
        for i in 0..256u32 {
            let direction = axes.world(distance_map::centre(16, i % 16, i / 16));
            let walls = (half.copysign(direction) - position) / direction;
            let expected = walls.min_element();
            let texel = map[i as usize / 2] >> (16 * (i % 2)) & 0xffff;
            let found = 1.0 / distance_map::unpack(texel as u16);
            let relative = found / expected - 1.0;
            assert!((-1e-5..=1.0 / 1024.0 + 1e-5).contains(&relative), "{position}: {found}, {expected}");
        }
    }
}

/// A scene without maps has none, and one with maps traces those of all lights coarsely before any of them whole.
#[test]
fn coarse_maps_come_first() {
    assert!(Schedule::new(&room(0), 0).is_none());
    let simulation = room(32);
    let mut schedule = Schedule::new(&simulation, 7).unwrap();
    let lights = schedule.len();
    let rays: Vec<u64> = std::iter::from_fn(|| {
        let traced = schedule.next_task()?.run();
        let rays = traced.rays;
        schedule.finish(traced);
        Some(rays)
    })
    .collect();
    assert_eq!(rays[..lights], vec![64; lights]);
    assert_eq!(rays[lights..], vec![1024; lights]);
    assert!(maps(&schedule) == distance_maps::all(&simulation.scene, &simulation.placement));
    // Each map has changed, and is told once.
    assert_eq!(schedule.take_changed().len(), lights);
    assert!(schedule.take_changed().is_empty());
}

/// After each of 40 random moves, some of them while maps are under way, the maps are those of tracing everything anew, bit for
/// bit, with fewer rays; seed 11.
#[test]
fn moved_objects_leave_the_maps_of_a_full_trace() {
    let mut random = Random(11);
    let mut simulation = room(16);
    let mut schedule = Schedule::new(&simulation, 0).unwrap();
    let whole = run(&mut schedule);
    let (mut rays, mut moves) = (0, 0);
    for step in 0..40 {
        for _ in 0..1 + random.below(3) {
            let object = ["ball", "crate"][random.below(2)];
            let place = random.place().map(|x| 0.3 * x);
            let mut edit = simulation.scene.edit();
            let turn = random.place().map(|x| 90.0 * x);
            let values = json!({ "position_m": place, "rotation_deg": turn });
            edit.move_object(object, values.as_object().unwrap()).unwrap();
            simulation = simulation.with_scene(Arc::new(edit.finish()));
            schedule.revise(&simulation);
            moves += 1;
            // Some are on their way when the next move comes, and arrive after it.
            let begun: Vec<_> = (0..random.below(50)).map_while(|_| schedule.next_task()).collect();
            if step % 2 == 0 {
                let mut edit = simulation.scene.edit();
                edit.move_object(
                    "ball",
                    json!({ "position_m": random.place().map(|x| 0.3 * x) }).as_object().unwrap(),
                )
                .unwrap();
                simulation = simulation.with_scene(Arc::new(edit.finish()));
                schedule.revise(&simulation);
                moves += 1;
            }
            for task in begun {
                let traced = task.run();
                rays += traced.rays;
                schedule.finish(traced);
            }
        }
        rays += run(&mut schedule);
        let expected = distance_maps::all(&simulation.scene, &simulation.placement);
        assert!(maps(&schedule) == expected, "step {step}");
    }
    assert!(rays < moves * whole / 2, "{rays} rays for {moves} moves, {whole} for all");
    // What another schedule has begun is not taken in.
    let mut other = Schedule::new(&room(16), 1).unwrap();
    schedule.finish(other.next_task().unwrap().run());
    assert!(schedule.is_whole());
}

fn texels(frame: &VslFrame) -> Vec<u32> {
    frame.distances.iter().flat_map(|record| record.texels).collect()
}

/// The next frame that has converged.
fn converged(subscriber: &mut Subscriber, after: u64) -> VslFrame {
    let deadline = std::time::Instant::now() + service::PATIENCE;
    while std::time::Instant::now() < deadline {
        if subscriber.read().unwrap() == Reading::New {
            let frame = subscriber.frame().unwrap();
            if frame.statistics.converged == 1 && frame.frame >= after {
                return frame.clone();
            }
        }
        subscriber.wait(Duration::from_millis(50));
    }
    panic!("no converged frame within {:?}", service::PATIENCE);
}

/// Frames bring the maps of the present scene once they say that they have converged: at first, after an object has moved, and
/// after the lights were placed anew with larger maps and with none.
#[test]
fn frames_bring_the_maps() {
    let simulation = room(16);
    let service = service::start("maps", &simulation, 2, None);
    let mut subscriber = service.attach();
    let first = converged(&mut subscriber, 1);
    assert_eq!(first.distances.len(), 120 * 256 / DISTANCE_TEXELS);
    assert!(texels(&first) == distance_maps::all(&simulation.scene, &simulation.placement));

    let mut client = service.connect();
    let mut ask = |request: &Request| match client.request(request, Duration::from_secs(60)).unwrap() {
        Reply::Ok { frame } => frame,
        other => panic!("{other:?}"),
    };
    let values = json!({ "position_m": [-0.4, 0.2, -0.9] }).as_object().unwrap().clone();
    let shown = ask(&Request::MoveObject { name: "ball".into(), values: values.clone() });
    let mut edit = simulation.scene.edit();
    edit.move_object("ball", &values).unwrap();
    let moved = simulation.with_scene(Arc::new(edit.finish()));
    let frame = converged(&mut subscriber, shown);
    assert!(texels(&frame) == distance_maps::all(&moved.scene, &moved.placement));
    assert!(texels(&frame) != texels(&first));

    for (px, pieces) in [(32, 120 * 32), (0, 0)] {
        let values = json!({ "distance_map_px": px }).as_object().unwrap().clone();
        let shown = ask(&Request::SetStreaming { values });
        let frame = converged(&mut subscriber, shown);
        assert_eq!(frame.distances.len(), pieces, "{px}");
    }
    drop(subscriber);
    service.end();
}
