//! Virtual surface lights that move to where the light is: which surfaces get more, that no light is lost or traced again on
//! the way, and that what is shown in the end is what a simulation with lights there from the start shows.
#![allow(clippy::unwrap_used)]

use crate::{
    distance_maps::{maps, run},
    service::{PATIENCE, start},
    service_edits::{flux, frame_where, is_converged},
    support,
};
use photonstream_protocol::{Reply, Request, VslFrame};
use photonstream_scene::Scene;
use photonstream_simulator::{
    budgets::Budgets,
    cancel::Cancel,
    distance_maps::{self, Schedule},
    ledger::{Ledger, Migration},
    simulation::Simulation,
    vsl::Vsl,
};
use serde_json::json;
use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

/// Three surfaces of 24 m²: a closed room with a lamp, a cellar without, and a roof in the sun, of which nothing is seen from
/// anywhere else.
fn house(streaming: &str) -> Scene {
    support::scene(&format!(
        "[material.a]\nalbedo = 0.6\n\
         [object.cellar]\nmaterial = \"a\"\nsides = \"back\"\nposition_m = [0, -3, 0]\nbox = {{ size_m = [2, 2, 2] }}\n\
         [object.roof]\nmaterial = \"a\"\nquad = {{ corner_m = [-2, 2, 3], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -6] }}\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
         [light.lamp]\npower_w = 10\npoint = {{ position_m = [0.2, 0.1, 0] }}\n\
         [light.sun]\npower_w = 100\nspot = {{ position_m = [0, 5, 0], direction = [0, -1, 0], outer_half_angle_deg = 20 }}\n\
         [streaming]\nvsls = 300\npool_paths = 4000\nseed = 5\n{streaming}\n"
    ))
}

fn adaptive() -> Simulation {
    Simulation::new(Arc::new(house("adaptive = true")))
}

fn budgets(simulation: &Simulation, ledger: &Ledger) -> Budgets {
    let reaching = ledger.reaching_watts(&simulation.scene, &simulation.placement);
    Budgets::new(&simulation.scene, &simulation.placement, &reaching)
}

/// With lights where a running simulation has them in the end.
fn at_rest(simulation: &Simulation) -> Simulation {
    let moved = simulation.clone().adapted();
    assert!(budgets(&moved, &moved.fill()).next().is_none(), "once they have moved they stay");
    moved
}

/// Light counts that goes on to hit something. In the closed room that is all that paths left there, within the rounding of
/// f32: ρ/(1 - ρ) · 10 W = 15 W in the mean, here with N = 2 000 paths of the lamp within 4 σ = 0.9 W, a path's deposits
/// varying by about 10 W. On the roof and in the cellar it is none.
#[test]
fn light_that_reaches_nothing_counts_for_nothing() {
    let simulation = adaptive();
    let ledger = simulation.fill();
    let reaching = ledger.reaching_watts(&simulation.scene, &simulation.placement);
    let readings: Vec<f64> =
        ledger.readings(&simulation.scene).map(|reading| f64::from(reading.flux.x)).collect();
    let of = |name: &str| {
        let id = simulation.scene.object(name).unwrap();
        let place = simulation.placement.surfaces.iter().position(|(on, _)| on.object == id).unwrap();
        let lights = simulation.placement.surfaces[place].1.clone();
        (reaching[place], readings[lights.start as usize..lights.end as usize].iter().sum::<f64>())
    };
    let (room, flux) = of("room");
    assert!((room / flux - 1.0).abs() < 1e-5 && (room - 15.0).abs() < 0.9, "{room} of {flux} W");
    let (roof, flux) = of("roof");
    assert!(roof == 0.0 && flux > 50.0, "{roof} of {flux} W");
    assert_eq!(of("cellar"), (0.0, 0.0));
    // Three times as dense as the mean where the light is, and an eighth of it elsewhere, of 300 lights.
    let wanted = budgets(&simulation, &ledger).wanted;
    assert_eq!(wanted, [12, 11, 277]);
}

