//! Turns the pool of one scene into that of another: paths that the step does not concern are kept, their deposits given to
//! whoever owns them now.
//!
//! Objects and lights are recognised by their names. What is equal is equal to the last bit: objects have the same
//! vertices in the scene's space, lights the same samples. The order of triangles among kept objects is that of their
//! names in both scenes, so that rays that hit two of them at one distance keep their hit.

use super::{FILLED, Ledger, STALE, UNDER_WAY};
use crate::{
    change::{ALL, LightRevision, at_most, has_same_mesh, obstacle, reach_of, reflects_alike},
    disturbance::Disturbance,
    flux::Deposit,
    owner::OwnerTable,
    simulation::Simulation,
    tracer::Path,
    trail::{Event, Vertex},
};
use glam::Vec3;
use photonstream_scene::{Object, Scene};
use std::sync::Arc;

/// What the step from one scene to any other means for the paths of the old one.
#[derive(Clone, Debug)]
pub struct Migration {
    /// For each light of the new scene its number in the old one, and what becomes of its paths.
    lights: Vec<Option<(usize, LightRevision)>>,
    /// For each triangle of the old scene its number in the new one.
    triangles: Vec<u32>,
    /// In the old scene's triangles, and the space that both share.
    disturbance: Disturbance,
    /// The lights are the old ones in the same order: their patches are numbered alike.
    same_owners: bool,
    /// The lights whose flux is to be summed, too, and their number.
    fades_from: Option<(Arc<OwnerTable>, usize)>,
}

/// The triangle is in the old scene alone.
const GONE: u32 = u32::MAX;

impl Migration {
    /// From `old` to `new`, which need have nothing in common.
    pub fn between(old: &Simulation, new: &Simulation) -> Self {
        let (before, after) = (&*old.scene, &*new.scene);
        let is_elsewhere = before.origin_m != after.origin_m;
        let has_other_samples = before.streaming.seed != after.streaming.seed
            || before.streaming.sampling != after.streaming.sampling;
        let all_stale = is_elsewhere || has_other_samples;
        let (triangles, disturbance) = objects(before, after);
        let lights = after
            .lights
            .iter()
            .zip(&new.emitters.lights)
            .map(|(light, slots)| {
                let index = before.light(&light.name)?.0 as usize;
                let (old_light, old_slots) = (&before.lights[index], old.emitters.lights.get(index)?);
                let count = |slots: &std::ops::Range<u32>| slots.end - slots.start;
                let is_moved = old_light.light.shape != light.light.shape
                    || (light.light.shape.is_distant() && before.bounds != after.bounds)
                    // Of a stream later samples are numbered by the light's slots.
                    || (count(&old_slots.slots) != count(&slots.slots) && !matches!(after.streaming.sampling, photonstream_scene::Sampling::Replay));
                let revision = LightRevision::of_slots(old_slots, slots, all_stale || is_moved);
                Some((index, revision))
            })
            .collect();
        let are_same = Arc::ptr_eq(&old.owners, &new.owners) || old.placement == new.placement;
        let same_owners = are_same && triangles.iter().zip(0..).all(|(&t, i)| t == i);
        Self { lights, triangles, disturbance, same_owners, fades_from: None }
    }

    /// The same, where the new ledger sums the flux of the lights of `old`, too, until [`Ledger::end_fade`]: `old` shows the
    /// same surfaces.
    pub fn fading_from(mut self, old: &Simulation) -> Self {
        self.fades_from = Some((Arc::clone(&old.owners), old.placement.vsls.len()));
        self
    }
}

/// Where each old triangle is now, and what has changed on the way of paths.
fn objects(before: &Scene, after: &Scene) -> (Vec<u32>, Disturbance) {
    let mut triangles = vec![GONE; before.geometry.triangles.len()];
    let (mut touched, mut obstacles) = (Vec::new(), Vec::new());
    let reach = reach_of(before).max(reach_of(after));
    for object in &before.objects {
        let other = after.object(&object.name).map(|id| &after.objects[id.0 as usize]);
        let is_same_mesh = other.is_some_and(|other| has_same_mesh(before, object, after, other));
        if let Some(other) = other.filter(|_| is_same_mesh) {
            for (old, new) in object.triangles.clone().zip(other.triangles.clone()) {
                triangles[old as usize] = new;
            }
        }
        let is_kept = other.filter(|_| is_same_mesh).is_some_and(|other| {
            stands_alike(before, object, after, other) && reflects_alike(before, object, after, other)
        });
        if !is_kept {
            touched.push(object.triangles.clone());
        }
    }
    for object in &after.objects {
        let other = before.object(&object.name).map(|id| &before.objects[id.0 as usize]);
        let was_there = other.is_some_and(|other| {
            has_same_mesh(before, other, after, object) && stands_alike(before, other, after, object)
        });
        if !was_there {
            obstacles.extend(obstacle(after, object, reach));
        }
    }
    (triangles, Disturbance::new(touched, obstacles))
}

