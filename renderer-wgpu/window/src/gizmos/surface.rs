//! Turns a place in the window into the surface that is seen there, as something new is put on it.

use crate::picking::Eye;
use glam::Vec3;
use photonstream_scene::{Detail, ObjectId, Scene, bvh::Ray};

/// What a VPL can be made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface {
    /// In metres from the scene's origin.
    pub(super) point: Vec3,
    /// Unit normal of the triangle, towards the camera.
    pub(super) normal: Vec3,
    /// Its reflectance there, averaged as the light transport does.
    pub(super) albedo: Vec3,
    /// What it belongs to.
    pub(super) object: ObjectId,
    /// Metres from the camera, along the view.
    pub(super) depth: f32,
}

impl Surface {
    /// The surface under `cursor`, if there is one.
    pub(super) fn under(eye: &Eye<'_>, scene: &Scene, cursor: [f32; 2]) -> Option<Self> {
        let (origin, direction) = (eye.camera.position, eye.direction(cursor));
        let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
        let triangle = hit.triangle as usize;
        let normal = *scene.geometry.normals.get(triangle)?;
        Some(Self {
            point: origin + direction * hit.t,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            albedo: scene.albedo_at(hit.triangle, [hit.u, hit.v], Detail::Transport),
            object: *scene.geometry.object_of.get(triangle)?,
            depth: hit.t * direction.dot(eye.camera.forward),
        })
    }
}