/// The same sums on any number of threads.
#[test]
fn decisions_do_not_depend_on_threads() {
    let simulation = adaptive();
    let ledger = simulation.fill();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| ledger.reaching_watts(&simulation.scene, &simulation.placement))
    };
    assert!(on(1) == on(3) && on(1)[2] > 0.0);
}

/// Lights that stay do not stir, in twelve steps there and back.
#[test]
fn surfaces_that_get_more_lights_keep_theirs() {
    let mut simulation = adaptive();
    let first: Vec<u32> = simulation.placement.shares().collect();
    let places = |simulation: &Simulation, surface: usize| -> HashSet<(u32, [u32; 2])> {
        let lights = simulation.placement.surfaces[surface].1.clone();
        let lights = &simulation.placement.vsls[lights.start as usize..lights.end as usize];
        let place = |vsl: &Vsl| (vsl.triangle, vsl.barycentric.map(f32::to_bits));
        lights.iter().map(place).collect()
    };
    for shares in [[80, 90, 130], [70, 100, 130], [10, 60, 230], [70, 100, 130], [100, 100, 100], [1, 1, 298]]
    {
        let next = simulation.with_shares_unless(&shares, &Cancel::default()).unwrap();
        assert_eq!(next.placement.shares().collect::<Vec<_>>(), shares);
        for (surface, &share) in shares.iter().enumerate() {
            let (before, after) = (places(&simulation, surface), places(&next, surface));
            assert_eq!(after.len(), share as usize, "each light has a place of its own");
            assert!(before.is_subset(&after) || after.is_subset(&before), "surface {surface} with {share}");
        }
        let areas: f32 = next.placement.vsls.iter().map(|vsl| vsl.area).sum();
        assert!((areas - 72.0).abs() < 1e-3, "{areas} m²");
        simulation = next;
    }
    assert_eq!(first, [100, 100, 100]);
}

/// Each deposit goes to the light that owns its place now: no ray is traced, nothing gets lost, and the sums are those of a
/// simulation that has had its lights there from the start, bit for bit.
#[test]
fn deposits_are_split_exactly() {
    let before = adaptive();
    let ledger = before.fill();
    let shares = budgets(&before, &ledger);
    let after = before.with_shares_unless(shares.next().unwrap(), &Cancel::default()).unwrap();
    let total = |ledger: &Ledger| -> [i64; 3] {
        let columns = 0..after.emitters.columns.len() as u32;
        let cells = columns.flat_map(|column| ledger.pool().flux().column(column));
        cells.fold([0; 3], |sum, cell| [0, 1, 2].map(|channel| sum[channel] + cell.rgb[channel]))
    };
    let (paths, quanta) = (ledger.counters().paths, total(&ledger));
    let ledger = ledger.migrate(&Migration::between(&before, &after), &after, None);
    assert!(ledger.is_settled() && ledger.counters().paths == paths);
    assert_eq!(total(&ledger), quanta);
    assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux());
    assert!(ledger.pool().flux() == after.fill().pool().flux());
}

/// Lights that stay keep their maps, the others have those that were traced aside: nothing is traced, or, where they were not,
/// these alone: 16 rays for a coarse map of 16² texels, then 256.
#[test]
fn maps_of_lights_that_stay_are_kept() {
    let before = Simulation::new(Arc::new(house("adaptive = true\ndistance_map_px = 16")));
    let after = before.with_shares_unless(&[60, 90, 150], &Cancel::default()).unwrap();
    let whole = || {
        let mut schedule = Schedule::new(&before, 0).unwrap();
        run(&mut schedule);
        schedule
    };
    let expected = distance_maps::all(&after.scene, &after.placement);
    let mut schedule = Schedule::following(whole(), &after, 1, Vec::new(), &after.scene).unwrap();
    assert_eq!(run(&mut schedule), 50 * (16 + 256));
    assert!(maps(&schedule) == expected);
    let words = expected.len() / 300;
    let traced = expected.chunks(words).zip(0..).map(|(map, vsl)| (vsl, map.into())).collect();
    let mut schedule = Schedule::following(whole(), &after, 1, traced, &after.scene).unwrap();
    assert_eq!(run(&mut schedule), 0);
    assert!(maps(&schedule) == expected && schedule.take_changed().len() == 300);
    // One that was begun is begun again; what has moved since is followed.
    let mut begun = whole();
    let mut edit = before.scene.edit();
    edit.move_object("cellar", json!({ "position_m": [0.5, -3, 0] }).as_object().unwrap()).unwrap();
    let moved = after.with_scene(Arc::new(edit.finish()));
    begun.revise(&before.with_scene(Arc::clone(&moved.scene)));
    let _lost = begun.next_task().unwrap();
    let mut schedule = Schedule::following(begun, &moved, 1, Vec::new(), &after.scene).unwrap();
    run(&mut schedule);
    assert!(maps(&schedule) == distance_maps::all(&moved.scene, &moved.placement));
}

