//! Turns the parts of a scene into one structure that answers closest-hit and occlusion queries.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::cache::TreeCache;
use super::collapse::collapse;
use super::dispatch::{Answer, Instructions, Query, detect};
use super::node::{NONE, Node};
use super::part::{Bvh, binary_tree};
use super::walk::Stack;
use super::{Hit, Holes, Ray};

/// Parts under a small top level; a clone shares the parts.
#[derive(Clone, Debug)]
pub struct SceneBvh {
    pub(super) parts: Vec<Part>,
    pub(super) top: Vec<Node>,
    pub(super) root: u32,
    pub(super) lo: Vec3,
    pub(super) hi: Vec3,
    pub(super) instructions: Instructions,
    pub(super) holes: Option<Arc<Holes>>,
}

/// A part's triangles by number, and their structure.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) range: Range<u32>,
    pub(super) bvh: Arc<Bvh>,
}

impl SceneBvh {
    /// Builds one structure per range of triangle numbers in `parts`: a still part, one for each moving object.
    ///
    /// `vertices` are in metres, in world space. Triangles that cannot be hit are left out and counted in
    /// [`Self::ignored`]: corner numbers outside `vertices`, coordinates not finite or beyond
    /// [`super::MAX_COORDINATE`], zero area; so are numbers in `parts` beyond `triangles`.
    ///
    /// Parts are built at once in the current thread pool of rayon; the structure is the same for any number of threads.
    pub fn build(vertices: &[Vec3], triangles: &[[u32; 3]], parts: &[Range<u32>]) -> Self {
        Self::of_parts(build_parts(parts, |range| Bvh::build(vertices, triangles, range)))
    }

    /// As [`Self::build`], with the trees of large parts from `cache` where it has them, and kept there where not.
    pub(crate) fn build_cached(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        parts: &[Range<u32>],
        cache: Option<&TreeCache>,
    ) -> Self {
        let Some(cache) = cache else { return Self::build(vertices, triangles, parts) };
        Self::of_parts(build_parts(parts, |range| cache.tree(vertices, triangles, range)))
    }

    fn of_parts(parts: Vec<Part>) -> Self {
        let mut scene = Self {
            parts,
            top: Vec::new(),
            root: NONE,
            lo: Vec3::ZERO,
            hi: Vec3::ZERO,
            instructions: detect(),
            holes: None,
        };
        scene.build_top();
        scene
    }

    /// Brings part number `part` up to date after its vertices moved; the others are shared, not touched.
    ///
    /// The tree of a large part is kept, with its boxes around the moved triangles, as long as it is good: see
    /// `refit.rs`. Hits are the same either way.
    ///
    /// A number that is not a part changes nothing.
    pub fn rebuild_part(&mut self, part: usize, vertices: &[Vec3], triangles: &[[u32; 3]]) {
        self.rebuild_parts([part], vertices, triangles);
    }

    /// As [`Self::rebuild_part`] for each of several parts, with one new top level for all of them.
    pub fn rebuild_parts(
        &mut self,
        parts: impl IntoIterator<Item = usize>,
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
    ) {
        let mut any = false;
        for part in parts {
            let Some(part) = self.parts.get_mut(part) else { continue };
            let refitted = part.bvh.refitted(vertices, triangles);
            let bvh = refitted.unwrap_or_else(|| Bvh::build(vertices, triangles, part.range.clone()));
            part.bvh = Arc::new(bvh);
            any = true;
        }
        if any {
            self.build_top();
        }
    }

    /// Takes over where triangles have holes; they have none after [`Self::build`].
    pub(crate) fn set_holes(&mut self, holes: Option<Holes>) {
        self.holes = holes.map(Arc::new);
    }

    /// Whether any triangle has holes.
    pub fn has_holes(&self) -> bool {
        self.holes.is_some()
    }

    fn build_top(&mut self) {
        let filled: Vec<u32> =
            (0..self.parts.len() as u32).filter(|&i| !self.parts[i as usize].bvh.is_empty()).collect();
        let boxes: Vec<Aabb> = filled
            .iter()
            .map(|&i| &self.parts[i as usize].bvh)
            .map(|bvh| Aabb::new(bvh.lo.into(), bvh.hi.into()))
            .collect();
        let wide = collapse(&binary_tree(&boxes), &boxes, 1, |leaf| filled[leaf[0] as usize]);
        let bounds = boxes.iter().fold(Aabb::INVALID, |all, b| all.union(b));
        (self.lo, self.hi) =
            if boxes.is_empty() { (Vec3::ZERO, Vec3::ZERO) } else { (bounds.min.into(), bounds.max.into()) };
        (self.top, self.root) = (wide.nodes, wide.root);
    }

    /// The hit with the smallest distance, of several at that distance the one with the lowest triangle number.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.run::<false>(ray).hit()
    }

    /// Whether anything is hit at all; the same as `closest(ray).is_some()`, and faster.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.run::<true>(ray).is_hit()
    }

    #[inline(always)]
    fn run<const ANY: bool>(&self, ray: &Ray) -> Answer {
        let mut stack = Stack::take();
        let answer = self.instructions.run(Query::<ANY>::new(self, &mut stack, ray));
        stack.put_back();
        answer
    }

    /// Lower and upper corner of all triangles that can be hit; twice the origin if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.lo, self.hi)
    }

    /// Structures of the parts, in the order they were given.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = &Bvh> {
        self.parts.iter().map(|part| &*part.bvh)
    }

    /// Number of triangles left out because no ray can hit them.
    pub fn ignored(&self) -> usize {
        self.parts().map(|bvh| bvh.ignored as usize).sum()
    }

    /// Instruction set in use: `"avx512"` (on eight lanes), `"avx2"` (with FMA) or `"portable"`.
    pub fn instruction_set(&self) -> &'static str {
        self.instructions.name()
    }
}

/// The structure of each range, in their order; the largest are begun first, so that none keeps all others waiting at the end.
fn build_parts(ranges: &[Range<u32>], build: impl Fn(Range<u32>) -> Bvh + Sync) -> Vec<Part> {
    let mut order: Vec<usize> = (0..ranges.len()).collect();
    order.sort_by_key(|&part| std::cmp::Reverse(ranges[part].len()));
    // A bridge hands them out one by one; splitting the list would give one thread all the large ones.
    let mut built: Vec<(usize, Part)> = order
        .into_iter()
        .par_bridge()
        .map(|part| {
            let range = ranges[part].clone();
            (part, Part { range: range.clone(), bvh: Arc::new(build(range)) })
        })
        .collect();
    built.sort_unstable_by_key(|(part, _)| *part);
    built.into_iter().map(|(_, part)| part).collect()
}
