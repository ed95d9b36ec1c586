//! Turns a scene into virtual surface lights the way paper A is written: f32 sums, the oldest impacts taken back.
//!
//! Each thread of the paper's simulator owns nothing; one array of f32 holds the flux. After the pool is full, every new
//! path adds what it leaves and the oldest takes away what it left, so that rounding stays behind: paper A's Algorithm 2.
//! Here a slot is a whole path where the paper's is one impact; that changes nothing of what is summed.

use crate::EvaluateError;
use glam::Vec3;
use photonstream_renderer::VslSet;
use photonstream_simulator::{
    flux::QUANTUM,
    records,
    simulation::Simulation,
    tracer::{Draw, PathBatch, Wave},
};
use rayon::prelude::*;
use std::time::Instant;

/// Turns of the pool before it is read: rounding has had its time.
const TURNS: u32 = 4;
const PATHS_PER_BATCH: usize = 512;

/// The lights, and the time of one turn of the pool in ms.
pub(super) fn lights(simulation: &Simulation) -> Result<(VslSet, f64), EvaluateError> {
    let scene = &simulation.scene;
    let scales = simulation.emitters.column_watts(scene);
    let mut flux = vec![Vec3::ZERO; simulation.placement.vsls.len()];
    let slots: Vec<(Vec<u32>, Vec3)> = simulation
        .emitters
        .lights
        .iter()
        .flat_map(|light| {
            let column = &simulation.emitters.columns[light.column as usize];
            let watts = scales[light.column as usize] / column.slots.max(1) as f32;
            let slots: Vec<u32> = light.slots.clone().collect();
            slots.chunks(PATHS_PER_BATCH).map(|chunk| (chunk.to_vec(), watts)).collect::<Vec<_>>()
        })
        .collect();
    let mut pool: Vec<PathBatch> = Vec::new();
    let mut last_turn = Instant::now();
    for generation in 0..TURNS {
        last_turn = Instant::now();
        let traced: Vec<PathBatch> = slots
            .par_iter()
            .map_init(Wave::default, |wave, (slots, _)| {
                let draws: Vec<Draw> = slots.iter().map(|&slot| Draw { slot, generation }).collect();
                let mut batch = PathBatch::default();
                simulation.tracer.trace(&draws, wave, &mut batch);
                batch
            })
            .collect();
        for (i, batch) in traced.iter().enumerate() {
            let watts = slots[i].1;
            for deposit in pool.get(i).into_iter().flat_map(|old| &old.deposits) {
                flux[deposit.vsl as usize] -= watts * throughput(deposit.rgb);
            }
            for deposit in &batch.deposits {
                flux[deposit.vsl as usize] += watts * throughput(deposit.rgb);
            }
        }
        pool = traced;
    }
    let mut vsls = records::vsl_records(scene, &simulation.placement);
    for (record, flux) in vsls.iter_mut().zip(&flux) {
        // What rounding has left below nothing is no light.
        record.flux = flux.max(Vec3::ZERO).to_array();
    }
    Ok((VslSet::from_records(&vsls)?, last_turn.elapsed().as_secs_f64() * 1e3))
}

fn throughput(quanta: [i32; 3]) -> Vec3 {
    Vec3::from(quanta.map(|q| q as f32)) * QUANTUM as f32
}
