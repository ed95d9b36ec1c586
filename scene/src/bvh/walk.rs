//! Turns a ray and a wide tree into the nearest hit (or any hit), near children first, without allocating.

use std::cell::Cell;

use super::holes::Holes;
use super::lanes::{Lanes, WIDTH};
use super::node::{LEAF, NONE, Node, SlabLanes};
use super::ray_frame::RayFrame;
use super::triangle::{Nearest, Packet, ShearLanes};

/// Levels of nodes a tree may have; building enforces it.
pub(super) const MAX_DEPTH: usize = 32;

/// Every level of the two trees leaves at most seven siblings on the stack, and a push writes a whole register.
const STACK: usize = 2 * MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// Subtrees still to be visited, with the distances at which the ray enters them.
///
/// One a thread, taken and put back: clearing four kilobytes for each ray would cost a tenth of its time, and a closure
/// that borrows it keeps the compiler from passing the ray in registers.
#[derive(Debug)]
pub(super) struct Stack {
    references: [u32; STACK],
    distances: [f32; STACK],
}

thread_local! {
    static STACK_OF_THREAD: Cell<Option<Box<Stack>>> = const { Cell::new(None) };
}

impl Stack {
    /// That of the thread, or a new one where it is in use.
    #[inline(always)]
    pub(super) fn take() -> Box<Self> {
        match STACK_OF_THREAD.take() {
            Some(stack) => stack,
            None => Self::new(),
        }
    }

    #[cold]
    #[inline(never)]
    fn new() -> Box<Self> {
        Box::new(Self { references: [0; STACK], distances: [0.0; STACK] })
    }

    /// Makes it the thread's.
    #[inline(always)]
    pub(super) fn put_back(self: Box<Self>) {
        STACK_OF_THREAD.set(Some(self));
    }
}

/// What the leaves of a tree hold.
pub(super) trait Leaves<L: Lanes> {
    /// Where leaf `index` is, if it is.
    fn address(&self, index: u32) -> *const u8;
    /// Offers the hits inside leaf `index` to `nearest`; the stack is free from `base`.
    fn intersect<const ANY: bool>(
        &self,
        l: L,
        ray: &RayLanes<'_, L>,
        index: u32,
        stack: (&mut Stack, usize),
        nearest: &mut Nearest,
    );
}

/// A ray with its constants in registers.
pub(super) struct RayLanes<'a, L: Lanes> {
    pub(super) frame: &'a RayFrame,
    holes: Option<&'a Holes>,
    slabs: SlabLanes<L>,
    shear: ShearLanes<L>,
}

impl<'a, L: Lanes> RayLanes<'a, L> {
    #[inline(always)]
    pub(super) fn new(l: L, frame: &'a RayFrame, holes: Option<&'a Holes>) -> Self {
        Self { frame, holes, slabs: SlabLanes::new(l, frame), shear: ShearLanes::new(l, frame) }
    }
}

impl<L: Lanes> Leaves<L> for [Packet] {
    #[inline(always)]
    fn address(&self, index: u32) -> *const u8 {
        self.as_ptr().wrapping_add(index as usize).cast()
    }
    #[inline(always)]
    fn intersect<const ANY: bool>(
        &self,
        l: L,
        ray: &RayLanes<'_, L>,
        index: u32,
        _: (&mut Stack, usize),
        nearest: &mut Nearest,
    ) {
        ray.shear.intersect(l, (ray.frame, ray.holes), &self[index as usize], nearest);
    }
}

/// Walks the tree under `root`, with the stack from `base`; with `ANY` it stops at the first hit it meets.
#[inline(always)]
pub(super) fn walk<L: Lanes, V: Leaves<L> + ?Sized, const ANY: bool>(
    l: L,
    (nodes, root): (&[Node], u32),
    leaves: &V,
    ray: &RayLanes<'_, L>,
    (stack, base): (&mut Stack, usize),
    nearest: &mut Nearest,
) {
    if root == NONE {
        return;
    }
    let mut top = base;
    let mut current = root;
    'visit: loop {
        if current & LEAF == 0 {
            let node = &nodes[current as usize];
            let (mask, entry) = ray.slabs.enter(l, node, nearest.t);
            let bits = l.bits(mask);
            if bits != 0 {
                let first = bits.trailing_zeros() as usize % WIDTH;
                let rest = bits & (bits - 1);
                if rest == 0 {
                    current = node.children.0[first];
                } else if rest & (rest - 1) == 0 {
                    let second = rest.trailing_zeros() as usize % WIDTH;
                    let entry = l.store(entry);
                    // Without a branch: which of two is nearer is not to be predicted.
                    let swap = usize::from(entry.0[second] < entry.0[first]);
                    let flip = (first ^ second) & swap.wrapping_neg();
                    let (near, far) = (first ^ flip, second ^ flip);
                    current = node.children.0[near];
                    stack.references[top] = node.children.0[far];
                    stack.distances[top] = entry.0[far];
                    prefetch(l, nodes, leaves, node.children.0[far]);
                    top += 1;
                } else {
                    let (sorted, near) = l.order(mask, entry, &node.children);
                    stack.references[top..top + WIDTH].copy_from_slice(&sorted.0);
                    stack.distances[top..top + WIDTH].copy_from_slice(&near.0);
                    top += bits.count_ones() as usize - 1;
                    current = stack.references[top];
                    // Those behind the next wait long enough to be asked for when they are the next.
                    prefetch(l, nodes, leaves, stack.references[top - 1]);
                }
                continue;
            }
        } else {
            leaves.intersect::<ANY>(l, ray, current & !LEAF, (&mut *stack, top), nearest);
            if ANY && nearest.found {
                return;
            }
        }
        while top > base {
            top -= 1;
            if stack.distances[top] <= nearest.t {
                current = stack.references[top];
                continue 'visit;
            }
        }
        return;
    }
}

#[inline(always)]
fn prefetch<L: Lanes, V: Leaves<L> + ?Sized>(l: L, nodes: &[Node], leaves: &V, reference: u32) {
    let node = nodes.as_ptr().wrapping_add(reference as usize);
    // Without a branch: whether a child is a leaf is not to be predicted.
    let is_leaf = usize::from(reference & LEAF != 0).wrapping_neg();
    let leaf = leaves.address(reference & !LEAF);
    l.prefetch(leaf.map_addr(|leaf| node.addr() ^ ((leaf ^ node.addr()) & is_leaf)));
}
