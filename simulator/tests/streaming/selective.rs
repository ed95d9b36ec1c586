//! Only what a change concerns is traced again, and the light is that of tracing everything again, bit for bit.
#![allow(clippy::unwrap_used)]

use crate::{
    edits::{Random, values},
    support,
};
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_simulator::{
    change::Change,
    ledger::{Ledger, Migration},
    simulation::Simulation,
    tracer::{PathBatch, Wave},
};
use serde_json::json;
use std::sync::Arc;

/// A room whose every property can be another.
#[derive(Clone)]
struct Room {
    ball: [f64; 3],
    turn: [f64; 3],
    radius: f64,
    shelf: bool,
    albedo: f64,
    bulb: [f64; 3],
    power: f64,
    lamps: usize,
    lamp_power: f64,
    vsls: u32,
    pool: u32,
    columns: u32,
}

impl Room {
    fn text(&self) -> String {
        let Self { ball, turn, radius, albedo, bulb, power, lamp_power, vsls, pool, columns, .. } = self;
        let shelf = "[object.shelf]\nmaterial = \"a\"\nposition_m = [-0.6, -0.3, 0.4]\nbox = { size_m = [0.5, 0.05, 0.4] }\n";
        let lamps: String = (0..self.lamps)
            .map(|i| format!("[light.lamp{i}]\npower_w = [{lamp_power:?}, {i}, 2]\nspot = {{ position_m = [-0.8, 0, 0.{i}], target_m = [0, 0, 0], outer_half_angle_deg = 40 }}\n"))
            .collect();
        format!(
            "origin_m = [0, 0, 0]\n\
             [material.a]\nalbedo = [0.8, 0.5, 0.3]\n[material.b]\nalbedo = {albedo:?}\n\
             [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
             [object.ball]\nmaterial = \"b\"\nposition_m = {ball:?}\nrotation_deg = {turn:?}\nsphere = {{ radius_m = {radius:?}, segments = 12 }}\n\
             [object.crate]\nmaterial = \"b\"\nposition_m = [0.5, -0.5, 0.2]\nbox = {{ size_m = [0.3, 0.4, 0.5] }}\n\
             {}[light.bulb]\npower_w = {power:?}\npoint = {{ position_m = {bulb:?} }}\n{lamps}\
             [light.sun]\nirradiance_w_m2 = 1\ndirectional = {{ direction = [1, -2, 1] }}\n\
             [streaming]\nvsls = {vsls}\npool_paths = {pool}\nlight_columns = {columns}\n",
            if self.shelf { shelf } else { "" },
        )
    }

    fn scene(&self) -> Arc<Scene> {
        Arc::new(support::scene(&self.text()))
    }

    /// Another value somewhere.
    fn change(&mut self, random: &mut Random) {
        let place = random.place();
        match random.below(12) {
            0 | 1 => self.ball = place,
            2 => self.turn = place.map(|x| 300.0 * x),
            3 => self.radius = 0.1 + 0.25 * random.next(),
            4 => self.shelf = !self.shelf,
            5 => self.albedo = 0.9 * random.next(),
            6 => self.bulb = place,
            7 => self.power = if random.next() < 0.2 { 0.0 } else { 20.0 * random.next() },
            8 => self.lamps = random.below(4),
            11 => self.lamp_power = if random.next() < 0.3 { 0.0 } else { 9.0 * random.next() },
            9 => self.vsls = 60 + random.below(100) as u32,
            _ => self.pool = 1500 + random.below(3000) as u32,
        }
    }
}

fn first() -> Room {
    Room {
        ball: [0.1, 0.0, -0.2],
        turn: [0.0; 3],
        radius: 0.3,
        shelf: false,
        albedo: 0.5,
        bulb: [0.7, 0.7, 0.7],
        power: 3.0,
        lamps: 2,
        lamp_power: 1.0,
        vsls: 100,
        pool: 3000,
        columns: 8,
    }
}

fn assert_is_traced_anew(ledger: &Ledger, simulation: &Simulation, what: &str) {
    let expected = simulation.fill();
    assert!(ledger.is_converged() && ledger.stale_paths() == 0, "{what}");
    assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux(), "{what}");
    let flux =
        |ledger: &Ledger| -> Vec<Vec3> { ledger.readings(&simulation.scene).map(|r| r.flux).collect() };
    assert_eq!(flux(ledger), flux(&expected), "{what}");
}

