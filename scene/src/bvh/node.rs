//! Turns a node's eight child boxes and a ray into the children the ray may enter, with entry distances.

use super::lanes::{F32x8, Lanes, Slab, U32x8, WIDTH};
use super::ray_frame::RayFrame;

/// Set in a child reference that is a leaf (the rest: packet or part number), clear in a node number.
pub(super) const LEAF: u32 = 1 << 31;
/// Reference of an unused child slot, and of the root of an empty tree.
pub(super) const NONE: u32 = u32::MAX;

/// Boxes and references of up to eight children: 256 bytes, four cache lines.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Coordinates by axis, then lower and upper; unused slots are inverted infinite boxes.
    pub(super) bounds: [[F32x8; 2]; 3],
    pub(super) children: U32x8,
    /// Fills the last cache line.
    unused: [u32; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        bounds: [[F32x8([f32::INFINITY; WIDTH]), F32x8([f32::NEG_INFINITY; WIDTH])]; 3],
        children: U32x8([NONE; WIDTH]),
        unused: [0; WIDTH],
    };

    pub(super) fn set(&mut self, slot: usize, reference: u32, lo: [f32; 3], hi: [f32; 3]) {
        for k in 0..3 {
            self.bounds[k][0].0[slot] = lo[k];
            self.bounds[k][1].0[slot] = hi[k];
        }
        self.children.0[slot] = reference;
    }
}

/// The ray's slab constants in registers.
#[derive(Clone, Copy)]
pub(super) struct SlabLanes<L: Lanes> {
    near: [Slab<L::F>; 3],
    far: [Slab<L::F>; 3],
    /// Row of the near plane by axis: 0 lower, 1 upper.
    near_row: [usize; 3],
}

impl<L: Lanes> SlabLanes<L> {
    #[inline(always)]
    pub(super) fn new(l: L, frame: &RayFrame) -> Self {
        let near = |k: usize| slab(l, frame.near_origin[k], frame.near_offset[k], frame.inverse[k]);
        let far = |k: usize| slab(l, frame.far_origin[k], frame.far_offset[k], frame.inverse[k]);
        let backwards = frame.inverse.is_negative_bitmask() as usize;
        Self {
            near: [near(0), near(1), near(2)],
            far: [far(0), far(1), far(2)],
            near_row: [backwards & 1, backwards >> 1 & 1, backwards >> 2 & 1],
        }
    }

    /// Children entered before `t_max` and their entry distances (≥ 0).
    #[inline(always)]
    pub(super) fn enter(&self, l: L, node: &Node, t_max: f32) -> (L::M, L::F) {
        let [x, y, z] = &node.bounds;
        let [i, j, k] = [self.near_row[0] & 1, self.near_row[1] & 1, self.near_row[2] & 1];
        let near_x = l.slab(l.load(&x[i]), &self.near[0]);
        let near_y = l.slab(l.load(&y[j]), &self.near[1]);
        let near_z = l.slab(l.load(&z[k]), &self.near[2]);
        let far_x = l.slab(l.load(&x[i ^ 1]), &self.far[0]);
        let far_y = l.slab(l.load(&y[j ^ 1]), &self.far[1]);
        let far_z = l.slab(l.load(&z[k ^ 1]), &self.far[2]);
        l.overlap([near_x, near_y, near_z], [far_x, far_y, far_z], l.splat(t_max))
    }
}

#[inline(always)]
fn slab<L: Lanes>(l: L, origin: f32, offset: f32, inverse: f32) -> Slab<L::F> {
    Slab { inverse: l.splat(inverse), origin: l.splat(origin), offset: l.splat(offset) }
}