fn lights_on(frame: &VslFrame, scene: &Scene, name: &str) -> usize {
    let id = scene.object(name).unwrap().0;
    frame.vsls.iter().filter(|vsl| vsl.object == id).count()
}

type Places = HashMap<[u32; 6], f64>;

/// The green flux at each place.
fn places(frame: &VslFrame) -> Places {
    let mut places = Places::new();
    for vsl in &frame.vsls {
        let [[x, y, z], [u, v, w]] = [vsl.position, vsl.normal].map(|v| v.map(f32::to_bits));
        // A light may be there twice while its patch becomes another.
        *places.entry([x, y, z, u, v, w]).or_default() += f64::from(vsl.flux[1]);
    }
    places
}

/// A running simulation ends with the lights that one has that moves them before it begins, and with the same light to the last bit, and from
/// the first whole light on no frame has more light or less: within 1e-5, the rounding of sums of 300 numbers in f32. When the
/// lamp goes to the cellar, lights follow it.
#[test]
fn a_running_simulation_moves_its_lights_without_a_flicker() {
    let text = "adaptive = true\npublish_period_ms = 1\ndistance_map_px = 8";
    let simulation = Simulation::new(Arc::new(house(text)));
    let expected = at_rest(&simulation);
    let service = start("adaptive", &simulation, 2, None);
    let mut subscriber = service.attach();
    let (mut totals, mut changes, mut last) = (Vec::new(), Vec::new(), (0, Places::new()));
    let note = |frame: &VslFrame| {
        assert!((300..=600).contains(&frame.vsls.len()), "{} lights", frame.vsls.len());
        if frame.statistics.pool_valid == 4000 {
            totals.push(frame.vsls.iter().map(|vsl| f64::from(vsl.flux[1])).sum::<f64>());
            let now = places(frame);
            let (last_frame, before) = std::mem::replace(&mut last, (frame.frame, now.clone()));
            if !before.is_empty() {
                let at = |places: &Places, place: &[u32; 6]| places.get(place).copied().unwrap_or_default();
                let all: HashSet<_> = now.keys().chain(before.keys()).collect();
                let change: f64 =
                    all.into_iter().map(|place| (at(&now, place) - at(&before, place)).abs()).sum();
                // Whoever reads slowly misses frames.
                changes.push((change / totals[0], (frame.frame - last_frame) as f64));
            }
        }
    };
    let frame = frame_where(&mut subscriber, 0, note, is_converged);
    let light: Vec<[f32; 3]> =
        expected.fill().readings(&expected.scene).map(|reading| reading.flux.to_array()).collect();
    assert!(flux(&frame) == light);
    assert_eq!(frame.statistics.paths_total, 4000, "no path is traced twice");
    assert!(totals.iter().all(|total| (total / totals[0] - 1.0).abs() < 1e-5), "{totals:?}");
    // All light may change its place, twice its sum, by a tenth of the way from one frame to the next at most.
    assert!(changes.iter().all(|&(change, frames)| change < 0.2 * frames), "{changes:?}");
    assert!(
        changes.iter().map(|(change, _)| change).sum::<f64>() > 1.0,
        "most lights have other patches now"
    );
    let all = distance_maps::all(&expected.scene, &expected.placement);
    let texels: Vec<u32> = frame.distances.iter().flat_map(|record| record.texels).collect();
    assert!(texels == all, "the maps are those of the new lights");

    let rooms = |frame: &VslFrame| ["room", "cellar"].map(|name| lights_on(frame, &expected.scene, name));
    assert_eq!(rooms(&frame), [277, 12]);
    let mut client = service.connect();
    let values = json!({ "position_m": [0.2, -2.9, 0] }).as_object().unwrap().clone();
    let reply = client.request(&Request::SetLight { name: "lamp".into(), values }, PATIENCE).unwrap();
    let Reply::Ok { frame } = reply else { panic!("{reply:?}") };
    let frame = frame_where(&mut subscriber, frame, |_| {}, is_converged);
    let [room, cellar] = rooms(&frame);
    assert!(room < 20 && cellar > 260, "{room} in the room, {cellar} in the cellar");
    drop(client);
    service.end();
}