fn stands_alike(before: &Scene, old: &Object, after: &Scene, new: &Object) -> bool {
    old.triangles
        .clone()
        .zip(new.triangles.clone())
        .all(|(a, b)| before.geometry.triangle(a) == after.geometry.triangle(b))
}

impl Ledger {
    /// The ledger of another scene, with the paths of this one that `migration` leaves. Tasks under way are dropped when
    /// they come.
    ///
    /// `budget` is that of [`Ledger::revise`].
    pub fn migrate(mut self, migration: &Migration, simulation: &Simulation, budget: Option<u32>) -> Self {
        let mut next = simulation.ledger();
        next.version = self.version + 1;
        next.structure = self.structure + 1;
        next.units.fill(next.version);
        (next.counters, next.savings) = (self.counters, self.savings);
        if let Some((owners, vsls)) = &migration.fades_from {
            next.pool.sum_also(Arc::clone(owners), *vsls);
            next.refined_before = Some(std::mem::replace(&mut self.refinement, next.refinement.clone()));
        }
        let is_replay = next.given.is_empty();
        let mut moved = Moved::default();
        for (index, source) in migration.lights.iter().enumerate() {
            let Some((old_index, revision)) = source else { continue };
            let old_light = &self.emitters.lights[*old_index];
            let new_slots = next.emitters.lights[index].slots.clone();
            for (old_slot, slot) in
                (old_light.slots.start..old_light.slots.start + self.active[*old_index]).zip(new_slots)
            {
                let mark = self.slots[old_slot as usize];
                let Some(path) = self.pool.whole_path(old_slot) else { continue };
                let on_the_way = migration.disturbance.first_met(path.vertices).map_or(ALL, at_most);
                let by_light = if revision.stale { 0 } else { ALL };
                let kept = self.kept[old_slot as usize].min(on_the_way).min(by_light);
                let is_stale = kept != ALL;
                let alike = moved.take(migration, simulation, &path, revision.factor);
                next.kept[slot as usize] = if is_stale { kept.min(at_most(alike)) } else { ALL };
                let birth_ms = self.pool.birth_ms(old_slot).unwrap_or_default();
                next.pool.put(&moved.path(slot), birth_ms);
                next.slots[slot as usize] = FILLED | if is_stale { STALE } else { 0 };
                debug_assert!(next.slots[slot as usize] & UNDER_WAY == 0);
                next.empty -= 1;
                next.stale_paths += u32::from(is_stale);
                if is_stale {
                    next.savings.retraced_paths += u64::from(mark & STALE == 0);
                } else {
                    next.savings.rays_saved += self.pool.rays(old_slot);
                }
                if !is_replay {
                    next.given[slot as usize] = self.given.get(old_slot as usize).copied().unwrap_or(1);
                }
            }
        }
        if let Some(budget) = budget {
            next.fit_open(budget);
        }
        next.queue_open_slots();
        next
    }
}

/// A path in the terms of another scene.
#[derive(Default)]
struct Moved {
    deposits: Vec<Deposit>,
    vertices: Vec<Vertex>,
    uvs: Vec<[f32; 2]>,
}

impl Moved {
    fn path(&self, slot: u32) -> Path<'_> {
        Path { slot, deposits: &self.deposits, vertices: &self.vertices, uvs: &self.uvs }
    }

    fn push(&mut self, vertex: Vertex, uv: [f32; 2]) {
        self.vertices.push(vertex);
        self.uvs.push(uv);
    }

    /// Takes over a path, and returns how many of its first points it still has.
    fn take(
        &mut self,
        migration: &Migration,
        simulation: &Simulation,
        path: &Path<'_>,
        factor: Vec3,
    ) -> usize {
        self.deposits.clear();
        self.vertices.clear();
        self.uvs.clear();
        let mut rest = path.deposits.iter();
        let mut alike = path.vertices.len();
        for (index, (vertex, &uv)) in path.vertices.iter().zip(path.uvs).enumerate() {
            let Event::Hit { triangle, side, deposited } = vertex.event() else {
                self.push(*vertex, uv);
                continue;
            };
            let deposit = if deposited { rest.next() } else { None };
            let number = migration.triangles[triangle as usize];
            // Light on what is gone is gone; the path is stale then.
            if number == GONE {
                alike = alike.min(index);
                continue;
            }
            let Some(deposit) = deposit else {
                self.push(vertex.renumbered(number), uv);
                continue;
            };
            let owner = if migration.same_owners {
                deposit.vsl
            } else {
                match simulation.owners.owner(number, side, uv[0], uv[1]) {
                    Some(owner) => owner.0,
                    None => {
                        alike = alike.min(index);
                        continue;
                    }
                }
            };
            let deposit = Deposit { vsl: owner, ..*deposit };
            self.deposits.push(if factor == Vec3::ONE { deposit } else { deposit.scaled(factor) });
            self.push(vertex.renumbered(number), uv);
        }
        alike
    }
}
