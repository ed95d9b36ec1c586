//! Turns two versions of a scene into what the step from one to the other means for the paths of each light.

use crate::{
    disturbance::{Disturbance, Obstacle},
    emitters::LightSlots,
    encounters::Encounters,
    pool::PathPool,
    simulation::Simulation,
    trail::Vertex,
};
use glam::{Mat3A, Vec3};
use photonstream_scene::{Object, Scene, Side};
use photonstream_shading::LightShape;
use std::sync::Arc;

/// What a new version of the scene means for the paths of one light, wherever they went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRevision {
    /// Its paths stand for the old version and have to be traced again.
    pub stale: bool,
    /// What its old deposits are multiplied by to stand for the same light in the new version's units until then.
    pub factor: Vec3,
}

impl LightRevision {
    /// Nothing to do.
    pub const NONE: Self = Self { stale: false, factor: Vec3::ONE };

    /// What another weight of a light's paths means for them; with `is_elsewhere` they are stale in any case.
    pub(crate) fn of_slots(old: &LightSlots, new: &LightSlots, is_elsewhere: bool) -> Self {
        let watts = if old.watts_per_power == new.watts_per_power {
            1.0
        } else {
            old.watts_per_power / new.watts_per_power
        };
        let ratio = |old: f32, new: f32| match (old, new) {
            (old, new) if old == new => 1.0,
            (0.0, _) => 0.0,
            (old, new) => new / old,
        };
        let [r, g, b] = [0, 1, 2].map(|i| ratio(old.birth[i], new.birth[i]));
        let factor = Vec3::new(r, g, b) * if watts.is_finite() { watts } else { 0.0 };
        Self { stale: is_elsewhere || old.birth != new.birth, factor }
    }
}

/// What a new version of the scene means for the paths of the old one.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// For all paths of each light, in the lights' order.
    pub lights: Vec<LightRevision>,
    /// For the paths that met something.
    disturbance: Disturbance,
}

impl Change {
    /// From `old` to `new`, a version of it: [`Simulation::with_scene`].
    ///
    /// A moved light makes its own paths stale; a moved object or a changed material those that met it. The power of a
    /// light with a column of its own is a factor of that column: no path is stale. In a shared column it weighs the
    /// light's paths against those of the others.
    pub fn between(old: &Simulation, new: &Simulation) -> Self {
        Self { lights: light_revisions(old, new), disturbance: disturbance(&old.scene, &new.scene) }
    }

    /// Whether the path of a light through `vertices` may be another one in the new version.
    #[inline]
    pub fn concerns(&self, light: usize, vertices: &[Vertex]) -> bool {
        self.kept(light, vertices) != ALL
    }

    /// How many first points of the path of a light through `vertices` are those of its path in the new version, whatever
    /// becomes of the others: at most 254, or [`ALL`].
    #[inline]
    pub(crate) fn kept(&self, light: usize, vertices: &[Vertex]) -> u8 {
        let on_the_way = || self.disturbance.first_met(vertices).map_or(ALL, at_most);
        if self.lights[light].stale { 0 } else { on_the_way() }
    }

    /// Looks through all paths of `pool` at once, on the present rayon pool.
    pub fn look_through<'a>(&'a self, pool: &'a PathPool) -> Concerned<'a> {
        let is_needed = !self.disturbance.is_empty() && self.lights.iter().any(|light| !light.stale);
        let paths: u64 = pool.valid().iter().map(|&paths| u64::from(paths)).sum();
        let is_worth_it = paths * MOST_POINTS_PER_PATH >= pool.point_room() as u64;
        let encounters = (is_needed && is_worth_it).then(|| pool.encounters(&self.disturbance));
        Concerned { change: self, pool, encounters }
    }

    /// Whether any path of `light` may be concerned.
    pub fn may_concern(&self, light: usize) -> bool {
        self.lights[light].stale || !self.disturbance.is_empty()
    }
}

/// Where the pool has room for more points than this for each path that it holds, looking at the paths one by one is
/// less work than looking at all points.
const MOST_POINTS_PER_PATH: u64 = 32;

/// Which paths of a pool a change concerns.
#[derive(Debug)]
pub struct Concerned<'a> {
    change: &'a Change,
    pool: &'a PathPool,
    encounters: Option<Encounters>,
}

impl Concerned<'_> {
    /// [`Change::concerns`] of the path of `light` in `slot`; none is concerned where there is no path.
    #[inline]
    pub fn contains(&self, light: usize, slot: u32) -> bool {
        self.kept(light, slot) != ALL
    }

    /// [`Change::kept`] of the path of `light` in `slot`.
    #[inline]
    pub(crate) fn kept(&self, light: usize, slot: u32) -> u8 {
        match &self.encounters {
            Some(_) if self.change.lights[light].stale => 0,
            Some(encounters) => self.pool.kept(slot, encounters),
            None => self.change.kept(light, self.pool.trail(slot).unwrap_or_default()),
        }
    }
}

/// Stands for all points of a path, however many they are.
pub(crate) const ALL: u8 = u8::MAX;

