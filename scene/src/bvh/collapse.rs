//! Turns a binary tree over boxes into eight-wide nodes by dynamic programming over the surface-area cost.
//!
//! Source: Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs",
//! section 3; deviates: a leaf costs one packet whatever it holds, depth is bounded, nothing recurses.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::lanes::WIDTH;
use super::node::{LEAF, NONE, Node};
use super::walk::MAX_DEPTH;

/// Cost of testing a packet in units of a node visit.
const LEAF_COST: f32 = 1.0;

/// Level from which a subtree is laid out by halving its list: 12 further levels hold 8¹² leaves.
const BALANCED_FROM: usize = MAX_DEPTH - 12;

/// An eight-wide tree.
pub(super) struct WideTree {
    pub(super) nodes: Vec<Node>,
    pub(super) root: u32,
}

/// A subtree still to be laid out.
enum Subtree {
    /// Node of the binary tree.
    Binary(u32),
    /// Primitives, in an order where neighbours are close.
    List(Vec<u32>),
}

/// Best ways to cut the subtree of one binary node: bit 31: as a leaf; 3 bits at `3·i`: for a forest of up to `i`
/// roots the left child's share, 0 for "as with `i − 1`".
#[derive(Clone, Copy)]
struct Cuts(u32);

impl Cuts {
    const AS_LEAF: u32 = 1 << 31;

    fn is_leaf(self) -> bool {
        self.0 & Self::AS_LEAF != 0
    }

    fn left_share(self, roots: usize) -> usize {
        (self.0 >> (3 * roots) & 7) as usize
    }
}

/// Lays out `tree` over `boxes`; `emit_leaf` stores up to `max_leaf` primitives and returns their leaf number.
pub(super) fn collapse(
    tree: &Bvh2,
    boxes: &[Aabb],
    max_leaf: usize,
    mut emit_leaf: impl FnMut(&[u32]) -> u32,
) -> WideTree {
    if tree.nodes.is_empty() {
        return WideTree { nodes: Vec::new(), root: NONE };
    }
    let cuts = best_cuts(tree, max_leaf);
    if cuts[0].is_leaf() {
        let root = emit_leaf(&primitives(tree, 0)) | LEAF;
        return WideTree { nodes: Vec::new(), root };
    }
    let mut nodes = vec![Node::EMPTY];
    let mut pending = vec![(Subtree::Binary(0), 0u32, 0usize)];
    while let Some((subtree, index, depth)) = pending.pop() {
        let children = match subtree {
            Subtree::Binary(node) if depth < BALANCED_FROM => cut(tree, &cuts, node),
            Subtree::Binary(node) => halve(&primitives(tree, node)),
            Subtree::List(list) => halve(&list),
        };
        let first_pending = pending.len();
        for (slot, child) in children.into_iter().enumerate() {
            let (bounds, leaf) = match &child {
                Subtree::Binary(node) => {
                    let is_leaf = cuts[*node as usize].is_leaf();
                    let bounds = *tree.nodes[*node as usize].aabb();
                    (bounds, is_leaf.then(|| primitives(tree, *node)))
                }
                Subtree::List(list) => {
                    let bounds = list.iter().fold(Aabb::INVALID, |all, &p| all.union(&boxes[p as usize]));
                    (bounds, (list.len() <= max_leaf).then(|| list.clone()))
                }
            };
            let reference = match leaf {
                Some(list) => emit_leaf(&list) | LEAF,
                None => {
                    let reference = nodes.len() as u32;
                    nodes.push(Node::EMPTY);
                    pending.push((child, reference, depth + 1));
                    reference
                }
            };
            nodes[index as usize].set(slot, reference, corner(bounds.min), corner(bounds.max));
        }
        pending[first_pending..].reverse();
    }
    WideTree { nodes, root: 0 }
}

fn corner(v: Vec3A) -> [f32; 3] {
    v.to_array()
}

/// Up to eight lists of nearly equal length.
fn halve(list: &[u32]) -> Vec<Subtree> {
    list.chunks(list.len().div_ceil(WIDTH).max(1)).map(|chunk| Subtree::List(chunk.to_vec())).collect()
}

