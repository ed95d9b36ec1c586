//! Turns samples into paths: a photon from its light through its diffuse bounces, and what it deposits on the way.
//!
//! Source: METHODS of paper A §0.5 and §0.7.1; every impact deposits what leaves the surface, flux · albedo, on the
//! owner of the hit. Survival is decided by the albedo alone, never by the light's colour.

mod batch;
mod beginning;
mod wave;

pub use batch::{Draw, Path, PathBatch};
pub use beginning::Beginnings;
pub use wave::Wave;

use crate::{
    counters::Counters,
    emitters::{Emitters, LightSlots},
    flux::{Deposit, MAX_DEPOSITS, MAX_THROUGHPUT},
    owner::OwnerTable,
    trail::Vertex,
};
use glam::Vec3;
use photonstream_scene::{
    Detail, Geometry, Scene, Side, Sides,
    bvh::{Hit, Ray},
};
use photonstream_shading::{sampling, surface};
use std::sync::Arc;
use wave::{Photon, Point};

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
    /// Whether albedo and survival depend on the place.
    textured: bool,
}

impl Reflection {
    fn new(albedo: Vec3, sides: Sides, textured: bool) -> Self {
        Self { albedo, survival: albedo.max_element().min(MAX_SURVIVAL), sides, textured }
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
                let material = &scene.materials[object.material.0 as usize];
                Reflection::new(material.albedo, object.sides, material.texture.is_some())
            })
            .collect();
        Self { geometry: Arc::clone(&scene.geometry), scene, owners, emitters, surfaces }
    }

    /// Traces the paths of `draws`, whose slots belong to one light. `wave` is memory to work with; what it held before
    /// does not matter.
    pub fn trace(&self, draws: &[Draw], wave: &mut Wave, batch: &mut PathBatch) {
        self.trace_watched(draws, wave, batch, &mut ());
    }

    /// [`Tracer::trace`] of paths of which the first points are known: the same paths, to the last bit, with fewer rays.
    pub fn resume(&self, draws: &[Draw], begun: &Beginnings, wave: &mut Wave, batch: &mut PathBatch) {
        self.follow(draws, begun, wave, batch, &mut ());
    }

    /// [`Tracer::trace`], with every ray and hit shown to `watcher`.
    pub(crate) fn trace_watched(
        &self,
        draws: &[Draw],
        wave: &mut Wave,
        batch: &mut PathBatch,
        watcher: &mut impl Watcher,
    ) {
        self.follow(draws, &Beginnings::default(), wave, batch, watcher);
    }

    /// All paths of the batch advance together, a bounce at a time and within it a step at a time: the processor works on
    /// the rays of several paths at once, where it would wait for each ray's hit, and on eight samples in one
    /// instruction.
    fn follow(
        &self,
        draws: &[Draw],
        begun: &Beginnings,
        wave: &mut Wave,
        batch: &mut PathBatch,
        watcher: &mut impl Watcher,
    ) {
        batch.clear();
        let Some(first) = draws.first() else { return };
        batch.slots.extend(draws.iter().map(|draw| draw.slot));
        batch.counters.paths += draws.len() as u64;
        let light = self.emitters.light_of(first.slot);
        debug_assert!(draws.iter().all(|d| light.slots.contains(&d.slot)), "a batch belongs to one light");
        self.emit(light, draws, begun, wave);
        for hits in 1..=MAX_DEPOSITS as u32 {
            if wave.photons.is_empty() && wave.waiting.is_empty() {
                break;
            }
            self.advance(hits, wave, &mut batch.counters, watcher);
        }
        batch.counters.truncated += wave.photons.len() as u64;
        wave.collect(draws.len(), batch);
    }

    /// Fills the wave with the photons that leave the light, or go on from what is known of their paths.
    fn emit(&self, light: &LightSlots, draws: &[Draw], begun: &Beginnings, wave: &mut Wave) {
        wave.photons.clear();
        wave.waiting.clear();
        wave.events.clear();
        wave.points.clear();
        let shape = &self.scene.lights[light.light.0 as usize].light.shape;
        let mut samples = std::mem::take(&mut wave.spare_samples);
        samples.restart(0);
        let count = u64::from(light.slots.end - light.slots.start);
        for draw in draws {
            let index = u64::from(draw.generation) * count + u64::from(draw.slot - light.slots.start);
            samples.push(light.sequence.sample(index));
        }
        samples.next_2d(&mut wave.first, &mut wave.second);
        // Only area lights and skies start photons from a place that is sampled, too.
        let area = !shape.is_delta();
        if area {
            samples.next_2d(&mut wave.directions.x, &mut wave.directions.y);
        } else {
            samples.skip_dimension();
        }
        wave.samples.restart(samples.dimension());
        let mut known = begun.paths();
        for path in 0..draws.len() as u32 {
            let known = known.next().unwrap_or_default();
            let i = path as usize;
            let u_position = if area { [wave.directions.x[i], wave.directions.y[i]] } else { [0.0; 2] };
            let emission = shape.emit_with(self.scene.bounds, [wave.first[i], wave.second[i]], u_position);
            let throughput = light.birth * emission.weight;
            if !known.is_empty() {
                let waiting = self.go_on(path, throughput, known, samples.get(i), wave);
                wave.waiting.push(waiting);
            } else if throughput != Vec3::ZERO {
                let ray =
                    Ray { origin: emission.origin, direction: emission.direction, t_max: f32::INFINITY };
                wave.photons.push(Photon { path, throughput, ray });
                wave.points.push((path, Vertex::emitted(ray.origin), [0.0; 2]));
                wave.samples.push(samples.get(i));
            }
        }
        wave.waiting.sort_unstable_by_key(|waiting| u32::MAX - waiting.hits);
        wave.spare_samples = samples;
    }

    /// One bounce: every photon of the wave to its hit, the one with the number `hits` from 1, and those that survive it to
    /// their next ray.
    fn advance(&self, hits: u32, wave: &mut Wave, counters: &mut Counters, watcher: &mut impl Watcher) {
        wave.hits.clear();
        for photon in &wave.photons {
            watcher.ray(&photon.ray);
            wave.hits.push(self.scene.bvh.closest(&photon.ray));
        }
        counters.rays += wave.photons.len() as u64;
        wave.samples.next_1d(&mut wave.first);

        let mut survivors = 0;
        wave.directions.clear();
        let mut surviving_samples = std::mem::take(&mut wave.spare_samples);
        surviving_samples.restart(wave.samples.dimension());
        for i in 0..wave.photons.len() {
            let (photon, roulette) = (wave.photons[i], wave.first[i]);
            let Some((next, normal)) = self.reflect(
                &photon,
                &wave.hits[i],
                roulette,
                (&mut wave.events, &mut wave.points),
                counters,
                watcher,
            ) else {
                continue;
            };
            wave.photons[survivors] = next;
            wave.directions.push(normal);
            surviving_samples.push(wave.samples.get(i));
            survivors += 1;
        }
        wave.photons.truncate(survivors);
        while let Some(waiting) = wave.waiting.pop_if(|waiting| waiting.hits == hits) {
            wave.photons.push(waiting.photon);
            wave.directions.push(waiting.normal);
            surviving_samples.push(waiting.sample);
        }
        wave.spare_samples = std::mem::replace(&mut wave.samples, surviving_samples);

        wave.samples.next_2d(&mut wave.first, &mut wave.second);
        sampling::cosine_hemispheres(&mut wave.directions, &wave.first, &wave.second);
        for (i, photon) in wave.photons.iter_mut().enumerate() {
            photon.ray.direction = wave.directions.get(i);
        }
    }

    /// How light is reflected at (u, v) of a triangle.
    #[inline]
    fn reflection(&self, triangle: u32, uv: [f32; 2]) -> Reflection {
        let surface = self.surfaces[self.geometry.object_of[triangle as usize].0 as usize];
        if !surface.textured {
            return surface;
        }
        let albedo = self.scene.albedo_at(triangle, uv, Detail::Transport);
        Reflection::new(albedo, surface.sides, true)
    }

    /// What becomes of a photon at its hit: its deposit, and if it survives the photon that goes on, from its new origin
    /// around the returned normal.
    #[inline]
    fn reflect(
        &self,
        photon: &Photon,
        hit: &Option<Hit>,
        roulette: f32,
        (events, points): (&mut Vec<(u32, Deposit)>, &mut Vec<Point>),
        counters: &mut Counters,
        watcher: &mut impl Watcher,
    ) -> Option<(Photon, Vec3)> {
        let Some(hit) = hit else {
            // A ray that is not finite hits nothing. One sum instead of nine tests: it is finite unless a part is not.
            if (photon.ray.origin + photon.ray.direction + photon.throughput).is_finite() {
                counters.escaped += 1;
                points.push((photon.path, Vertex::escaped(photon.ray.direction), [0.0; 2]));
            } else {
                counters.rejected += 1;
            }
            return None;
        };
        let front = self.geometry.normals[hit.triangle as usize];
        let side = if front.dot(photon.ray.direction) < 0.0 { Side::Front } else { Side::Back };
        let vertices = self.geometry.triangle(hit.triangle);
        let point = surface::point(vertices, hit.u, hit.v);
        let mut arrive = |deposited| {
            points.push((photon.path, Vertex::hit(point, hit.triangle, side, deposited), [hit.u, hit.v]));
        };
        let reflection = self.reflection(hit.triangle, [hit.u, hit.v]);
        if !reflection.sides.contains(side) {
            counters.absorbed_back += 1;
            arrive(false);
            return None;
        }
        let throughput = photon.throughput * reflection.albedo;
        watcher.reflection(hit, side);
        let Some(owner) =
            self.owners.owner(hit.triangle, side, hit.u, hit.v).filter(|_| throughput.is_finite())
        else {
            counters.rejected += 1;
            arrive(false);
            return None;
        };
        let deposit = Deposit::new(owner.0, throughput);
        arrive(deposit.is_some());
        events.extend(deposit.map(|deposit| (photon.path, deposit)));
        if roulette >= reflection.survival {
            return None;
        }
        let throughput = throughput / reflection.survival;
        if throughput.max_element() > MAX_THROUGHPUT {
            counters.truncated += 1;
            return None;
        }
        let normal = front * side.sign();
        let origin = surface::offset(vertices, point, normal);
        // The direction follows for all photons at once.
        let ray = Ray { origin, direction: Vec3::ZERO, t_max: f32::INFINITY };
        Some((Photon { path: photon.path, throughput, ray }, normal))
    }
}
