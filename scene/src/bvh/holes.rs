//! Turns a hit on a triangle whose texture has holes into whether there is a surface at all.
//!
//! Asked of each hit before it can be the nearest: rays of every kind go on behind a hole with nothing to restart, and
//! the answers stay those of a minimum over all triangles, some of which are smaller than they look.

use std::sync::Arc;

use glam::Vec2;

use crate::{
    picture::Texture,
    scene::{Geometry, Material, Object, ObjectId},
    texturing::interpolated,
};

/// The holes of a scene's objects.
#[derive(Debug)]
pub(crate) struct Holes {
    object_of: Arc<[ObjectId]>,
    masks: Vec<Option<Mask>>,
}

/// The holes of one object.
#[derive(Debug)]
struct Mask {
    texture: Texture,
    first: u32,
    uvs: Vec<[Vec2; 3]>,
}

impl Holes {
    /// The holes in the textures of `objects`; `None` where there are none.
    pub(crate) fn find(geometry: &Geometry, objects: &[Object], materials: &[Material]) -> Option<Self> {
        let mask = |object: &Object| {
            let texture = materials[object.material.0 as usize].texture.clone()?;
            texture.cutoff?;
            let uvs = object.triangles.clone().map(|t| geometry.uv_triangle(t)).collect::<Option<_>>()?;
            Some(Mask { texture, first: object.triangles.start, uvs })
        };
        let masks: Vec<_> = objects.iter().map(mask).collect();
        let object_of = Arc::clone(&geometry.object_of);
        masks.iter().any(Option::is_some).then_some(Self { object_of, masks })
    }

    /// Whether light passes at (u, v) of a triangle.
    #[inline(never)]
    pub(super) fn contain(&self, triangle: u32, u: f32, v: f32) -> bool {
        let object = self.object_of[triangle as usize];
        let Some(mask) = &self.masks[object.0 as usize] else { return false };
        mask.texture.is_hole(interpolated(mask.uvs[(triangle - mask.first) as usize], u, v))
    }
}