/// N = 1 000 changes, seed 9, of place, turn, size, colour, light, number of lights and paths, objects added and removed;
/// tasks are under way at each, and up to 12 are traced between two; every 25th is traced to its end, and the pool then
/// split by variance. Columns of their own and a shared one; 1 and 4 threads. Exact: no tolerance.
#[test]
fn a_thousand_changes_end_in_the_light_of_a_full_trace() {
    for (columns, threads) in [(8, 1), (8, 4), (2, 1), (2, 4)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut room = Room { columns, ..first() };
            let mut simulation = Simulation::new(room.scene());
            let mut ledger = simulation.fill();
            let mut random = Random(9);
            let mut splits = 0;
            for step in 1..=1000 {
                let under_way: Vec<_> =
                    std::iter::from_fn(|| ledger.next_task()).take(random.below(3)).collect();
                room.change(&mut random);
                let next = simulation.reloaded(room.scene());
                ledger = ledger.migrate(&Migration::between(&simulation, &next), &next, None);
                for task in under_way {
                    let mut batch = PathBatch::default();
                    simulation.tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
                    ledger.apply(task, batch, 0);
                }
                simulation = next;
                simulation.advance(&mut ledger, random.below(13) as u64);
                if step % 25 == 0 {
                    simulation.advance(&mut ledger, u64::MAX);
                    assert_is_traced_anew(&ledger, &simulation, &format!("step {step}, {columns} columns"));
                    if let Some(slots) = ledger.better_split(&simulation.scene) {
                        let next = simulation.with_split(&slots);
                        ledger = ledger.resplit(&simulation, &next);
                        simulation = next;
                        splits += 1;
                    }
                }
            }
            assert!(splits >= 5, "{splits}");
        });
    }
}

/// A ball moved by its radius concerns a part of the paths; the rays of the others are saved. An albedo concerns those
/// that met it, a number of lights none.
#[test]
fn what_a_change_does_not_concern_is_not_traced_again() {
    let room = first();
    let simulation = Simulation::new(room.scene());
    let slots = simulation.emitters.slots;
    let stale_after = |change: &dyn Fn(&mut Room)| {
        let mut other = room.clone();
        change(&mut other);
        let next = simulation.reloaded(other.scene());
        let mut ledger = simulation.fill().migrate(&Migration::between(&simulation, &next), &next, None);
        let stale = ledger.stale_paths();
        next.advance(&mut ledger, u64::MAX);
        assert_is_traced_anew(&ledger, &next, "one change");
        (stale, ledger.savings())
    };
    let (stale, savings) = stale_after(&|room| room.ball[0] += 0.3);
    assert!(stale > slots / 20 && stale < slots / 2, "{stale} of {slots}");
    assert!(savings.retraced_paths == u64::from(stale) && savings.rays_saved > u64::from(slots - stale));
    let (recoloured, _) = stale_after(&|room| room.albedo = 0.2);
    assert!(recoloured > slots / 20 && recoloured < slots / 2, "{recoloured} touched ball or crate");
    assert_eq!(stale_after(&|room| room.vsls = 57).0, 0);
    assert_eq!(stale_after(&|room| room.power = 9.0).0, 0);
    assert_eq!(stale_after(&|room| room.shelf = true).0, stale_after(&|room| room.shelf = true).0);
    let (moved, _) = stale_after(&|room| room.bulb = [0.5; 3]);
    let bulb = simulation.emitters.lights[0].slots.clone();
    assert_eq!(moved, bulb.end - bulb.start);
}

/// A stale path goes on from the last point before what it met: N = 40 random edits one after another, seed 3, up to two
/// tasks traced between, so that paths are stale by several of them. Every batch is that of tracing its paths from their
/// light, bit for bit, with fewer rays: the saved ones are counted, and none of the others.
#[test]
fn a_path_goes_on_from_where_it_met_the_change() {
    let mut simulation = Simulation::new(first().scene());
    let mut ledger = simulation.fill();
    let mut random = Random(3);
    let (mut rays, mut rays_from_light) = (0, 0);
    for step in 0..40 {
        let mut edit = simulation.scene.edit();
        match step % 4 {
            3 => _ = edit.set_light("bulb", &values(json!({ "position_m": random.place() }))).unwrap(),
            2 => _ = edit.move_object("crate", &values(json!({ "rotation_deg": random.place() }))).unwrap(),
            _ => _ = edit.move_object("ball", &values(json!({ "position_m": random.place() }))).unwrap(),
        }
        let next = simulation.with_scene(Arc::new(edit.finish()));
        ledger.revise(&next, Change::between(&simulation, &next), None);
        simulation = next;
        let tasks = if step % 8 == 7 { usize::MAX } else { random.below(3) };
        for _ in 0..tasks {
            let saved = ledger.savings().rays_saved;
            let Some(task) = ledger.next_task() else { break };
            let saved = ledger.savings().rays_saved - saved;
            let (mut batch, mut from_light) = (PathBatch::default(), PathBatch::default());
            simulation.tracer.resume(&task.draws, &task.begun, &mut Wave::default(), &mut batch);
            simulation.tracer.trace(&task.draws, &mut Wave::default(), &mut from_light);
            rays += batch.counters.rays;
            rays_from_light += from_light.counters.rays;
            assert_eq!(batch.counters.rays + saved, from_light.counters.rays, "step {step}");
            from_light.counters.rays = batch.counters.rays;
            assert_eq!(batch, from_light, "step {step}");
            ledger.apply(task, batch, 0);
        }
    }
    simulation.advance(&mut ledger, u64::MAX);
    assert_is_traced_anew(&ledger, &simulation, "the end");
    println!("{rays} of {rays_from_light} rays");
    assert!(rays * 20 < rays_from_light * 19, "{rays} of {rays_from_light} rays");
}

