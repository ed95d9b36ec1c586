//! Turns the lists of a file into the tree of a part, if that is what they are.

use std::ops::Range;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::super::node::{LEAF, NONE, Node};
use super::super::part::Bvh;
use super::super::refit::surface_cost;
use super::super::triangle::{Packet, is_solid};
use super::super::validate::check_part;
use super::renumber;
use crate::kept::Found;

/// Packets checked at a time.
const BATCH: usize = 4096;

/// The tree, if every triangle of `range` that can be hit is in it once, where its corners are now, all boxes enclose what is
/// below them, the depth is bounded, and children come after their parents. All else is computed, not read.
pub(super) fn checked(
    found: Found<Node, Packet>,
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    range: &Range<u32>,
) -> Option<Bvh> {
    let Found { first: nodes, second: mut packets, number: root } = found;
    let corners = |id: u32| -> Option<[Vec3; 3]> {
        let [a, b, c] = *triangles.get(id as usize)?;
        Some([*vertices.get(a as usize)?, *vertices.get(b as usize)?, *vertices.get(c as usize)?])
    };
    packets.items_mut().par_chunks_mut(BATCH).for_each(|batch| renumber(batch, range.start));
    let same = packets.par_chunks(BATCH).all(|batch| batch.iter().all(|packet| is_at(packet, &corners)));
    if !same || !parents_come_first(&nodes) {
        return None;
    }
    // In the order of the builder, as the sign of a zero depends on it.
    let (bounds, solid) = range
        .clone()
        .filter_map(|id| corners(id).filter(is_solid))
        .fold((Aabb::INVALID, 0u32), |(all, count), triangle| {
            (all.union(&Aabb::from_points(&triangle.map(Vec3A::from))), count + 1)
        });
    let (lo, hi) = (bounds.min.into(), bounds.max.into());
    let built_cost = surface_cost(&nodes, lo, hi);
    let ignored = range.len() as u32 - solid;
    let tree = Bvh { nodes, packets, root, lo, hi, triangles: solid, ignored, built_cost };
    check_part(0, &tree, range).is_ok().then_some(tree)
}

/// Whether the triangles of a packet have the corners that their numbers say, bit for bit.
fn is_at(packet: &Packet, corners: &impl Fn(u32) -> Option<[Vec3; 3]>) -> bool {
    (0..packet.ids.0.len()).filter(|&lane| packet.ids.0[lane] != u32::MAX).all(|lane| {
        let bits = |triangle: [[f32; 3]; 3]| triangle.map(|corner| corner.map(f32::to_bits));
        corners(packet.ids.0[lane])
            .is_some_and(|found| bits(found.map(Vec3::into)) == bits(packet.triangle(lane)))
    })
}

/// Whether every node has a greater number than the one above it, as refitting expects.
fn parents_come_first(nodes: &[Node]) -> bool {
    nodes.iter().zip(0u32..).all(|(node, parent)| {
        node.children.0.iter().all(|&child| child == NONE || child & LEAF != 0 || child > parent)
    })
}