/// Samples beyond the pool are summed in lights that have come to rest alone, and more lights lie as dense as fewer did.
#[test]
fn lights_come_to_rest_before_they_are_refined() {
    let text = "adaptive = true\npublish_period_ms = 1\ntarget_error = 0.05";
    let simulation = Simulation::new(Arc::new(house(text)));
    let expected = at_rest(&simulation);
    let service = start("adaptive-refined", &simulation, 2, None);
    let mut subscriber = service.attach();
    let places = |frame: &VslFrame| frame.vsls.iter().map(|vsl| vsl.position).collect::<Vec<_>>();
    let mut refined = Vec::new();
    let note = |frame: &VslFrame| {
        if frame.statistics.refined_paths > 0 {
            refined.push(places(frame));
        }
    };
    let frame = frame_where(&mut subscriber, 0, note, is_converged);
    let rest: Vec<[f32; 3]> = expected
        .placement
        .vsls
        .iter()
        .map(|vsl| vsl.position_ws(&expected.scene.geometry).to_array())
        .collect();
    assert!(frame.statistics.refined_paths > 0 && refined.iter().all(|places| *places == rest));
    let mut client = service.connect();
    let values = json!({ "vsls": 600 }).as_object().unwrap().clone();
    let reply = client.request(&Request::SetStreaming { values }, PATIENCE).unwrap();
    let Reply::Ok { frame } = reply else { panic!("{reply:?}") };
    // Already in the first frame: 2.77 times as dense in the room as on average, an eighth elsewhere.
    let frame = frame_where(&mut subscriber, frame, |_| {}, |_| true);
    let [room, roof] = ["room", "roof"].map(|name| lights_on(&frame, &expected.scene, name));
    assert!(frame.vsls.len() == 600 && room.abs_diff(550) <= 1 && roof.abs_diff(25) <= 1, "{room} {roof}");
    drop(client);
    service.end();
}

/// Where nothing is said, lights stay where they are placed.
#[test]
fn lights_stay_where_nobody_asks() {
    let simulation = Simulation::new(Arc::new(house("")));
    let service = start("adaptive-not", &simulation, 2, None);
    let mut subscriber = service.attach();
    let frame = frame_where(&mut subscriber, 0, |_| {}, is_converged);
    assert_eq!(lights_on(&frame, &simulation.scene, "room"), 100);
    assert!(simulation.clone().adapted().placement == simulation.placement);
    service.end();
}

/// What was refined says nothing of where light goes, and changes nothing of it: with two lamps in columns of their own, one of them
/// refined beyond the other, decisions are those of the pool.
#[test]
fn decisions_do_not_depend_on_what_was_refined() {
    let simulation = Simulation::new(Arc::new(house("adaptive = true\ntarget_error = 0.02")));
    let mut ledger = simulation.fill();
    let reaching = |ledger: &Ledger| ledger.reaching_watts(&simulation.scene, &simulation.placement);
    let before = reaching(&ledger);
    simulation.advance(&mut ledger, 2000);
    assert!(ledger.refined_paths() > 4000 && reaching(&ledger) == before);
}

