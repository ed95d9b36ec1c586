//! Measures the parts of the simulator one by one, on the rays and hits of the same paths.

use crate::{
    error::SimulatorError,
    ledger::{PATHS_PER_TASK, Task},
    pool::PathPool,
    simulation::Simulation,
    tracer::{PathBatch, Watcher, Wave},
};
use glam::Vec3A;
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray as ObvhsRay, RayHit},
    rt_triangle::RtTriangle,
    triangle::Triangle,
};
use photonstream_scene::{
    Side,
    bvh::{Hit, Ray},
};
use std::{
    hint::black_box,
    time::{Duration, Instant},
};

/// Nanoseconds per ray that each part takes on one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// Samples, bounces and everything else a tracer does, with rays and owner lookups.
    pub tracer_ns: f64,
    /// Closest hits in this project's structure.
    pub traversal_ns: f64,
    /// Closest hits in obvhs's CWBVH, the yardstick.
    pub cwbvh_ns: f64,
    /// Owner lookups.
    pub owner_ns: f64,
    /// Replacing the paths in the pool.
    pub ledger_ns: f64,
}

impl Default for Parts {
    fn default() -> Self {
        let none = f64::INFINITY;
        Self { tracer_ns: none, traversal_ns: none, cwbvh_ns: none, owner_ns: none, ledger_ns: none }
    }
}

impl Parts {
    pub(super) fn keep_best(&mut self, other: Self) {
        self.tracer_ns = self.tracer_ns.min(other.tracer_ns);
        self.traversal_ns = self.traversal_ns.min(other.traversal_ns);
        self.cwbvh_ns = self.cwbvh_ns.min(other.cwbvh_ns);
        self.owner_ns = self.owner_ns.min(other.owner_ns);
        self.ledger_ns = self.ledger_ns.min(other.ledger_ns);
    }
}

/// What a number of paths did, to be done again part by part.
pub(super) struct Recording {
    tasks: Vec<Task>,
    rays: Vec<Ray>,
    reflections: Vec<(Hit, Side)>,
    batches: Vec<PathBatch>,
    cwbvh: CwBvh,
    cwbvh_triangles: Vec<RtTriangle>,
    columns: Vec<(u32, u32)>,
}

#[derive(Default)]
struct Recorder {
    rays: Vec<Ray>,
    reflections: Vec<(Hit, Side)>,
}

impl Watcher for Recorder {
    fn ray(&mut self, ray: &Ray) {
        self.rays.push(*ray);
    }

    fn reflection(&mut self, hit: &Hit, side: Side) {
        self.reflections.push((*hit, side));
    }
}

impl Recording {
    pub(super) fn new(simulation: &Simulation, paths: u32) -> Result<Self, SimulatorError> {
        let mut ledger = simulation.ledger();
        let tasks: Vec<Task> =
            std::iter::from_fn(|| ledger.next_task()).take(paths.div_ceil(PATHS_PER_TASK) as usize).collect();
        let mut recorder = Recorder::default();
        let mut wave = Wave::default();
        let batches: Vec<PathBatch> = tasks
            .iter()
            .map(|task| {
                let mut batch = PathBatch::default();
                simulation.tracer.trace_watched(&task.draws, &mut wave, &mut batch, &mut recorder);
                batch
            })
            .collect();
        if recorder.rays.is_empty() {
            return Err(SimulatorError::NothingToMeasure);
        }
        let geometry = &simulation.scene.geometry;
        let triangles: Vec<Triangle> = (0..geometry.triangles.len() as u32)
            .map(|id| {
                let [v0, v1, v2] = geometry.triangle(id).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let mut build_time = Duration::ZERO;
        let cwbvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::slow_build(), &mut build_time);
        let cwbvh_triangles =
            cwbvh.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        let columns = simulation.emitters.lights.iter().map(|l| (l.slots.end, l.column)).collect();
        let Recorder { rays, reflections } = recorder;
        Ok(Self { tasks, rays, reflections, batches, cwbvh, cwbvh_triangles, columns })
    }

    /// One round of every part.
    pub(super) fn measure(&self, simulation: &Simulation) -> Parts {
        let per_ray = |time: Duration| time.as_secs_f64() * 1e9 / self.rays.len() as f64;
        let timed = |body: &mut dyn FnMut()| {
            let begun = Instant::now();
            body();
            per_ray(begun.elapsed())
        };
        let bvh = &simulation.scene.bvh;
        let (mut wave, mut batch) = (Wave::default(), PathBatch::default());
        let tracer_ns = timed(&mut || {
            for task in &self.tasks {
                simulation.tracer.trace(&task.draws, &mut wave, &mut batch);
                black_box(&batch);
            }
        });
        let traversal_ns = timed(&mut || {
            for ray in &self.rays {
                black_box(bvh.closest(ray));
            }
        });
        let cwbvh_ns = timed(&mut || {
            for ray in &self.rays {
                let ray = ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max);
                let mut hit = RayHit::none();
                black_box(
                    self.cwbvh.ray_traverse(ray, &mut hit, |ray, id| self.cwbvh_triangles[id].intersect(ray)),
                );
                black_box(hit);
            }
        });
        let owner_ns = timed(&mut || {
            for (hit, side) in &self.reflections {
                black_box(simulation.owners.owner(hit.triangle, *side, hit.u, hit.v));
            }
        });
        // The second pass replaces paths, as a stream does.
        let mut pool = PathPool::new(self.columns.clone(), simulation.placement.vsls.len());
        self.batches.iter().for_each(|batch| pool.replace(batch, 0));
        let ledger_ns = timed(&mut || self.batches.iter().for_each(|batch| pool.replace(batch, 1)));
        Parts { tracer_ns, traversal_ns, cwbvh_ns, owner_ns, ledger_ns }
    }
}
