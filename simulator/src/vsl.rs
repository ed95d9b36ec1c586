//! Names a virtual surface light: a patch of an object's surface that collects what leaves it.
//!
//! VSL stands for virtual *surface* light (paper A), not for Hašan's virtual spherical light.

use glam::Vec3;
use photonstream_scene::{Geometry, ObjectId, Side};
use photonstream_shading::surface;

/// Index of a virtual surface light; those of one [`Surface`] are contiguous.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VslId(pub u32);

/// One reflecting side of one object: virtual surface lights are placed, compared and looked up within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Surface {
    /// The object.
    pub object: ObjectId,
    /// Its side.
    pub side: Side,
}

/// A virtual surface light as it is placed; its flux lives in [`crate::flux`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vsl {
    /// The side of the object on which it lies, and with which it moves.
    pub surface: Surface,
    /// The triangle on which it lies.
    pub triangle: u32,
    /// Barycentric coordinates on it: the weights of its second and third vertex.
    pub barycentric: [f32; 2],
    /// Area of its patch in m².
    pub area: f32,
}

impl Vsl {
    /// Where it is on its object: equal for lights that are the same.
    pub(crate) fn place(&self) -> (Surface, u32, [u32; 2]) {
        (self.surface, self.triangle, self.barycentric.map(f32::to_bits))
    }

    /// Position in its object's rest space, in m.
    pub fn position_rest(&self, geometry: &Geometry) -> Vec3 {
        surface::point(geometry.rest_triangle(self.triangle), self.barycentric[0], self.barycentric[1])
    }

    /// Position in the scene's space, in m: on the triangle as rays meet it.
    pub fn position_ws(&self, geometry: &Geometry) -> Vec3 {
        surface::point(geometry.triangle(self.triangle), self.barycentric[0], self.barycentric[1])
    }

    /// Unit normal of its side in the scene's space.
    pub fn normal_ws(&self, geometry: &Geometry) -> Vec3 {
        geometry.normals[self.triangle as usize] * self.surface.side.sign()
    }
}

/// The least cosine between the normals of a virtual surface light and of a hit that it may own, and between those of
/// two lights that compete for room: 60°. A box's faces stay apart, a tessellated sphere's facets do not.
pub const COMPATIBLE_COSINE: f32 = 0.5;
