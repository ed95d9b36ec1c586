//! Turns measurements into a table and into documented JSON.

use super::{Exchange, Parts};
use crate::simulation::Simulation;
use serde::Serialize;
use std::fmt;

/// Rates of the whole simulator: owner lookups, ledger and publishing included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Throughput {
    /// Tracer threads.
    pub threads: usize,
    /// Paths a second.
    pub paths_per_s: f64,
    /// Rays a second.
    pub rays_per_s: f64,
    /// Deposits a second.
    pub deposits_per_s: f64,
}

impl Throughput {
    pub(super) fn keep_best(&mut self, other: Self) {
        if other.rays_per_s > self.rays_per_s {
            *self = other;
        }
    }
}

/// What `photonstream bench` reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchReport {
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene, in hexadecimal.
    pub scene_hash: String,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Virtual surface lights.
    pub vsls: usize,
    /// Seconds to place them, with their owner table and areas, on all cores.
    pub placement_s: f64,
    /// The whole simulator with one tracer.
    pub one_thread: Throughput,
    /// The whole simulator with a tracer per core.
    pub all_threads: Throughput,
    /// Rays a second with all tracers over those with one.
    pub scaling: f64,
    /// Rays a second of bare traversal, one thread: the paths' rays and nothing else.
    pub traversal_rays_per_s: f64,
    /// The same rays in obvhs's CWBVH, one thread.
    pub cwbvh_rays_per_s: f64,
    /// Rays a second of the whole simulator with one tracer over those of bare CWBVH traversal.
    pub whole_over_cwbvh: f64,
    /// Shares of one thread's time per ray: traversal, owner lookup, ledger, and what is left of the tracer (samples,
    /// bounces, bookkeeping).
    pub traversal_share: f64,
    /// See `traversal_share`.
    pub owner_share: f64,
    /// See `traversal_share`.
    pub ledger_share: f64,
    /// See `traversal_share`.
    pub rest_share: f64,
    /// Time of owner lookups over time of traversal.
    pub owner_over_traversal: f64,
    /// Bytes of the owner table.
    pub owner_table_bytes: usize,
    /// Publishing and reading one frame.
    #[serde(flatten)]
    pub exchange: Exchange,
}

impl BenchReport {
    pub(super) fn new(
        simulation: &Simulation,
        placement_s: f64,
        one_thread: Throughput,
        all_threads: Throughput,
        parts: &Parts,
        exchange: Exchange,
    ) -> Self {
        let sum = parts.tracer_ns + parts.ledger_ns;
        let rest = (parts.tracer_ns - parts.traversal_ns - parts.owner_ns).max(0.0);
        Self {
            scene: simulation.scene.name.clone(),
            scene_hash: format!("{:016x}", simulation.scene.hash),
            triangles: simulation.scene.geometry.triangles.len(),
            vsls: simulation.placement.vsls.len(),
            placement_s,
            one_thread,
            all_threads,
            scaling: all_threads.rays_per_s / one_thread.rays_per_s,
            traversal_rays_per_s: 1e9 / parts.traversal_ns,
            cwbvh_rays_per_s: 1e9 / parts.cwbvh_ns,
            whole_over_cwbvh: one_thread.rays_per_s * parts.cwbvh_ns / 1e9,
            traversal_share: parts.traversal_ns / sum,
            owner_share: parts.owner_ns / sum,
            ledger_share: parts.ledger_ns / sum,
            rest_share: rest / sum,
            owner_over_traversal: parts.owner_ns / parts.traversal_ns,
            owner_table_bytes: simulation.owners.bytes(),
            exchange,
        }
    }
}

impl fmt::Display for BenchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} triangles, {} VSLs placed in {:.2} s",
            self.scene, self.triangles, self.vsls, self.placement_s
        )?;
        for t in [self.one_thread, self.all_threads] {
            writeln!(
                f,
                "whole simulator, {} tracer{}: {:.2} M rays/s, {:.2} M paths/s, {:.2} M deposits/s",
                t.threads,
                if t.threads == 1 { "" } else { "s" },
                t.rays_per_s / 1e6,
                t.paths_per_s / 1e6,
                t.deposits_per_s / 1e6
            )?;
        }
        writeln!(f, "scaling: {:.2} with {} tracers", self.scaling, self.all_threads.threads)?;
        writeln!(
            f,
            "bare traversal of the same rays, one thread: {:.2} M rays/s; obvhs CWBVH: {:.2} M rays/s; whole simulator / \
             CWBVH: {:.2}",
            self.traversal_rays_per_s / 1e6,
            self.cwbvh_rays_per_s / 1e6,
            self.whole_over_cwbvh
        )?;
        let percent = |x: f64| x * 100.0;
        writeln!(
            f,
            "time per ray: traversal {:.0} %, owner lookup {:.0} %, ledger {:.0} %, samples and bounces {:.0} %",
            percent(self.traversal_share),
            percent(self.owner_share),
            percent(self.ledger_share),
            percent(self.rest_share)
        )?;
        writeln!(f, "owner table: {:.1} MB", self.owner_table_bytes as f64 / 1e6)?;
        let e = self.exchange;
        write!(
            f,
            "one frame: records {:.0} µs, publish {:.0} µs, read {:.0} µs (memcpy of its records {:.0} µs)",
            e.records_us, e.publish_us, e.read_us, e.memcpy_us
        )
    }
}
