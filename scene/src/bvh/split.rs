//! Turns boxes into a binary tree from the top down, each cut at the least surface-area cost.
//!
//! Source: Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"; deviates: a set costs
//! packets instead of boxes, small sets try every cut, leaves hold one box (the collapse decides how many share a leaf), nothing
//! recurses.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

use super::lanes::WIDTH;

/// Candidate cuts per axis of large sets are the borders of this many bins.
const BINS: usize = 32;
/// Sets up to this size try every cut between sorted centres.
const SWEEP_UP_TO: usize = 64;

/// What a set costs in units of its area: packets, taken as half filled.
#[inline(always)]
fn packets(count: usize) -> f32 {
    count.div_ceil(WIDTH / 2) as f32
}

#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    index: u32,
}

impl Item {
    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> Vec3A {
        self.bounds.min + self.bounds.max
    }
}

/// A binary tree with one box per leaf; depth is not bounded.
pub(super) fn split(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = Bvh2::default();
    if boxes.is_empty() {
        return tree;
    }
    let mut items: Vec<Item> = boxes.iter().zip(0..).map(|(&bounds, index)| Item { bounds, index }).collect();
    let bounds = items.iter().fold(Aabb::INVALID, |all, item| all.union(&item.bounds));
    tree.nodes = Vec::with_capacity(2 * items.len() - 1);
    tree.nodes.push(Bvh2Node::new(bounds, 0, 0));
    let mut pending = vec![(0usize, 0usize, items.len(), 1usize)];
    while let Some((node, start, end, depth)) = pending.pop() {
        tree.max_depth = tree.max_depth.max(depth + 1);
        if end - start == 1 {
            let bounds = *tree.nodes[node].aabb();
            tree.nodes[node] = Bvh2Node::new(bounds, 1, start as u32);
            continue;
        }
        let middle = start + cut(&mut items[start..end]);
        let left = tree.nodes.len();
        tree.nodes[node] = Bvh2Node::new(*tree.nodes[node].aabb(), 0, left as u32);
        for part in [start..middle, middle..end] {
            let bounds = items[part].iter().fold(Aabb::INVALID, |all, item| all.union(&item.bounds));
            tree.nodes.push(Bvh2Node::new(bounds, 0, 0));
        }
        pending.push((left + 1, middle, end, depth + 1));
        pending.push((left, start, middle, depth + 1));
    }
    tree.primitive_indices = items.iter().map(|item| item.index).collect();
    tree
}

/// Reorders at least two items so that the best cut lies before the returned position, which is neither end.
fn cut(items: &mut [Item]) -> usize {
    let (lo, hi) = items.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(lo, hi), item| {
        (lo.min(item.centre()), hi.max(item.centre()))
    });
    let found = if items.len() <= SWEEP_UP_TO { sweep(items, lo, hi) } else { bin(items, lo, hi) };
    found.filter(|&middle| 0 < middle && middle < items.len()).unwrap_or(items.len() / 2)
}

/// Tries every cut between centres sorted along each axis.
fn sweep(items: &mut [Item], lo: Vec3A, hi: Vec3A) -> Option<usize> {
    let mut best: Option<(f32, usize, usize)> = None;
    let mut left_cost = [0.0f32; SWEEP_UP_TO];
    for axis in 0..3 {
        if lo[axis] >= hi[axis] {
            continue;
        }
        sort(items, axis);
        let mut bounds = Aabb::INVALID;
        for (i, item) in items.iter().enumerate() {
            bounds = bounds.union(&item.bounds);
            left_cost[i] = bounds.half_area() * packets(i + 1);
        }
        bounds = Aabb::INVALID;
        for i in (1..items.len()).rev() {
            bounds = bounds.union(&items[i].bounds);
            let cost = left_cost[i - 1] + bounds.half_area() * packets(items.len() - i);
            if best.is_none_or(|best| cost < best.0) {
                best = Some((cost, axis, i));
            }
        }
    }
    let (_, axis, middle) = best?;
    sort(items, axis);
    Some(middle)
}

fn sort(items: &mut [Item], axis: usize) {
    items.sort_unstable_by(|a, b| a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.index.cmp(&b.index)));
}

/// Tries the borders of equal bins of the centres along each axis.
fn bin(items: &mut [Item], lo: Vec3A, hi: Vec3A) -> Option<usize> {
    let extent = hi - lo;
    // Axes without extent put everything into bin 0 and offer no cut.
    let scale = Vec3A::select(extent.cmpgt(Vec3A::ZERO), BINS as f32 / extent, Vec3A::ZERO);
    let slot = |item: &Item| ((item.centre() - lo) * scale).min(Vec3A::splat(BINS as f32 - 1.0));
    let mut bins = [[(Aabb::INVALID, 0usize); BINS]; 3];
    for item in items.iter() {
        let slot = slot(item);
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[slot[axis] as usize % BINS];
            *bin = (bin.0.union(&item.bounds), bin.1 + 1);
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    for (axis, bins) in bins.iter().enumerate() {
        let mut left_cost = [0.0f32; BINS];
        let (mut bounds, mut count) = (Aabb::INVALID, 0);
        for (cost, bin) in left_cost.iter_mut().zip(bins) {
            (bounds, count) = (bounds.union(&bin.0), count + bin.1);
            *cost = if count == 0 { f32::INFINITY } else { bounds.half_area() * packets(count) };
        }
        (bounds, count) = (Aabb::INVALID, 0);
        for i in (1..BINS).rev() {
            (bounds, count) = (bounds.union(&bins[i].0), count + bins[i].1);
            let cost = left_cost[i - 1] + bounds.half_area() * packets(count);
            if count > 0 && cost.is_finite() && best.is_none_or(|best| cost < best.0) {
                best = Some((cost, axis, i));
            }
        }
    }
    let (_, axis, border) = best?;
    let mut middle = 0;
    for i in 0..items.len() {
        if (slot(&items[i])[axis] as usize) < border {
            items.swap(i, middle);
            middle += 1;
        }
    }
    Some(middle)
}
