//! Turns points of free space into places where diffuse paths from them are reflected.

use crate::{
    bvh::Ray,
    scene::{ObjectId, Scene, Side},
    texturing::Detail,
};
use glam::{Vec2, Vec3};
use photonstream_shading::{sampling, sobol::Sequence, surface};
use rayon::prelude::*;

/// A place on a reflecting side of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reflection {
    /// In the scene's space, m, just off the surface: rays can start from it.
    pub(super) position: Vec3,
    /// Unit normal of the side.
    pub(super) normal: Vec3,
    /// Its reflectance at this place.
    pub(super) albedo: Vec3,
    /// The object that was met.
    pub(super) object: ObjectId,
    /// What it may be put together with.
    pub(super) kind: Kind,
}

/// What reflections have in common that one virtual point light can stand for, apart from place and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    /// The object, where it moves.
    pub(super) moving: Option<ObjectId>,
    /// The mean reflectance of its material, texture included.
    pub(super) reflectance: Vec3,
}

/// Largest difference, in any channel, of the mean reflectances of materials that count as alike.
const ALIKE: f32 = 0.1;

impl Kind {
    /// Whether one virtual point light may stand for both. A texture's own colours are alike, as its material is one.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        self.moving == other.moving && (self.reflectance - other.reflectance).abs().max_element() <= ALIKE
    }
}

/// What of every object is the same all over it.
pub(super) struct Kinds(Vec<Kind>);

impl Kinds {
    pub(super) fn of(scene: &Scene) -> Self {
        let kind = |(index, object): (usize, &crate::Object)| {
            let material = &scene.materials[object.material.0 as usize];
            let mean = material.texture.as_ref().map_or(Vec3::ONE, |texture| {
                texture.bilinear(Vec2::splat(0.5), texture.layout.levels - 1).truncate()
            });
            let moving = scene.animation.moves_object(object).then_some(ObjectId(index as u32));
            Kind { moving, reflectance: material.albedo * mean }
        };
        Self(scene.objects.iter().enumerate().map(kind).collect())
    }

    pub(super) fn get(&self, object: ObjectId) -> Kind {
        self.0[object.0 as usize]
    }
}

/// Where `population` paths are reflected, up to `depth` times each. Path i starts at the origin number i modulo their
/// number, in a direction of the whole sphere; it goes on as off a diffuse surface, and ends on what reflects nothing.
///
/// The order is that of the paths, whatever the number of threads.
pub(super) fn reflections(
    scene: &Scene,
    kinds: &Kinds,
    origins: &[Vec3],
    (population, depth): (u32, u32),
    sequence: impl Fn(u32) -> Sequence + Sync,
) -> Vec<Reflection> {
    let count = origins.len() as u32;
    let path = |index: u32| {
        let mut sample = sequence(index % count).sample(u64::from(index / count));
        let mut origin = origins[(index % count) as usize];
        let mut direction = sampling::sphere(sample.next_2d());
        let mut met = Vec::with_capacity(depth as usize);
        for _ in 0..depth {
            let Some(reflection) = meet(scene, kinds, origin, direction) else { break };
            met.push(reflection);
            origin = reflection.position;
            direction = sampling::cosine_hemisphere(reflection.normal, sample.next_2d());
        }
        met
    };
    (0..population).into_par_iter().flat_map_iter(path).collect()
}

/// What a ray meets first, where that is a side that reflects.
fn meet(scene: &Scene, kinds: &Kinds, origin: Vec3, direction: Vec3) -> Option<Reflection> {
    let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
    let front = scene.geometry.normals[hit.triangle as usize];
    let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
    let albedo = scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Transport);
    let object = scene.geometry.object_of[hit.triangle as usize];
    let reflects = scene.objects[object.0 as usize].sides.contains(side) && albedo.max_element() > 0.0;
    reflects.then(|| {
        let vertices = scene.geometry.triangle(hit.triangle);
        let normal = front * side.sign();
        let point = surface::point(vertices, hit.u, hit.v);
        let position = surface::offset(vertices, point, normal);
        Reflection { position, normal, albedo, object, kind: kinds.get(object) }
    })
}
