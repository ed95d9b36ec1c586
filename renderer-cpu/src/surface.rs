//! Turns a camera ray's hit into the surface that is seen: place, normal, reflectance, emission.

use glam::Vec3;
use photonstream_scene::{
    Detail, Scene, Side,
    bvh::{Hit, Ray},
};
use photonstream_shading::{surface, texture};

/// What a ray has met, seen from where the ray came.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// The point on the surface.
    pub(crate) position: Vec3,
    /// The same point moved off the surface towards the viewer: where rays leave.
    pub(crate) ray_origin: Vec3,
    /// Unit normal of the visible side by which arriving light is weighed: the shading normal of what a camera sees, the
    /// triangle's own elsewhere.
    pub(crate) normal: Vec3,
    /// Unit normal of the visible side of the triangle itself.
    pub(crate) flat: Vec3,
    /// Reflectance of the visible side; zero where that side is not modelled.
    pub(crate) albedo: Vec3,
    /// Radiance that the visible side emits, in W m⁻² sr⁻¹.
    pub(crate) emitted: Vec3,
    /// Index of the object.
    pub(crate) object: u32,
    /// Distance along the ray, in multiples of its direction.
    pub(crate) distance: f32,
}

/// What a camera sees along a ray, as [`first`] does, with its shading normal.
#[inline]
pub(crate) fn seen(scene: &Scene, origin: Vec3, direction: Vec3, pixel: f32) -> Option<Surface> {
    let ray = Ray { origin, direction, t_max: f32::INFINITY };
    let hit = scene.bvh.closest(&ray)?;
    let surface = describe(scene, &hit, direction, pixel);
    let front = scene.shading_normal(hit.triangle, [hit.u, hit.v]);
    let normal = if surface.flat.dot(front) < 0.0 { -front } else { front };
    Some(Surface { normal, ..surface })
}

/// The first surface along a ray of unlimited length, whose direction is a unit vector; `pixel` is the width of what its
/// textures are averaged over at distance 1, or 0 to look at them as finely as they are.
#[inline]
pub(crate) fn first(scene: &Scene, origin: Vec3, direction: Vec3, pixel: f32) -> Option<Surface> {
    let ray = Ray { origin, direction, t_max: f32::INFINITY };
    scene.bvh.closest(&ray).map(|hit| describe(scene, &hit, direction, pixel))
}

#[inline]
fn describe(scene: &Scene, hit: &Hit, direction: Vec3, pixel: f32) -> Surface {
    let vertices = scene.geometry.triangle(hit.triangle);
    let front = scene.geometry.normals[hit.triangle as usize];
    let side = if front.dot(direction) < 0.0 { Side::Front } else { Side::Back };
    let normal = front * side.sign();
    let position = surface::point(vertices, hit.u, hit.v);
    let id = scene.geometry.object_of[hit.triangle as usize];
    let object = &scene.objects[id.0 as usize];
    let albedo = if object.sides.contains(side) {
        let detail = match pixel > 0.0 {
            true => Detail::Width(texture::footprint(pixel, hit.t, normal.dot(direction).abs())),
            false => Detail::Finest,
        };
        scene.albedo_at(hit.triangle, [hit.u, hit.v], detail)
    } else {
        Vec3::ZERO
    };
    Surface {
        position,
        ray_origin: surface::offset(vertices, position, normal),
        normal,
        flat: normal,
        albedo,
        emitted: scene.emitted_radiance(id, side),
        object: id.0,
        distance: hit.t,
    }
}
