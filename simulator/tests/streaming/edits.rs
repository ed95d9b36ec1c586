//! Edits while paths are traced: the light becomes exactly that of the edited scene, and never goes out on the way.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_simulator::{
    change::{Change, LightRevision},
    ledger::{Ledger, Task},
    simulation::Simulation,
    tracer::{PathBatch, Tracer, Wave},
};
use serde_json::{Map, Value, json};
use std::sync::Arc;

/// A room, two movable bodies, a lamp with a surface, a spot, a bulb and the sun.
pub(crate) fn room(streaming: &str) -> Scene {
    crate::support::scene(&format!(
        "[material.a]\nalbedo = [0.8, 0.5, 0.3]\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
         [object.ball]\nmaterial = \"a\"\nsphere = {{ radius_m = 0.3, segments = 16 }}\n\
         [object.crate]\nmaterial = \"a\"\nposition_m = [0.5, -0.5, 0.2]\nbox = {{ size_m = [0.3, 0.4, 0.5] }}\n\
         [light.bulb]\npower_w = 3\npoint = {{ position_m = [0.7, 0.7, 0.7] }}\n\
         [light.cone]\npower_w = [1, 2, 3]\nspot = {{ position_m = [-0.8, 0, 0], target_m = [0, 0, 0], outer_half_angle_deg = 40 }}\n\
         [light.lamp]\npower_w = 5\nrectangle = {{ corner_m = [-0.2, 0.9, -0.2], edge_u_m = [0.4, 0, 0], edge_v_m = [0, 0, 0.4] }}\n\
         [light.sun]\nirradiance_w_m2 = 1\ndirectional = {{ direction = [1, -2, 1] }}\n\
         [streaming]\nvsls = 120\npool_paths = 6000\n{streaming}\n"
    ))
}

pub(crate) fn values(value: Value) -> Map<String, Value> {
    value.as_object().unwrap().clone()
}

pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    pub(crate) fn place(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.next() * 1.2 - 0.6)
    }
}

fn edit_at_random(scene: &Scene, random: &mut Random) -> Scene {
    let mut edit = scene.edit();
    let place = random.place();
    match random.below(9) {
        0 | 1 => _ = edit.move_object("ball", &values(json!({ "position_m": place }))).unwrap(),
        2 => {
            _ = edit
                .move_object("crate", &values(json!({ "rotation_deg": place.map(|x| 300.0 * x) })))
                .unwrap()
        }
        3 => {
            _ = edit
                .move_object("lamp", &values(json!({ "position_m": [place[0], -0.1, place[2]] })))
                .unwrap()
        }
        // Far out of the room: the sun's beam grows with the bounds.
        4 => _ = edit.move_object("crate", &values(json!({ "position_m": place.map(|x| 9.0 * x) }))).unwrap(),
        5 => _ = edit.set_light("bulb", &values(json!({ "position_m": place }))).unwrap(),
        6 => {
            let keys = json!({ "position_m": place, "outer_half_angle_deg": 10.0 + 60.0 * random.next() });
            edit.set_light("cone", &values(keys)).unwrap();
        }
        7 => {
            let name = ["bulb", "cone", "lamp"][random.below(3)];
            let keys = json!({ "power_w": 20.0 * random.next(), "enabled": random.next() < 0.7 });
            edit.set_light(name, &values(keys)).unwrap();
        }
        _ => {
            let keys =
                json!({ "irradiance_w_m2": 3.0 * random.next(), "direction": [place[0], -1, place[2]] });
            edit.set_light("sun", &values(keys)).unwrap();
        }
    }
    edit.finish()
}

fn readings(ledger: &Ledger, simulation: &Simulation) -> Vec<Vec3> {
    ledger.readings(&simulation.scene).map(|r| r.flux).collect()
}

fn batch_of(tracer: &Tracer, task: &Task) -> PathBatch {
    let mut batch = PathBatch::default();
    tracer.trace(&task.draws, &mut Wave::default(), &mut batch);
    batch
}

/// N = 50 random edits, seed 5, with up to 8 batches under way in the version before and up to 20 tasks traced between;
/// every fifth version is traced to its end. Columns of their own, and three lights in a shared one; 1 and 4 threads.
/// Exact: no tolerance.
#[test]
fn random_edits_end_in_the_light_of_the_edited_scene() {
    for (columns, threads) in [(8, 1), (8, 4), (2, 1), (2, 4)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let first = Simulation::new(Arc::new(room(&format!("light_columns = {columns}"))));
            let mut simulation = first.clone();
            let mut ledger = simulation.ledger();
            let mut random = Random(5);
            for step in 1..=50 {
                let under_way: Vec<Task> =
                    std::iter::from_fn(|| ledger.next_task()).take(random.below(9)).collect();
                let next = simulation.with_scene(Arc::new(edit_at_random(&simulation.scene, &mut random)));
                ledger.revise(&next, Change::between(&simulation, &next), None);
                // Those of the old version arrive late, the last ones first.
                for task in under_way.into_iter().rev() {
                    let batch = batch_of(&simulation.tracer, &task);
                    ledger.apply(task, batch, 0);
                }
                simulation = next;
                simulation.advance(&mut ledger, random.below(21) as u64);
                assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux());
                if step % 5 == 0 {
                    simulation.advance(&mut ledger, u64::MAX);
                    assert!(ledger.is_done() && ledger.is_converged() && ledger.stale_paths() == 0);
                    let fresh = first.with_scene(Arc::clone(&simulation.scene));
                    let expected = fresh.fill();
                    assert!(ledger.pool().flux() == expected.pool().flux(), "step {step}, {columns} columns");
                    assert_eq!(readings(&ledger, &simulation), readings(&expected, &fresh));
                }
            }
        });
    }
}

