//! Turns world-space triangles into a structure that answers closest-hit and occlusion queries.

mod collapse;
mod dispatch;
mod error;
mod lanes;
#[cfg(target_arch = "x86_64")]
mod lanes_x86;
mod node;
mod part;
mod ray_frame;
mod scene_bvh;
mod split;
mod triangle;
mod validate;
mod walk;

#[cfg(test)]
mod tests;

use glam::Vec3;

pub use error::BvhError;
pub use part::Bvh;
pub use ray_frame::MAX_COORDINATE;
pub use scene_bvh::SceneBvh;

/// A ray or a segment in world space, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start; hits at distance 0 do not count.
    pub origin: Vec3,
    /// Direction of any length: distances `t` are multiples of it.
    pub direction: Vec3,
    /// End, excluded: hits have 0 < t < `t_max`; may be infinite.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in multiples of the ray's direction.
    pub t: f32,
    /// Weight of the triangle's second vertex.
    pub u: f32,
    /// Weight of the third; the point is (1 − u − v) v0 + u v1 + v v2 with u, v ≥ 0, u + v ≤ 1 up to rounding.
    pub v: f32,
    /// Number of the triangle.
    pub triangle: u32,
}
