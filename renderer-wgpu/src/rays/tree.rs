//! Turns a scene's triangles into the compressed eight-wide tree that shaders walk, and checks its depth.
//!
//! Source: Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", in
//! the layout of `obvhs`: nodes of 80 bytes. Triangles lie in leaf order, 48 bytes each.

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};
use photonstream_scene::{Geometry, bvh::MAX_COORDINATE};
use photonstream_shading::surface;
use std::collections::HashMap;

/// Groups that a ray's stack holds: one for each level of the tree above the node it visits.
pub(super) const STACK: u32 = 32;

/// Part of the nodes that are moved to cheaper places.
const REINSERTED: f32 = 0.15;
/// Clustering from below takes quadratic time where more boxes than this are the same, and its tree is a list then.
const LARGEST_PILE: usize = 64;
/// Depth of a binary tree up to which `obvhs` may recurse into it.
const RECURSION: usize = 256;
/// Triangles of a leaf: what three bits count.
const LEAF_TRIANGLES: u32 = 3;

/// A tree and its triangles, as they are uploaded.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<CwBvhNode>,
    pub(super) triangles: Vec<[[f32; 4]; 3]>,
    /// Which of the scene's each triangle is; none where one stands for none.
    pub(super) ids: Vec<u32>,
    /// Lower and upper corner; twice the origin if there is nothing.
    pub(super) bounds: [Vec3; 2],
    /// Levels of nodes.
    pub(super) depth: u32,
}

impl Tree {
    /// Triangles that cannot be hit are left out: coordinates not finite or too large, no area.
    pub(super) fn new(geometry: &Geometry) -> Self {
        let solid: Vec<([Vec3; 3], Vec3, u32)> = (0..geometry.triangles.len() as u32)
            .map(|id| (geometry.triangle(id), id))
            .filter(|(corners, _)| {
                corners.iter().all(|v| v.is_finite() && v.abs().max_element() <= MAX_COORDINATE)
            })
            .filter_map(|(corners, id)| Some((corners, surface::normal(corners)?, id)))
            .collect();
        let boxes: Vec<Aabb> = solid.iter().map(|(v, ..)| Aabb::from_points(&v.map(Vec3A::from))).collect();
        if boxes.is_empty() {
            // A node without children: every ray misses.
            let (nodes, triangles) = (vec![CwBvhNode::default()], vec![[[0.0; 4]; 3]]);
            return Self { nodes, triangles, ids: Vec::new(), bounds: [Vec3::ZERO; 2], depth: 1 };
        }
        let bounds = boxes.iter().fold(Aabb::INVALID, |all, b| all.union(b));
        let mut wide = clustered(&boxes).map(|binary| compress(&binary));
        // Halving gives a worse tree of bounded depth: ⌈log₂ n⌉ binary levels, of which each wide one holds one or more.
        if wide.as_ref().is_none_or(|wide| depth(wide) > STACK) {
            wide = Some(compress(&halved(&boxes)));
        }
        let wide = wide.unwrap_or_default();
        let depth = depth(&wide);
        let triangles = wide.primitive_indices.iter().map(|&index| {
            let (corners, normal, _) = &solid[index as usize];
            [0, 1, 2].map(|i| [corners[i].x, corners[i].y, corners[i].z, normal[i]])
        });
        let triangles = triangles.collect();
        let ids = wide.primitive_indices.iter().map(|&index| solid[index as usize].2).collect();
        Self { nodes: wide.nodes, triangles, ids, bounds: [bounds.min.into(), bounds.max.into()], depth }
    }
}

fn compress(binary: &Bvh2) -> CwBvh {
    bvh2_to_cwbvh(binary, LEAF_TRIANGLES, true, false)
}

/// Number of levels of a wide tree.
fn depth(wide: &CwBvh) -> u32 {
    let mut deepest = 0;
    let mut pending = vec![(0usize, 1)];
    while let Some((index, level)) = pending.pop() {
        deepest = deepest.max(level);
        let node = &wide.nodes[index];
        let first = node.child_base_idx as usize;
        pending.extend((0..node.imask.count_ones() as usize).map(|k| (first + k, level + 1)));
    }
    deepest
}

/// Neighbours joined from below; `None` where that is slow or makes too deep a tree.
fn clustered(boxes: &[Aabb]) -> Option<Bvh2> {
    let mut piles = HashMap::with_capacity(boxes.len());
    for b in boxes {
        let key = [b.min, b.max].map(|corner| corner.to_array().map(f32::to_bits));
        *piles.entry(key).or_insert(0usize) += 1;
    }
    if piles.into_values().max() > Some(LARGEST_PILE) {
        return None;
    }
    let ids = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        ids,
        SortPrecision::U64,
        1,
    );
    ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    (binary_depth(&tree) <= RECURSION).then_some(tree)
}

fn binary_depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut pending = vec![(0usize, 1)];
    while let Some((index, level)) = pending.pop() {
        deepest = deepest.max(level);
        let node = &tree.nodes[index];
        if !node.is_leaf() {
            pending.extend([0, 1].map(|k| (node.first_index as usize + k, level + 1)));
        }
    }
    deepest
}

/// Sets cut in two equal halves along the widest axis of their centres.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let centre = |&id: &u32| boxes[id as usize].min + boxes[id as usize].max;
    let around = |ids: &[u32]| ids.iter().fold(Aabb::INVALID, |all, &id| all.union(&boxes[id as usize]));
    let mut ids: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut tree = Bvh2::default();
    tree.nodes.push(Bvh2Node::new(around(&ids), 0, 0));
    let mut pending = vec![(0usize, 0..ids.len(), 1usize)];
    while let Some((node, range, level)) = pending.pop() {
        tree.max_depth = tree.max_depth.max(level + 1);
        let bounds = *tree.nodes[node].aabb();
        if range.len() == 1 {
            tree.nodes[node] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let set = &mut ids[range.clone()];
        let spread = set.iter().map(centre).fold(Aabb::INVALID, |all, c| all.union(&Aabb::new(c, c)));
        let widths = (spread.max - spread.min).to_array();
        let axis = (0..3).max_by(|&a, &b| widths[a].total_cmp(&widths[b])).unwrap_or(0);
        let half = set.len() / 2;
        set.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
        let left = tree.nodes.len();
        tree.nodes[node] = Bvh2Node::new(bounds, 0, left as u32);
        let middle = range.start + half;
        for (k, part) in [range.start..middle, middle..range.end].into_iter().enumerate() {
            tree.nodes.push(Bvh2Node::new(around(&ids[part.clone()]), 0, 0));
            pending.push((left + k, part, level + 1));
        }
    }
    tree.primitive_indices = ids;
    tree
}