/// With the lights' powers as they were, a simulation started anew places and splits alike: the same light again.
#[test]
fn moves_end_in_the_light_of_a_new_simulation() {
    let first = Simulation::new(Arc::new(room("")));
    let mut edit = first.scene.edit();
    edit.move_object(
        "ball",
        &values(json!({ "position_m": [0.4, 0.1, -0.3], "rotation_deg": [10, 20, 30] })),
    )
    .unwrap();
    edit.set_light("bulb", &values(json!({ "position_m": [0, -0.7, 0.6] }))).unwrap();
    let scene = Arc::new(edit.finish());
    let moved = first.with_scene(Arc::clone(&scene));
    let mut ledger = first.fill();
    ledger.revise(&moved, Change::between(&first, &moved), None);
    moved.advance(&mut ledger, u64::MAX);
    let anew = Simulation::new(scene);
    assert_eq!(anew.placement, moved.placement);
    assert_eq!(anew.owners, moved.owners);
    assert_eq!(anew.emitters, moved.emitters);
    assert_eq!(readings(&ledger, &moved), readings(&anew.fill(), &anew));
}

/// Nothing goes out: until the first batch arrives, and after each, every light that was lit still is; the pool stays
/// full, and the paths that met the ball become new.
#[test]
fn old_light_stays_until_it_is_replaced() {
    let first = Simulation::new(Arc::new(room("")));
    let mut ledger = first.fill();
    let before = readings(&ledger, &first);
    let mut edit = first.scene.edit();
    edit.move_object("ball", &values(json!({ "position_m": [0.2, 0, 0] }))).unwrap();
    let moved = first.with_scene(Arc::new(edit.finish()));
    ledger.revise(&moved, Change::between(&first, &moved), None);
    let slots = ledger.pool().slots();
    let mut stale = ledger.stale_paths();
    assert!(stale > slots / 10 && stale < slots, "{stale} of {slots}");
    assert!(!ledger.is_converged() && !ledger.is_done());
    assert_eq!(readings(&ledger, &moved), before);
    let total: Vec3 = before.iter().sum();
    while let Some(task) = ledger.next_task() {
        let count = task.draws.len() as u32;
        let batch = batch_of(&moved.tracer, &task);
        ledger.apply(task, batch, 0);
        stale -= count;
        assert_eq!(ledger.stale_paths(), stale);
        assert_eq!(ledger.pool().valid().iter().sum::<u32>(), slots);
        // A ball moved by 0.2 m in a room of 2 m moves a few per cent of the light.
        let now: Vec3 = readings(&ledger, &moved).into_iter().sum();
        assert!(((now - total) / total).abs().max_element() < 0.1, "{now} after {total}");
    }
    assert_eq!(stale, 0);
}

#[test]
fn edits_make_stale_what_they_concern() {
    let first = Simulation::new(Arc::new(room("")));
    let shared = Simulation::new(Arc::new(room("light_columns = 2")));
    let concerned = |from: &Simulation, edit: &dyn Fn(&mut photonstream_scene::SceneEdit)| {
        let mut changes = from.scene.edit();
        edit(&mut changes);
        let next = from.with_scene(Arc::new(changes.finish()));
        let change = Change::between(from, &next);
        (0..4).map(|light| change.may_concern(light)).collect::<Vec<_>>()
    };
    let set = |name: &'static str, keys: Value| {
        move |edit: &mut photonstream_scene::SceneEdit| {
            _ = edit.set_light(name, &values(keys.clone())).unwrap()
        }
    };
    // In the order of their names: bulb, cone, lamp, sun.
    assert_eq!(
        concerned(&first, &set("cone", json!({ "position_m": [0, 0, 0.5] }))),
        [false, true, false, false]
    );
    assert_eq!(concerned(&first, &set("bulb", json!({ "power_w": 9 }))), [false; 4]);
    assert_eq!(concerned(&first, &set("sun", json!({ "enabled": false }))), [false; 4]);
    assert_eq!(
        concerned(&first, &|edit| {
            edit.move_object("ball", &values(json!({ "position_m": [0, 0, 0.1] }))).unwrap();
        }),
        [true; 4]
    );
    assert_eq!(
        concerned(&first, &|edit| {
            edit.move_object("ball", &values(json!({ "position_m": [0, 0, 0] }))).unwrap();
        }),
        [false; 4]
    );
    // The shared column of the last three is in units of its strongest path: the cone's, for the blue of its light.
    assert_eq!(concerned(&shared, &set("bulb", json!({ "power_w": 9 }))), [false; 4]);
    assert_eq!(concerned(&shared, &set("lamp", json!({ "power_w": 0.5 }))), [false, false, true, false]);
    assert_eq!(concerned(&shared, &set("cone", json!({ "power_w": 0.5 }))), [false, true, true, true]);
}