/// The roots of the best forest of up to eight trees under `node`.
fn cut(tree: &Bvh2, cuts: &[Cuts], node: u32) -> Vec<Subtree> {
    let mut forest = Vec::with_capacity(WIDTH);
    let mut pending = vec![(node, WIDTH)];
    while let Some((node, mut roots)) = pending.pop() {
        let here = cuts[node as usize];
        while roots > 1 && here.left_share(roots) == 0 {
            roots -= 1;
        }
        if roots == 1 {
            forest.push(Subtree::Binary(node));
        } else {
            let first = tree.nodes[node as usize].first_index;
            let left = here.left_share(roots);
            pending.push((first + 1, roots - left));
            pending.push((first, left));
        }
    }
    forest
}

/// Primitives under a binary node, left to right.
fn primitives(tree: &Bvh2, node: u32) -> Vec<u32> {
    let mut found = Vec::new();
    let mut pending = vec![node];
    while let Some(node) = pending.pop() {
        let node = &tree.nodes[node as usize];
        let first = node.first_index;
        if node.is_leaf() {
            found.extend_from_slice(
                &tree.primitive_indices[first as usize..(first + node.prim_count) as usize],
            );
        } else {
            pending.extend([first + 1, first]);
        }
    }
    found
}

/// Costs of a subtree as a forest of up to 1..=7 trees (entry 0 unused), and its primitives.
struct Costs {
    forest: [f32; WIDTH],
    count: usize,
}

fn best_cuts(tree: &Bvh2, max_leaf: usize) -> Vec<Cuts> {
    // Parents first, left before right: backwards, a left child's costs lie on top of its sibling's.
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut pending = vec![0u32];
    while let Some(node) = pending.pop() {
        order.push(node);
        let binary = &tree.nodes[node as usize];
        if !binary.is_leaf() {
            pending.extend([binary.first_index + 1, binary.first_index]);
        }
    }
    let mut cuts = vec![Cuts(0); tree.nodes.len()];
    let mut done: Vec<Costs> = Vec::new();
    for &index in order.iter().rev() {
        let node = &tree.nodes[index as usize];
        let area = node.aabb().half_area();
        if node.is_leaf() {
            cuts[index as usize] = Cuts(Cuts::AS_LEAF);
            done.push(Costs { forest: [area * LEAF_COST; WIDTH], count: node.prim_count as usize });
            continue;
        }
        let left = done.pop().expect("invariant: children come before their parent");
        let right = done.pop().expect("invariant: children come before their parent");
        let (costs, best) = best_cut(&left, &right, area, max_leaf);
        cuts[index as usize] = best;
        done.push(costs);
    }
    cuts
}

fn best_cut(left: &Costs, right: &Costs, area: f32, max_leaf: usize) -> (Costs, Cuts) {
    let mut cuts = 0;
    let split = |roots: usize| {
        (1..roots)
            .map(|share| (left.forest[share] + right.forest[roots - share], share))
            .fold((f32::INFINITY, 1), |best, next| if next.0 < best.0 { next } else { best })
    };
    let mut splits = [(f32::INFINITY, 1); WIDTH + 1];
    for (roots, best) in splits.iter_mut().enumerate().skip(2) {
        *best = split(roots);
    }
    let count = left.count + right.count;
    let as_node = area + splits[WIDTH].0;
    cuts |= (splits[WIDTH].1 as u32) << (3 * WIDTH);
    let mut forest = [0.0; WIDTH];
    forest[1] = as_node;
    if count <= max_leaf && area * LEAF_COST <= as_node {
        forest[1] = area * LEAF_COST;
        cuts |= Cuts::AS_LEAF;
    }
    for roots in 2..WIDTH {
        let (cost, share) = splits[roots];
        forest[roots] = forest[roots - 1];
        if cost < forest[roots] {
            forest[roots] = cost;
            cuts |= (share as u32) << (3 * roots);
        }
    }
    (Costs { forest, count }, Cuts(cuts))
}