/// An edit of the running scene: the same selection as for a new text.
#[test]
fn an_edit_concerns_the_paths_that_a_new_text_does() {
    let room = first();
    let simulation = Simulation::new(room.scene());
    let mut edit = simulation.scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0.4, 0.0, -0.2] }))).unwrap();
    let edited = simulation.with_scene(Arc::new(edit.finish()));
    let mut ledger = simulation.fill();
    ledger.revise(&edited, Change::between(&simulation, &edited), None);
    let next = simulation.reloaded(Room { ball: [0.4, 0.0, -0.2], ..room }.scene());
    let migrated = simulation.fill().migrate(&Migration::between(&simulation, &next), &next, None);
    assert_eq!(ledger.stale_paths(), migrated.stale_paths());
    edited.advance(&mut ledger, u64::MAX);
    assert_is_traced_anew(&ledger, &edited, "edit");
}

/// Where more than 400 of 3 000 paths would have to be traced, a moved ball is followed with a smaller pool,
/// which then grows back to all of it.
#[test]
fn a_budget_makes_the_pool_smaller_until_there_is_time() {
    let simulation = Simulation::new(Room { lamps: 0, power: 60.0, ..first() }.scene());
    let mut ledger = simulation.fill();
    let mut edit = simulation.scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0.3, 0.2, 0.2] }))).unwrap();
    let moved = simulation.with_scene(Arc::new(edit.finish()));
    ledger.revise(&moved, Change::between(&simulation, &moved), Some(400));
    let mut whole = simulation.fill();
    whole.revise(&moved, Change::between(&simulation, &moved), None);
    let (stale, all) = (ledger.stale_paths(), whole.stale_paths());
    assert!(all > 400 && stale <= 400 && stale > 100, "{stale} of {all}");
    assert!(ledger.active_slots() < 3000 && !ledger.is_full());
    let mut sizes = vec![ledger.active_slots()];
    while let Some(task) = ledger.next_task() {
        let mut batch = PathBatch::default();
        moved.tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
        ledger.apply(task, batch, 0);
        sizes.push(ledger.active_slots());
    }
    assert!(sizes.is_sorted() && sizes.last() == Some(&3000), "{sizes:?}");
    assert_is_traced_anew(&ledger, &moved, "grown back");
}

/// The error falls with the root of the number of paths: for a third of it nine times as many, in whole rounds.
#[test]
fn a_third_of_the_error_takes_nine_times_the_paths() {
    let room = |target: f64| {
        support::closed_box(0.5, 10.0, &format!("vsls = 60\npool_paths = 4000\ntarget_error = {target:?}"))
    };
    let coarse = support::filled(room(0.0)).1.relative_error();
    let simulation = Simulation::new(Arc::new(room(coarse / 3.0)));
    let mut ledger = simulation.ledger();
    simulation.advance(&mut ledger, u64::MAX);
    let rounds = ledger.refined_paths() as f64 / 4000.0;
    assert!((7.0..=9.0).contains(&rounds), "{rounds}");
}