/// A power needs no ray: at once exactly what a new pool would say. In a shared column the paths are scaled until they
/// are traced again: to the rounding of deposits, 2⁻²⁴ of a path of which a light has some tens: 1e-4.
#[test]
fn power_is_shown_at_once() {
    for columns in [8, 2] {
        let first = Simulation::new(Arc::new(room(&format!("light_columns = {columns}"))));
        let mut ledger = first.fill();
        let mut edit = first.scene.edit();
        edit.set_light("bulb", &values(json!({ "power_w": [20, 1, 0] }))).unwrap();
        edit.set_light("lamp", &values(json!({ "power_w": 0.25 }))).unwrap();
        edit.set_light("sun", &values(json!({ "enabled": false }))).unwrap();
        let next = first.with_scene(Arc::new(edit.finish()));
        let change = Change::between(&first, &next);
        ledger.revise(&next, change.clone(), None);
        let (now, expected) = (readings(&ledger, &next), readings(&next.fill(), &next));
        if columns == 8 {
            assert_eq!(change.lights, [LightRevision::NONE; 4]);
            assert!((0..4).all(|light| !change.may_concern(light)));
            assert_eq!(now, expected);
            assert!(ledger.is_converged());
        }
        for (now, expected) in now.iter().zip(&expected) {
            assert!(
                (*now - *expected).abs().max_element() <= 1e-4 * expected.max_element(),
                "{now} {expected}"
            );
        }
    }
}

/// All lights off, with batches of the lit scene still under way: exactly nothing, in either kind of column.
#[test]
fn light_switched_off_is_exactly_gone() {
    for columns in [8, 2] {
        let first = Simulation::new(Arc::new(room(&format!("light_columns = {columns}"))));
        let mut ledger = first.fill();
        let mut edit = first.scene.edit();
        edit.move_object("ball", &values(json!({ "position_m": [0.1, 0, 0] }))).unwrap();
        let moved = first.with_scene(Arc::new(edit.finish()));
        ledger.revise(&moved, Change::between(&first, &moved), None);
        let task = ledger.next_task().unwrap();
        let mut edit = moved.scene.edit();
        for name in ["bulb", "cone", "lamp", "sun"] {
            edit.set_light(name, &values(json!({ "enabled": false }))).unwrap();
        }
        let off = moved.with_scene(Arc::new(edit.finish()));
        ledger.revise(&off, Change::between(&moved, &off), None);
        let batch = batch_of(&moved.tracer, &task);
        ledger.apply(task, batch, 0);
        assert!(readings(&ledger, &off).iter().all(|flux| *flux == Vec3::ZERO));
        off.advance(&mut ledger, u64::MAX);
        assert!(readings(&ledger, &off).iter().all(|flux| *flux == Vec3::ZERO));
        assert!(ledger.is_converged());
    }
}

/// Fresh samples go on through edits: what is stale first, no sample twice, and the stream never ends.
#[test]
fn a_stream_of_fresh_samples_replaces_stale_paths_first() {
    let first = Simulation::new(Arc::new(room("sampling = \"fresh\"")));
    let mut ledger = first.fill();
    first.advance(&mut ledger, 3);
    let mut edit = first.scene.edit();
    edit.set_light("cone", &values(json!({ "position_m": [0, 0, 0.5] }))).unwrap();
    let next = first.with_scene(Arc::new(edit.finish()));
    ledger.revise(&next, Change::between(&first, &next), None);
    let cone = next.emitters.lights[1].slots.clone();
    assert_eq!(ledger.stale_paths(), cone.end - cone.start);
    let mut seen = std::collections::HashSet::new();
    for _ in 0..60 {
        let stale = ledger.stale_paths();
        let task = ledger.next_task().unwrap();
        assert!(stale == 0 || task.draws.iter().all(|draw| cone.contains(&draw.slot)));
        assert!(task.draws.iter().all(|draw| draw.generation > 0 && seen.insert(*draw)));
        let batch = batch_of(&next.tracer, &task);
        ledger.apply(task, batch, 0);
    }
    assert!(ledger.is_converged());
}
