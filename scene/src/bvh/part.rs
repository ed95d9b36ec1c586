//! Turns the triangles of one part of a scene into an eight-wide tree of nodes and triangle packets.

use std::collections::HashMap;
use std::ops::Range;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::collapse::collapse;
use super::lanes::WIDTH;
use super::node::{NONE, Node};
use super::pages::Pages;
use super::refit::surface_cost;
use super::split::split;
use super::triangle::{Packet, is_solid};

/// Part of the nodes that the first pass of reinsertion considers.
const REINSERTED: f32 = 0.2;
/// The same above [`CLUSTERED_UP_TO`] triangles, where building time matters more than a few per cent of ray speed.
const REINSERTED_IN_LARGE: f32 = 0.01;
/// Reinsertion is left out if more than one node in this many has two children of its own size.
const STACKED_PART: usize = 32;
/// Up to this number of triangles both ways of building are tried.
const CLUSTERED_UP_TO: usize = 300_000;

/// Clustering is left out if more boxes than this are the same: it would join one pair of them a pass.
const LARGEST_STACK: usize = 64;

/// What decides how large parts are built.
pub(super) const PARAMETERS: [u64; 5] = [
    REINSERTED.to_bits() as u64,
    REINSERTED_IN_LARGE.to_bits() as u64,
    STACKED_PART as u64,
    CLUSTERED_UP_TO as u64,
    LARGEST_STACK as u64,
];

/// The ray-tracing structure of one part: world-space triangles under eight-wide nodes.
#[derive(Clone, Debug)]
pub struct Bvh {
    pub(super) nodes: Pages<Node>,
    pub(super) packets: Pages<Packet>,
    pub(super) root: u32,
    pub(super) lo: Vec3,
    pub(super) hi: Vec3,
    pub(super) triangles: u32,
    pub(super) ignored: u32,
    /// Surface cost of the tree when it was built; see [`surface_cost`].
    pub(super) built_cost: f64,
}

impl Bvh {
    /// Builds over the triangles `range`; see [`super::SceneBvh::build`] for those that are left out.
    pub(super) fn build(vertices: &[Vec3], triangles: &[[u32; 3]], range: Range<u32>) -> Self {
        let corners = |id: u32| -> Option<[Vec3; 3]> {
            let [a, b, c] = *triangles.get(id as usize)?;
            Some([*vertices.get(a as usize)?, *vertices.get(b as usize)?, *vertices.get(c as usize)?])
        };
        let asked = range.len();
        let ids: Vec<u32> =
            range.filter(|&id| corners(id).is_some_and(|triangle| is_solid(&triangle))).collect();
        let solid = |local: u32| {
            let id = ids[local as usize];
            (id, corners(id).expect("invariant: only triangles with all corners are kept"))
        };
        let boxes: Vec<Aabb> =
            (0..ids.len() as u32).map(|local| Aabb::from_points(&solid(local).1.map(Vec3A::from))).collect();

        let mut packets = Vec::new();
        let tree = binary_tree(&boxes);
        let wide = collapse(&tree, &boxes, WIDTH, |leaf| {
            let mut packet = Packet::EMPTY;
            for (lane, &local) in leaf.iter().enumerate() {
                let (id, triangle) = solid(local);
                packet.set(lane, id, &triangle);
            }
            packets.push(packet);
            (packets.len() - 1) as u32
        });
        let bounds = boxes.iter().fold(Aabb::INVALID, |all, b| all.union(b));
        let built_cost = surface_cost(&wide.nodes, bounds.min.into(), bounds.max.into());
        Self {
            nodes: wide.nodes.into(),
            packets: packets.into(),
            root: wide.root,
            lo: bounds.min.into(),
            hi: bounds.max.into(),
            triangles: ids.len() as u32,
            ignored: (asked - ids.len()) as u32,
            built_cost,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.root == NONE
    }
}

/// A binary tree with one box per leaf: cut from the top, or clustered from below where that comes out cheaper.
///
/// Flat, regular geometry (walls) wants cuts, scattered detail wants clusters.
pub(super) fn binary_tree(boxes: &[Aabb]) -> Bvh2 {
    let mut cut = split(boxes);
    improve(&mut cut);
    if boxes.len() > CLUSTERED_UP_TO || boxes.len() < 2 || largest_stack(boxes) > LARGEST_STACK {
        return cut;
    }
    let mut clustered = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::High,
        boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        2,
    );
    improve(&mut clustered);
    if inner_area(&clustered) < inner_area(&cut) { clustered } else { cut }
}

/// Number of boxes that are the same, at most.
fn largest_stack(boxes: &[Aabb]) -> usize {
    let mut heights = HashMap::with_capacity(boxes.len());
    for bounds in boxes {
        let key = [bounds.min, bounds.max].map(|corner| corner.to_array().map(f32::to_bits));
        *heights.entry(key).or_insert(0usize) += 1;
    }
    heights.into_values().max().unwrap_or(0)
}

/// Moves subtrees to cheaper places, unless many lie on top of each other: the search for a place could then reject
/// nothing and would take quadratic time, in vain.
fn improve(tree: &mut Bvh2) {
    let area = |node: u32| tree.nodes[node as usize].aabb().half_area();
    let stacked = tree.nodes.iter().filter(|node| {
        let (left, right) = (node.first_index, node.first_index + 1);
        !node.is_leaf()
            && [left, right]
                .iter()
                .all(|&child| !tree.nodes[child as usize].is_leaf() && area(child) >= node.aabb().half_area())
    });
    if stacked.count() > tree.nodes.len() / STACKED_PART {
        return;
    }
    let large = tree.primitive_indices.len() > CLUSTERED_UP_TO;
    let part = if large { REINSERTED_IN_LARGE } else { REINSERTED };
    ReinsertionOptimizer::default().run(tree, part, None);
}

/// Area of all inner nodes: what a random line pays.
fn inner_area(tree: &Bvh2) -> f64 {
    tree.nodes.iter().filter(|node| !node.is_leaf()).map(|node| f64::from(node.aabb().half_area())).sum()
}
