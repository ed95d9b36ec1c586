//! Turns a ray and a wide tree into the nearest hit (or any hit), near children first, without allocating.

use super::lanes::{Lanes, WIDTH};
use super::node::{LEAF, NONE, Node, SlabLanes};
use super::ray_frame::RayFrame;
use super::triangle::{Nearest, Packet, ShearLanes};

/// Levels of nodes a tree may have; building enforces it.
pub(super) const MAX_DEPTH: usize = 32;

/// Every level leaves at most seven siblings on the stack, and one more push writes a whole register.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// What the leaves of a tree hold.
pub(super) trait Leaves<L: Lanes> {
    /// Offers the hits inside leaf `index` to `nearest`.
    fn intersect<const ANY: bool>(&self, l: L, ray: &RayLanes<'_, L>, index: u32, nearest: &mut Nearest);
}

/// A ray with its constants in registers.
pub(super) struct RayLanes<'a, L: Lanes> {
    pub(super) frame: &'a RayFrame,
    slabs: SlabLanes<L>,
    shear: ShearLanes<L>,
}

impl<'a, L: Lanes> RayLanes<'a, L> {
    #[inline(always)]
    pub(super) fn new(l: L, frame: &'a RayFrame) -> Self {
        Self { frame, slabs: SlabLanes::new(l, frame), shear: ShearLanes::new(l, frame) }
    }
}

impl<L: Lanes> Leaves<L> for [Packet] {
    #[inline(always)]
    fn intersect<const ANY: bool>(&self, l: L, ray: &RayLanes<'_, L>, index: u32, nearest: &mut Nearest) {
        ray.shear.intersect(l, ray.frame, &self[index as usize], nearest);
    }
}

/// Walks the tree under `root`; with `ANY` it stops at the first hit it meets.
#[inline(always)]
pub(super) fn walk<L: Lanes, V: Leaves<L> + ?Sized, const ANY: bool>(
    l: L,
    nodes: &[Node],
    root: u32,
    leaves: &V,
    ray: &RayLanes<'_, L>,
    nearest: &mut Nearest,
) {
    if root == NONE {
        return;
    }
    let mut references = [0u32; STACK];
    let mut distances = [0f32; STACK];
    let mut top = 0;
    let mut current = root;
    'visit: loop {
        if current & LEAF == 0 {
            let node = &nodes[current as usize];
            let (mask, entry) = ray.slabs.enter(l, node, nearest.t);
            let bits = l.bits(mask);
            if bits != 0 {
                if bits & (bits - 1) == 0 {
                    current = node.children.0[bits.trailing_zeros() as usize % WIDTH];
                } else {
                    let (sorted, near) = l.order(mask, entry, &node.children);
                    references[top..top + WIDTH].copy_from_slice(&sorted.0);
                    distances[top..top + WIDTH].copy_from_slice(&near.0);
                    top += bits.count_ones() as usize - 1;
                    current = references[top];
                }
                continue;
            }
        } else {
            leaves.intersect::<ANY>(l, ray, current & !LEAF, nearest);
            if ANY && nearest.found {
                return;
            }
        }
        while top > 0 {
            top -= 1;
            if distances[top] <= nearest.t {
                current = references[top];
                continue 'visit;
            }
        }
        return;
    }
}
