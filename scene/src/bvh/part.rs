//! Turns the triangles of one part of a scene into an eight-wide tree of nodes and triangle packets.

use std::ops::Range;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;

use super::collapse::collapse;
use super::lanes::WIDTH;
use super::node::{NONE, Node};
use super::triangle::{Packet, is_solid};

/// Above this number of triangles building saves time at the price of a few per cent of ray speed.
const FAST_BUILD_FROM: usize = 2_000_000;

/// The ray-tracing structure of one part: world-space triangles under eight-wide nodes.
#[derive(Clone, Debug)]
pub struct Bvh {
    pub(super) nodes: Vec<Node>,
    pub(super) packets: Vec<Packet>,
    pub(super) root: u32,
    pub(super) lo: Vec3,
    pub(super) hi: Vec3,
    pub(super) triangles: u32,
    pub(super) ignored: u32,
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
        Self {
            nodes: wide.nodes,
            packets,
            root: wide.root,
            lo: bounds.min.into(),
            hi: bounds.max.into(),
            triangles: ids.len() as u32,
            ignored: (asked - ids.len()) as u32,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.root == NONE
    }
}

/// A binary tree with one box per leaf, by locally ordered clustering and reinsertion.
pub(super) fn binary_tree(boxes: &[Aabb]) -> Bvh2 {
    if boxes.is_empty() {
        return Bvh2::default();
    }
    let params = if boxes.len() < FAST_BUILD_FROM {
        BvhBuildParams::slow_build()
    } else {
        BvhBuildParams::fast_build()
    };
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut tree, params.reinsertion_batch_ratio, None);
    tree
}
