//! Turns the structure of a part whose vertices moved into one of the same tree around them, while that tree is good.
//!
//! Measured on the knot of 100 000 triangles, turned by 10 to 180 degrees: 54 to 57 times as fast as building (3.6 to
//! 5.2 ms instead of 206 to 291 ms), with rays 4 to 7 % slower than in a tree built anew. `cargo bench -p
//! photonstream-scene --bench moves`, two shared cores with AVX2.

use glam::Vec3;

use super::lanes::WIDTH;
use super::node::{LEAF, NONE, Node};
use super::part::Bvh;
use super::triangle::{Packet, is_solid};

/// Parts of fewer triangles are built anew: that is quick, and their tree the best for where they are.
pub(super) const REFIT_FROM: u32 = 1000;

/// How many times the cost at building a refitted tree may cost before it is built anew.
pub(super) const WORST_COST: f64 = 1.5;

impl Bvh {
    /// The same tree around moved vertices; `None` where it is to be built anew: few triangles, a tree that has become
    /// more than [`WORST_COST`] times as expensive, or other triangles that can be hit than when it was built.
    ///
    /// Hits are those of a tree built anew: they do not depend on its shape.
    pub(super) fn refitted(&self, vertices: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        if self.triangles < REFIT_FROM || self.ignored > 0 || self.root & LEAF != 0 {
            return None;
        }
        let mut packets = Vec::with_capacity(self.packets.len());
        let mut packet_bounds = Vec::with_capacity(self.packets.len());
        for packet in self.packets.iter() {
            let (moved, bounds) = moved(packet, vertices, triangles)?;
            packets.push(moved);
            packet_bounds.push(bounds);
        }
        let mut nodes = self.nodes.to_vec();
        let mut node_bounds = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); nodes.len()];
        // Children come after their parents.
        for (index, node) in nodes.iter_mut().enumerate().rev() {
            let mut all = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for slot in 0..WIDTH {
                let child = node.children.0[slot];
                if child == NONE {
                    continue;
                }
                let (lo, hi) = if child & LEAF != 0 {
                    packet_bounds[(child & !LEAF) as usize]
                } else {
                    node_bounds[child as usize]
                };
                node.set(slot, child, lo.to_array(), hi.to_array());
                all = (all.0.min(lo), all.1.max(hi));
            }
            node_bounds[index] = all;
        }
        let (lo, hi) = node_bounds[self.root as usize];
        // A cost that is not a number is not good either.
        let is_good = surface_cost(&nodes, lo, hi) <= WORST_COST * self.built_cost;
        is_good.then(|| Self { nodes: nodes.into(), packets: packets.into(), lo, hi, ..*self })
    }
}

type Bounds = (Vec3, Vec3);

/// A packet with its triangles where their vertices are now, and the bounds of these; `None` if one cannot be hit.
fn moved(packet: &Packet, vertices: &[Vec3], triangles: &[[u32; 3]]) -> Option<(Packet, Bounds)> {
    let mut moved = Packet::EMPTY;
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for lane in 0..WIDTH {
        let id = packet.ids.0[lane];
        if id == u32::MAX {
            continue;
        }
        let [a, b, c] = *triangles.get(id as usize)?;
        let corners = [*vertices.get(a as usize)?, *vertices.get(b as usize)?, *vertices.get(c as usize)?];
        if !is_solid(&corners) {
            return None;
        }
        moved.set(lane, id, &corners);
        for corner in corners {
            (lo, hi) = (lo.min(corner), hi.max(corner));
        }
    }
    Some((moved, (lo, hi)))
}

/// Expected boxes entered by a line through the part: the areas of all children relative to that of the whole.
pub(super) fn surface_cost(nodes: &[Node], lo: Vec3, hi: Vec3) -> f64 {
    let area = |x: f64, y: f64, z: f64| x * y + y * z + z * x;
    let children: f64 = nodes
        .iter()
        .flat_map(|node| {
            (0..WIDTH).filter(|&slot| node.children.0[slot] != NONE).map(move |slot| {
                let [x, y, z] =
                    node.bounds.map(|[lower, upper]| f64::from(upper.0[slot]) - f64::from(lower.0[slot]));
                area(x, y, z)
            })
        })
        .sum();
    let [x, y, z] = (hi.as_dvec3() - lo.as_dvec3()).to_array();
    children / area(x, y, z)
}