/// A change while paused is shown as what it is; lights follow when time goes on.
#[test]
fn nothing_moves_while_paused() {
    let simulation = Simulation::new(Arc::new(house("adaptive = true\npublish_period_ms = 1")));
    let service = start("adaptive-paused", &simulation, 2, None);
    let mut subscriber = service.attach();
    let rest = frame_where(&mut subscriber, 0, |_| {}, is_converged);
    let mut client = service.connect();
    let mut ask = |request: &Request| match client.request(request, PATIENCE).unwrap() {
        Reply::Ok { frame } => frame,
        reply => panic!("{reply:?}"),
    };
    ask(&Request::Pause);
    // A power takes no ray, so that its light is whole while paused.
    let values = json!({ "position_m": [0.2, -2.9, 0] }).as_object().unwrap().clone();
    let dimmed = json!({ "power_w": 2 }).as_object().unwrap().clone();
    let number = ask(&Request::SetLight { name: "sun".into(), values: dimmed });
    let paused = frame_where(&mut subscriber, number, |_| {}, is_converged);
    assert!(places(&paused).len() == places(&rest).len() && paused.vsls.len() == 300);
    ask(&Request::SetLight { name: "lamp".into(), values });
    let number = ask(&Request::Resume);
    let moved = frame_where(&mut subscriber, number, |_| {}, is_converged);
    assert!(lights_on(&moved, &simulation.scene, "cellar") > 260);
    service.end();
}

/// A limit of paths is none of moves: with as many as the pool holds, lights move and come to rest.
#[test]
fn lights_move_at_the_limit_of_paths() {
    let simulation = Simulation::new(Arc::new(house("adaptive = true\npublish_period_ms = 1")));
    let service = start("adaptive-limit", &simulation, 2, Some(4000));
    let mut subscriber = service.attach();
    let frame = frame_where(&mut subscriber, 0, |_| {}, is_converged);
    assert_eq!((lights_on(&frame, &simulation.scene, "room"), frame.vsls.len()), (277, 300));
    service.end();
}

/// In fixed steps lights fade with the scene's time; where that stands still or ends before they have, they come to rest all the
/// same.
#[test]
fn fades_end_where_animations_do() {
    let lamp = "[[animation]]\nlight = \"lamp\"\nproperty = \"position_m\"\nrepeat = \"once\"\n\
                times_s = [0, 0.3, 0.9]\nvalues = [[0.2, 0.1, 0], [0.2, -2.9, 0], [0.2, -2.9, 0]]\n";
    let text = format!("adaptive = true\npublish_period_ms = 1\nfixed_step_ms = 50\n{lamp}");
    let simulation = Simulation::new(Arc::new(house(&text)));
    let service = start("adaptive-steps", &simulation, 2, None);
    let mut subscriber = service.attach();
    let is_over = |frame: &VslFrame| is_converged(frame) && frame.statistics.simulation_time_s >= 0.9;
    let frame = frame_where(&mut subscriber, 0, |_| {}, is_over);
    let cellar = lights_on(&frame, &simulation.scene, "cellar");
    assert!(cellar > 260 && frame.vsls.len() == 300, "{cellar} of {}", frame.vsls.len());
    service.end();
}

/// Another version of the scene, here with another room height, finds lights where they lie, on all that is as it was.
#[test]
fn a_reload_keeps_the_lights_of_what_stays() {
    let rest = at_rest(&adaptive());
    let text = "adaptive = true";
    let mut changed = house(text);
    let mut edit = changed.edit();
    edit.move_object("cellar", json!({ "scale": [1, 0.5, 1] }).as_object().unwrap()).unwrap();
    changed = edit.finish();
    let next = rest.reloaded(Arc::new(changed));
    let on = |simulation: &Simulation, name: &str| -> Vec<(u32, [f32; 2])> {
        let id = simulation.scene.object(name).unwrap();
        let lights = simulation.placement.vsls.iter().filter(|vsl| vsl.surface.object == id);
        lights.map(|vsl| (vsl.triangle, vsl.barycentric)).collect()
    };
    // The cellar's smaller area leaves some lights to the others.
    for name in ["room", "roof"] {
        let (before, after) = (on(&rest, name), on(&next, name));
        assert!(before.iter().all(|light| after.contains(light)), "{name}");
        assert!((before.len()..before.len() + 10).contains(&after.len()), "{name}: {}", after.len());
    }
    assert!(on(&next, "cellar").len() < on(&rest, "cellar").len());
}
