//! Turns the ledger's progress into the figures that frames and queries carry.

use super::{LedgerActor, Progress};
use crate::{counters::Counters, records};
use photonstream_protocol::StatisticsRecord;
use serde::Serialize;
use std::time::Instant;

/// What `query` answers: the simulator's present state.
#[derive(Clone, Debug, Serialize)]
pub struct State {
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene, in hexadecimal.
    pub scene_hash: String,
    /// Whether the simulation is paused.
    pub paused: bool,
    /// Whether every slot of the pool holds a path: the light is as good as the pool's size makes it.
    pub converged: bool,
    /// How its light is simulated.
    pub method: &'static str,
    /// Number of virtual surface lights.
    pub vsls: usize,
    /// Of a method of few lights, how many of them shine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shining: Option<usize>,
    /// Of a method of few lights, the time of the last update, µs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub update_us: Option<f64>,
    /// Slots of the path pool.
    pub pool_paths: u32,
    /// Slots that hold a path.
    pub pool_valid: u32,
    /// Share of the pool that stands for the scene before the last edit.
    pub stale_share: f64,
    /// Samples beyond the pool in the present light.
    pub refined_paths: u64,
    /// Relative standard error of the flux, weighted by flux.
    pub relative_error: f64,
    /// Milliseconds from the last change that needed rays to its light, whole.
    pub latency_ms: f64,
    /// Seconds of simulated time.
    pub simulation_time_s: f64,
    /// Configs loaded since the start.
    pub config_generation: u64,
    /// Why the edited config is not simulated; empty where it is.
    pub notice: String,
    /// Tracer threads.
    pub threads: usize,
    /// Paths traced a second, over the time in which there was work.
    pub paths_per_s: f64,
    /// Rays traced a second, likewise.
    pub rays_per_s: f64,
    /// Seconds since the simulation started.
    pub uptime_s: f64,
    /// Events since the start.
    #[serde(flatten)]
    pub counters: Counters,
}

impl LedgerActor {
    pub(super) fn statistics(&self, progress: &Progress, converged: bool) -> StatisticsRecord {
        let scene = &progress.simulation.scene;
        let slots = progress.ledger.pool().slots();
        let counters = progress.ledger.counters();
        let seconds = progress.active_time(Instant::now()).as_secs_f64().max(1e-6);
        let uptime = progress.started.elapsed().as_secs_f64();
        let mut statistics = StatisticsRecord {
            origin_m: scene.origin_m.to_array(),
            paths_per_s: counters.paths as f64 / seconds,
            rays_per_s: counters.rays as f64 / seconds,
            deposits_per_s: counters.deposits as f64 / seconds,
            stale_share: f64::from(progress.ledger.stale_paths())
                / f64::from(progress.ledger.active_slots().max(1)),
            pool_paths: u64::from(progress.ledger.active_slots()),
            pool_valid: progress.ledger.pool().valid().iter().map(|&v| u64::from(v)).sum(),
            converged: u64::from(converged),
            simulation_time_s: if scene.animation.is_empty() { uptime } else { progress.time_s },
            refined_paths: progress.ledger.refined_paths(),
            relative_error: progress.relative_error,
            target_error: scene.streaming.target_error,
            rays_saved: progress.ledger.savings().rays_saved,
            retraced_paths: progress.ledger.savings().retraced_paths,
            pool_capacity: u64::from(slots),
            latency_ms: progress.latency_ms,
            latency_target_ms: scene.streaming.latency_ms,
            threads: self.threads as u64,
            edit_received_ns: progress.edit_received_ns,
            traced_ns: progress.traced_ns,
            ..StatisticsRecord::default()
        };
        records::write_counters(&mut statistics, &counters);
        statistics
    }

    pub(super) fn state(&self, progress: &Progress) -> State {
        let converged = self.is_done(progress) || progress.has_converged();
        let statistics = self.statistics(progress, converged);
        State {
            scene: progress.simulation.scene.name.clone(),
            scene_hash: format!("{:016x}", progress.simulation.scene.hash),
            paused: progress.paused,
            converged: statistics.converged == 1,
            method: progress.simulation.method.name(),
            vsls: progress.simulation.published_lights(),
            shining: progress.few.as_ref().map(|few| few.lights.shining()),
            update_us: progress.few.as_ref().map(|few| few.lights.update_us()),
            pool_paths: statistics.pool_paths as u32,
            pool_valid: statistics.pool_valid as u32,
            stale_share: statistics.stale_share,
            refined_paths: statistics.refined_paths,
            relative_error: statistics.relative_error,
            latency_ms: statistics.latency_ms,
            simulation_time_s: statistics.simulation_time_s,
            config_generation: progress.still.config_generation,
            notice: progress.still.notice.to_string(),
            threads: self.threads,
            paths_per_s: statistics.paths_per_s,
            rays_per_s: statistics.rays_per_s,
            uptime_s: progress.started.elapsed().as_secs_f64(),
            counters: progress.ledger.counters(),
        }
    }
}