/// A number of a path's first points, or a smaller one, in a byte: less may always be known.
#[inline]
pub(crate) fn at_most(points: usize) -> u8 {
    points.min(usize::from(ALL) - 1) as u8
}

fn light_revisions(old: &Simulation, new: &Simulation) -> Vec<LightRevision> {
    let has_other_bounds = old.scene.bounds != new.scene.bounds;
    let lights = old.scene.lights.iter().zip(&new.scene.lights);
    let slots = old.emitters.lights.iter().zip(&new.emitters.lights);
    lights
        .zip(slots)
        .map(|((old, new), (old_slots, new_slots))| {
            // The beam of a sun or sky covers the whole scene.
            let is_distant = new.light.shape.is_distant();
            let is_elsewhere = old.light.shape != new.light.shape || (is_distant && has_other_bounds);
            LightRevision::of_slots(old_slots, new_slots, is_elsewhere)
        })
        .collect()
}

/// What has changed on the way of paths, where objects and triangles are the same in both versions.
fn disturbance(old: &Scene, new: &Scene) -> Disturbance {
    let is_still = Arc::ptr_eq(&old.geometry, &new.geometry);
    let mut reach = 0.0;
    let (mut touched, mut obstacles) = (Vec::new(), Vec::new());
    for (before, after) in old.objects.iter().zip(&new.objects) {
        let has_moved = !is_still && before.world_from_rest != after.world_from_rest;
        if has_moved {
            if reach == 0.0 {
                reach = reach_of(old).max(reach_of(new));
            }
            obstacles.extend(obstacle(new, after, reach));
        }
        if has_moved || !reflects_alike(old, before, new, after) {
            touched.push(after.triangles.clone());
        }
    }
    Disturbance::new(touched, obstacles)
}

/// Objects that differ in their place between two versions of a scene.
pub(crate) struct Moved {
    /// For each object whether it has moved.
    pub(crate) has_moved: Vec<bool>,
    /// What encloses those that have, where they were and where they are.
    pub(crate) obstacles: Vec<Obstacle>,
}

impl Moved {
    pub(crate) fn between(old: &Scene, new: &Scene) -> Self {
        let reach = reach_of(old).max(reach_of(new));
        let mut has_moved = vec![false; new.objects.len()];
        let mut obstacles = Vec::new();
        for (object, (before, after)) in old.objects.iter().zip(&new.objects).enumerate() {
            if before.world_from_rest != after.world_from_rest {
                has_moved[object] = true;
                obstacles.extend(obstacle(old, before, reach));
                obstacles.extend(obstacle(new, after, reach));
            }
        }
        Self { has_moved, obstacles }
    }
}

/// Whether an object has the same triangles, at rest, as one of another scene, in their order.
pub(crate) fn has_same_mesh(before: &Scene, old: &Object, after: &Scene, new: &Object) -> bool {
    old.triangles.len() == new.triangles.len()
        && old
            .triangles
            .clone()
            .zip(new.triangles.clone())
            .all(|(a, b)| before.geometry.rest_triangle(a) == after.geometry.rest_triangle(b))
}

/// Whether a path that hits an object is reflected as it was in another version.
pub(crate) fn reflects_alike(old: &Scene, before: &Object, new: &Scene, after: &Object) -> bool {
    let (before_of, after_of) =
        (&old.materials[before.material.0 as usize], &new.materials[after.material.0 as usize]);
    let sides = |object: &Object| [Side::Front, Side::Back].map(|side| object.sides.contains(side));
    before_of.albedo == after_of.albedo
        && sides(before) == sides(after)
        && before_of.texture == after_of.texture
        && (before_of.texture.is_none() || before.transport_level == after.transport_level)
}

/// What encloses an object; `None` for one without triangles.
pub(crate) fn obstacle(scene: &Scene, object: &Object, reach: f32) -> Option<Obstacle> {
    let corners = object.triangles.clone().flat_map(|t| scene.geometry.triangle(t));
    // Its own axes turn with it.
    let turn = Mat3A::from(object.world_from_rest.matrix3.as_mat3());
    Obstacle::around(corners, turn.transpose(), reach)
}

/// No coordinate of a path's points is larger.
pub(crate) fn reach_of(scene: &Scene) -> f32 {
    // The beam of a sun or sky starts on a disc beside the scene's sphere.
    let around = scene.bounds.centre.abs().max_element() + 3.0 * scene.bounds.radius;
    let position = |shape: &LightShape| match *shape {
        LightShape::Point { position } | LightShape::Spot { position, .. } => position.abs().max_element(),
        LightShape::Directional { .. } | LightShape::Sky { .. } => 0.0,
        LightShape::Mesh { ref mesh } => {
            mesh.triangles().iter().flatten().map(|v| v.abs().max_element()).fold(0.0, f32::max)
        }
        LightShape::Parallelogram { corner, edge_u, edge_v }
        | LightShape::Triangle { corner, edge_u, edge_v } => {
            corner.abs().max_element() + edge_u.length() + edge_v.length()
        }
    };
    scene.lights.iter().map(|light| position(&light.light.shape)).fold(around, f32::max)
}
