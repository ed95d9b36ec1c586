//! Turns samples into paths: a photon from its light through its diffuse bounces, and what it deposits on the way.
//!
//! Source: METHODS of paper A §0.5 and §0.7.1; every impact deposits what leaves the surface, flux · albedo, on the
//! owner of the hit. Survival is decided by the albedo alone, never by the light's colour.

use crate::{
    counters::Counters,
    emitters::{Emitters, LightSlots},
    flux::{Deposit, MAX_DEPOSITS, MAX_THROUGHPUT},
    owner::OwnerTable,
};
use glam::Vec3;
use photonstream_scene::{
    Geometry, Scene, Side, Sides,
    bvh::{Hit, Ray},
};
use photonstream_shading::{sampling, surface};
use std::sync::Arc;

/// Highest probability to survive a bounce. A path in a closed scene of albedo 1 would never end; here its weight grows
/// by 1/0.999 a bounce until it is cut and counted.
pub const MAX_SURVIVAL: f32 = 0.999;

/// Traces paths through one version of a scene. Has no state of its own: path i is the same whoever traces it.
#[derive(Clone, Debug)]
pub struct Tracer {
    scene: Arc<Scene>,
    geometry: Arc<Geometry>,
    owners: Arc<OwnerTable>,
    emitters: Arc<Emitters>,
    surfaces: Vec<Reflection>,
}

/// What a path needs to know of an object.
#[derive(Clone, Copy, Debug)]
struct Reflection {
    albedo: Vec3,
    survival: f32,
    sides: Sides,
}

/// Finished paths of a run of slots, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathBatch {
    /// The slot of the first path.
    pub first_slot: u32,
    /// Number of deposits of each path.
    pub lengths: Vec<u16>,
    /// The deposits of all paths, one after another.
    pub deposits: Vec<Deposit>,
    /// What happened on the way.
    pub counters: Counters,
}

impl PathBatch {
    /// Empties the batch, keeping its memory.
    pub fn clear(&mut self) {
        self.lengths.clear();
        self.deposits.clear();
        self.counters = Counters::default();
    }

    /// Slot and deposits of each path.
    pub fn paths(&self) -> impl Iterator<Item = (u32, &[Deposit])> {
        let mut rest = self.deposits.as_slice();
        self.lengths.iter().zip(self.first_slot..).map(move |(&length, slot)| {
            let (path, tail) = rest.split_at(usize::from(length));
            rest = tail;
            (slot, path)
        })
    }
}

/// Sees what a tracer does; `()` sees nothing and costs nothing.
pub(crate) trait Watcher {
    /// A ray is about to be traced.
    fn ray(&mut self, ray: &Ray);
    /// A ray was reflected at `hit`.
    fn reflection(&mut self, hit: &Hit, side: Side);
}

impl Watcher for () {
    #[inline]
    fn ray(&mut self, _: &Ray) {}
    #[inline]
    fn reflection(&mut self, _: &Hit, _: Side) {}
}

impl Tracer {
    /// A tracer for `scene` with its owners and emitters.
    pub fn new(scene: Arc<Scene>, owners: Arc<OwnerTable>, emitters: Arc<Emitters>) -> Self {
        let surfaces = scene
            .objects
            .iter()
            .map(|object| {
                let albedo = scene.materials[object.material.0 as usize].albedo;
                Reflection { albedo, survival: albedo.max_element().min(MAX_SURVIVAL), sides: object.sides }
            })
            .collect();
        Self { geometry: Arc::clone(&scene.geometry), scene, owners, emitters, surfaces }
    }

    /// Traces `count` slots from `first_slot`; slot i of a light takes sample i + `generation` · (slots of the light).
    ///
    /// Generation 0 always replays the same samples; counting it up streams through the sequence. All slots of a batch
    /// must belong to one light.
    pub fn trace(&self, first_slot: u32, count: u32, generation: u64, batch: &mut PathBatch) {
        self.trace_watched(first_slot, count, generation, batch, &mut ());
    }

    /// [`Tracer::trace`], with every ray and hit shown to `watcher`.
    pub(crate) fn trace_watched(
        &self,
        first_slot: u32,
        count: u32,
        generation: u64,
        batch: &mut PathBatch,
        watcher: &mut impl Watcher,
    ) {
        batch.clear();
        batch.first_slot = first_slot;
        let light = self.emitters.light_of(first_slot);
        debug_assert!(first_slot + count <= light.slots.end, "a batch belongs to one light");
        let base = generation * u64::from(light.slots.end - light.slots.start);
        for slot in first_slot..first_slot + count {
            let start = batch.deposits.len();
            self.trace_path(light, base + u64::from(slot - light.slots.start), batch, watcher);
            batch.lengths.push((batch.deposits.len() - start) as u16);
        }
        batch.counters.paths += u64::from(count);
        batch.counters.deposits += batch.deposits.len() as u64;
    }

    fn trace_path(&self, light: &LightSlots, index: u64, batch: &mut PathBatch, watcher: &mut impl Watcher) {
        let mut sample = light.sequence.sample(index);
        let shape = &self.scene.lights[light.light.0 as usize].light.shape;
        let emission = shape.emit(self.scene.bounds, &mut sample);
        let mut throughput = light.birth * emission.weight;
        if throughput == Vec3::ZERO {
            return;
        }
        let mut ray = Ray { origin: emission.origin, direction: emission.direction, t_max: f32::INFINITY };
        for _ in 0..MAX_DEPOSITS {
            // One sum instead of nine tests: it is finite unless something in it is not.
            if !(ray.origin + ray.direction + throughput).is_finite() {
                batch.counters.rejected += 1;
                return;
            }
            batch.counters.rays += 1;
            watcher.ray(&ray);
            let Some(hit) = self.scene.bvh.closest(&ray) else {
                batch.counters.escaped += 1;
                return;
            };
            let front = self.geometry.normals[hit.triangle as usize];
            let side = if front.dot(ray.direction) < 0.0 { Side::Front } else { Side::Back };
            let reflection = self.surfaces[self.geometry.object_of[hit.triangle as usize].0 as usize];
            if !reflection.sides.contains(side) {
                batch.counters.absorbed_back += 1;
                return;
            }
            throughput *= reflection.albedo;
            watcher.reflection(&hit, side);
            let Some(owner) = self.owners.owner(hit.triangle, side, hit.u, hit.v) else {
                batch.counters.rejected += 1;
                return;
            };
            batch.deposits.extend(Deposit::new(owner.0, throughput));
            if sample.next_1d() >= reflection.survival {
                return;
            }
            throughput /= reflection.survival;
            if throughput.max_element() > MAX_THROUGHPUT {
                batch.counters.truncated += 1;
                return;
            }
            let normal = front * side.sign();
            let vertices = self.geometry.triangle(hit.triangle);
            ray.origin = surface::offset(vertices, surface::point(vertices, hit.u, hit.v), normal);
            ray.direction = sampling::cosine_hemisphere(normal, sample.next_2d());
        }
        batch.counters.truncated += 1;
    }
}
