//! Turns world-space triangles into a structure that answers closest-hit and occlusion queries.
//!
//! # Answers
//! The closest hit is the minimum of (t, triangle number) over *all* triangles, and does not depend on the shape of
//! the tree, on the division into parts, on other objects, or on the processor:
//! - One function makes hits from a ray and a triangle, the same scalar arithmetic for every lane and instruction set.
//!   The eight-lane test before it only discards triangles.
//! - **Watertight**, after Woop, Benthin, Wald 2013: vertices are translated and sheared in `f32`, the edge functions
//!   then evaluated in `f64`, where products of 24-bit numbers are exact. So their signs are exact for every candidate
//!   (the paper falls back to `f64` where one is zero; `f32` differences that are not zero have the right sign, which
//!   is why the filter needs no `f64`). Two triangles that share an edge always agree on its side.
//! - **No FMA in the triangle tests**: a fused product would break that antisymmetry, and make processors differ.
//!   Node tests may fuse, as they need only be conservative.
//! - **Boxes are padded in space** by 24 round-offs of the distance to the scene's farthest corner, not only relative to
//!   t (Ize 2013): the sheared vertices are off by up to 6 round-offs of their distance, which for a grazing ray along a
//!   flat box is any multiple of t. A hit's t is clamped to its triangle's own padded box. Both paddings are derived
//!   beside their constants; with them every box around a triangle is entered no later than the triangle is hit,
//!   whatever the rounding of t.
//! - No constant epsilon. Zero components of a direction are replaced, in box tests, by 2⁻⁴⁰ of the largest one;
//!   directions are scaled by a power of two, exactly, so that lengths from 10⁻³⁸ to 10³⁸ behave alike.
//!
//! Where a triangle's texture has a hole it is not hit. Zero-area triangles are never hit. Rays with NaN or infinite components, zero direction, `t_max` ≤ 0 or an origin
//! beyond [`MAX_COORDINATE`] hit nothing. No ray makes a query panic.
//!
//! # Layout
//! Eight-wide nodes of 256 bytes (lower and upper bounds of the children by axis in `f32`, references) over leaves of
//! one packet, up to eight triangles as structure of arrays with their numbers, 320 bytes. Triangles are stored by
//! position: one hit reads no index or vertex buffer. Sponza's packets hold 4.4 triangles on average: **about 80 bytes a
//! triangle** with nodes (at best 45, at worst 320 for single triangles), in files, too. Building takes about 250 bytes a triangle
//! for the while. Lists of half a megabyte and more fill whole large pages (2 MB each). A part is one such tree; several
//! parts hang under a small tree of the same nodes; all is world space, so nothing is transformed on the way. The stack is
//! a fixed array of each thread; building bounds the depth
//! (`MAX_DEPTH`) by halving lists below a certain level, so that it cannot overflow.
//!
//! # Where it leaves its models
//! - **obvhs** builds the binary tree by locally ordered clustering and improves it by reinsertion. Clustering is poor on
//!   flat regular walls (29 nodes a ray instead of 5 in a tessellated cube), so a tree cut from the top by surface area
//!   is built too, and the cheaper one kept. The compressed 8-wide tree of obvhs is not used on the CPU: its node test
//!   has a constant epsilon, and decoding costs time.
//! - **Wald 2007** counts triangles; a cut here costs the packets on either side, as if half filled.
//! - **Embree** sorts by scalar code for one to four children, splits triangles spatially, and tests four triangles by
//!   Möller and Trumbore. Here three or more children go through a sorting network without a branch, there are no
//!   spatial splits (a piece's box would not enclose its triangle, and the argument above would fall).

mod cache;
mod collapse;
mod dispatch;
mod error;
mod holes;
mod lanes;
#[cfg(target_arch = "x86_64")]
mod lanes_x86;
#[cfg(target_arch = "x86_64")]
mod lanes_x86_512;
mod node;
pub(crate) mod pages;
mod part;
mod ray_frame;
mod refit;
mod scene_bvh;
mod split;
mod triangle;
mod validate;
mod walk;

#[cfg(test)]
mod tests;

use glam::Vec3;

pub(crate) use cache::TreeCache;
pub use error::BvhError;
pub(crate) use holes::Holes;
pub use part::Bvh;
pub use ray_frame::{MAX_COORDINATE, NODE_PAD_ORIGIN, SMALLEST_COMPONENT, TRIANGLE_PAD};
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