/// Samples beyond the pool lower the error to the target; recolouring keeps them, a move drops them; the refined light is
/// the same on 1 and 3 threads, and after edits that of a new start.
#[test]
fn light_is_refined_to_the_target_and_no_further() {
    let text = |target: f64| format!("{}target_error = {target:?}\n", Room { lamps: 1, ..first() }.text());
    let start = |target| Simulation::new(Arc::new(support::scene(&text(target))));
    let target = start(0.0).fill().relative_error() / 3.0;
    let refine = |simulation: &Simulation, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut ledger = simulation.ledger();
            simulation.advance(&mut ledger, u64::MAX);
            ledger
        })
    };
    let simulation = start(target);
    let mut ledger = refine(&simulation, 1);
    assert!(ledger.is_done() && ledger.relative_error() <= target, "{} > {target}", ledger.relative_error());
    // The sun stays outside: none of its paths is worth tracing.
    let sun = simulation.emitters.lights.last().unwrap().slots.len() as f64;
    let rounds = ledger.refined_paths() as f64 / (3000.0 - sun);
    assert!((6.0..12.0).contains(&rounds), "{rounds}");
    let flux = |ledger: &Ledger, simulation: &Simulation| -> Vec<Vec3> {
        ledger.readings(&simulation.scene).map(|r| r.flux).collect()
    };
    assert_eq!(flux(&refine(&simulation, 3), &simulation), flux(&ledger, &simulation));

    let refined = ledger.refined_paths();
    let recolour = |simulation: &Simulation, name: &str, power: f64| {
        let mut edit = simulation.scene.edit();
        edit.set_light(name, &values(json!({ "power_w": power }))).unwrap();
        simulation.with_scene(Arc::new(edit.finish()))
    };
    let brighter = recolour(&simulation, "bulb", 3.1);
    ledger.revise(&brighter, Change::between(&simulation, &brighter), None);
    assert_eq!(ledger.refined_paths(), refined);
    let mut edit = brighter.scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0.3, 0.2, 0.2] }))).unwrap();
    let moved = brighter.with_scene(Arc::new(edit.finish()));
    // In the middle of a round.
    let under_way = ledger.next_task();
    ledger.revise(&moved, Change::between(&brighter, &moved), None);
    assert_eq!(ledger.refined_paths(), 0);
    if let Some(task) = under_way {
        let mut batch = PathBatch::default();
        brighter.tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
        ledger.apply(task, batch, 0);
    }
    moved.advance(&mut ledger, u64::MAX);
    assert_eq!(flux(&ledger, &moved), flux(&refine(&moved, 2), &moved));
}

/// Lights in a shared column: another power by a saved config traces what it weighs anew; a light that is added lends its
/// paths' weight to no other; and refining never shows a part of a round. A light's flux is off by at most a tenth of the
/// converged one on the way, but for what is not traced yet.
#[test]
fn lights_in_one_column_do_not_carry_each_other() {
    let text = |powers: &[f64], target: f64| {
        let lamps = powers.iter().enumerate().map(|(i, power)| {
            format!("[light.l{i}]\npower_w = {power:?}\npoint = {{ position_m = [0.{i}, 0.{i}, 0.1] }}\n")
        });
        format!(
            "origin_m = [0, 0, 0]\n[material.a]\nalbedo = 0.5\n\
             [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n{}\
             [streaming]\nvsls = 40\npool_paths = 8000\nlight_columns = 1\ntarget_error = {target:?}\n",
            lamps.collect::<String>()
        )
    };
    let start = |powers: &[f64], target| Simulation::new(Arc::new(support::scene(&text(powers, target))));
    let total = |ledger: &Ledger, simulation: &Simulation| -> f64 {
        ledger.readings(&simulation.scene).map(|r| f64::from(r.flux.x)).sum()
    };
    let before = start(&[10.0, 4.0], 0.0);
    for powers in [&[10.0, 0.0][..], &[10.0, 0.1], &[2.0, 4.0], &[10.0, 4.0, 10.0]] {
        let next = before.reloaded(Arc::new(support::scene(&text(powers, 0.0))));
        let mut ledger = before.fill().migrate(&Migration::between(&before, &next), &next, None);
        let end = total(&next.fill(), &next);
        let most = end.max(total(&before.fill(), &before)) * 1.1;
        while let Some(task) = ledger.next_task() {
            assert!(total(&ledger, &next) <= most, "{} of {end} with {powers:?}", total(&ledger, &next));
            let mut batch = PathBatch::default();
            next.tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
            ledger.apply(task, batch, 0);
        }
        assert_is_traced_anew(&ledger, &next, &format!("{powers:?}"));
    }
    let coarse = before.fill().relative_error();
    let refined = start(&[10.0, 4.0], coarse / 2.5);
    let (mut ledger, whole) = (refined.fill(), total(&before.fill(), &before));
    while let Some(task) = ledger.next_task() {
        let mut batch = PathBatch::default();
        refined.tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
        ledger.apply(task, batch, 0);
        let now = total(&ledger, &refined);
        assert!((now / whole - 1.0).abs() < 0.02, "{now} of {whole}");
    }
    assert!(ledger.refined_paths() > 8000 && ledger.is_converged());
}

/// A stream of fresh samples whose pool was made smaller gets all of it back.
#[test]
fn a_stream_of_fresh_samples_grows_back() {
    let text = format!("{}sampling = \"fresh\"\n", Room { lamps: 0, power: 60.0, ..first() }.text());
    let simulation = Simulation::new(Arc::new(support::scene(&text)));
    let mut ledger = simulation.fill();
    let mut edit = simulation.scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0.3, 0.2, 0.2] }))).unwrap();
    let moved = simulation.with_scene(Arc::new(edit.finish()));
    ledger.revise(&moved, Change::between(&simulation, &moved), Some(300));
    assert!(!ledger.is_full());
    moved.advance(&mut ledger, 60);
    assert!(ledger.is_full() && ledger.is_converged(), "{} slots", ledger.active_slots());
    assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux());
}
