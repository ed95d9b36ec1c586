//! Turns a structure into proof that every invariant of its layout holds, or the first that does not.

use std::ops::Range;

use glam::Vec3;

use super::error::BvhError;
use super::lanes::WIDTH;
use super::node::{LEAF, NONE, Node};
use super::part::Bvh;
use super::scene_bvh::SceneBvh;
use super::triangle::is_solid;
use super::walk::MAX_DEPTH;

impl SceneBvh {
    /// Walks every node, packet and triangle of every part and of the top level.
    ///
    /// # Errors
    /// The first broken invariant: a reference out of range or used twice, a box that does not enclose what lies
    /// under it, a depth beyond the traversal stack, a triangle missing, doubled, foreign or impossible to hit.
    pub fn validate(&self) -> Result<(), BvhError> {
        for (number, part) in self.parts.iter().enumerate() {
            check_part(number, &part.bvh, &part.range)?;
        }
        let mut leaves = vec![false; self.parts.len()];
        check_tree("top level", &self.top, self.root, &mut leaves, |part| {
            let bvh = &self.parts[part].bvh;
            Ok((bvh.lo, bvh.hi))
        })?;
        for (number, (part, seen)) in self.parts.iter().zip(leaves).enumerate() {
            if seen == part.bvh.is_empty() {
                return Err(BvhError::PartMissing { part: number });
            }
        }
        Ok(())
    }
}

pub(super) fn check_part(number: usize, bvh: &Bvh, range: &Range<u32>) -> Result<(), BvhError> {
    let tree = format!("part {number}");
    let mut seen = vec![false; range.len()];
    let mut packets = vec![false; bvh.packets.len()];
    check_tree(&tree, &bvh.nodes, bvh.root, &mut packets, |index| {
        let packet = &bvh.packets[index];
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for lane in 0..WIDTH {
            let id = packet.ids.0[lane];
            let corners = packet.triangle(lane).map(Vec3::from);
            if id == u32::MAX {
                if corners.iter().any(|v| !v.is_nan_mask().all()) {
                    return Err(BvhError::LaneNotEmpty { tree: tree.clone(), packet: index, lane });
                }
                continue;
            }
            let slot = range.contains(&id).then(|| &mut seen[(id - range.start) as usize]);
            match slot {
                Some(slot) if !*slot && is_solid(&corners) => *slot = true,
                _ => return Err(BvhError::Triangle { tree: tree.clone(), triangle: id }),
            }
            for corner in corners {
                (lo, hi) = (lo.min(corner), hi.max(corner));
            }
        }
        Ok((lo, hi))
    })?;
    if let Some(packet) = packets.iter().position(|seen| !seen) {
        return Err(BvhError::Unreached { tree, what: "packet", index: packet });
    }
    let found = seen.iter().filter(|seen| **seen).count();
    if found != bvh.triangles as usize || found + bvh.ignored as usize != range.len() {
        return Err(BvhError::TriangleCount { tree, expected: bvh.triangles as usize, found });
    }
    Ok(())
}

/// Checks shape and boxes of one tree; `leaf` returns the exact bounds of a leaf's content.
fn check_tree(
    tree: &str,
    nodes: &[Node],
    root: u32,
    leaves: &mut [bool],
    mut leaf: impl FnMut(usize) -> Result<(Vec3, Vec3), BvhError>,
) -> Result<(), BvhError> {
    let mut reached = vec![false; nodes.len()];
    let mut pending = vec![];
    if root != NONE {
        pending.push((root, Vec3::NEG_INFINITY, Vec3::INFINITY, 0));
    }
    while let Some((reference, lo, hi, depth)) = pending.pop() {
        let name = || tree.to_owned();
        let is_leaf = reference & LEAF != 0;
        let index = (reference & !LEAF) as usize;
        let flags = if is_leaf { &mut *leaves } else { &mut reached };
        match flags.get_mut(index) {
            Some(flag) if !*flag => *flag = true,
            _ => return Err(BvhError::Reference { tree: name(), reference }),
        }
        if depth > MAX_DEPTH {
            return Err(BvhError::Depth { tree: name(), found: depth, limit: MAX_DEPTH });
        }
        if is_leaf {
            let (content_lo, content_hi) = leaf(index)?;
            if content_lo.cmplt(lo).any() || content_hi.cmpgt(hi).any() {
                return Err(BvhError::NotEnclosed { tree: name(), reference });
            }
            continue;
        }
        for slot in 0..WIDTH {
            let child = nodes[index].children.0[slot];
            let [x, y, z] = nodes[index].bounds.map(|[lower, upper]| (lower.0[slot], upper.0[slot]));
            let (child_lo, child_hi) = (Vec3::new(x.0, y.0, z.0), Vec3::new(x.1, y.1, z.1));
            if child == NONE {
                if child_lo != Vec3::INFINITY || child_hi != Vec3::NEG_INFINITY {
                    return Err(BvhError::NotEnclosed { tree: name(), reference: child });
                }
                continue;
            }
            let enclosed =
                child_lo.cmpge(lo).all() && child_hi.cmple(hi).all() && child_lo.cmple(child_hi).all();
            if !enclosed {
                return Err(BvhError::NotEnclosed { tree: name(), reference: child });
            }
            pending.push((child, child_lo, child_hi, depth + 1));
        }
    }
    match reached.iter().position(|reached| !reached) {
        Some(index) => Err(BvhError::Unreached { tree: tree.to_owned(), what: "node", index }),
        None => Ok(()),
    }
}
