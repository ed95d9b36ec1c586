//! Turns one query into code for the best instruction set that the running processor has.

#[cfg(target_arch = "x86_64")]
use pulp::x86::V3;
use pulp::{Simd, WithSimd};

use super::lanes::{Lanes, Portable};
#[cfg(target_arch = "x86_64")]
use super::lanes_x86::Avx2;
use super::ray_frame::RayFrame;
use super::scene_bvh::{Part, SceneBvh};
use super::triangle::Nearest;
use super::walk::{Leaves, RayLanes, Stack, walk};

/// What the kernels are compiled for; holding a variant proves that the processor has it.
///
/// AVX-512 has no variant: the same eight lanes compiled for it ran at 0.7 of the speed of AVX2, as the compiler then
/// gathers the corners of single triangles with masked 512-bit loads.
#[derive(Clone, Copy, Debug)]
pub(super) enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    Portable,
}

/// The best this processor has.
pub(super) fn detect() -> Instructions {
    all().into_iter().next().unwrap_or(Instructions::Portable)
}

/// Everything this processor has, best first.
pub(super) fn all() -> Vec<Instructions> {
    let mut found = Vec::new();
    #[cfg(target_arch = "x86_64")]
    {
        found.extend(V3::try_new().map(Instructions::Avx2));
    }
    found.push(Instructions::Portable);
    found
}

impl Instructions {
    pub(super) fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            Self::Portable => "portable",
        }
    }

    #[inline(always)]
    pub(super) fn run<const ANY: bool>(self, query: Query<'_, ANY>) -> Nearest {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => Simd::vectorize(simd, With(Avx2(simd), query)),
            Self::Portable => query.run(Portable),
        }
    }
}

/// One ray against one scene.
pub(super) struct Query<'a, const ANY: bool> {
    pub(super) scene: &'a SceneBvh,
    pub(super) frame: &'a RayFrame,
    pub(super) stack: &'a mut Stack,
}

struct With<L, Q>(L, Q);

impl<L: Lanes, const ANY: bool> WithSimd for With<L, Query<'_, ANY>> {
    type Output = Nearest;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Nearest {
        self.1.run(self.0)
    }
}

impl<const ANY: bool> Query<'_, ANY> {
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Nearest {
        let ray = RayLanes::new(l, self.frame, self.scene.holes.as_deref());
        let mut nearest = Nearest::none(self.frame.t_max);
        let stack = (self.stack, 0);
        match self.scene.parts.as_slice() {
            [part] => {
                let bvh = &*part.bvh;
                let tree = (bvh.nodes.as_slice(), bvh.root);
                walk::<L, _, ANY>(l, tree, bvh.packets.as_slice(), &ray, stack, &mut nearest);
            }
            parts => {
                let tree = (self.scene.top.as_slice(), self.scene.root);
                walk::<L, _, ANY>(l, tree, parts, &ray, stack, &mut nearest);
            }
        }
        nearest
    }
}

impl<L: Lanes> Leaves<L> for [Part] {
    #[inline(always)]
    fn intersect<const ANY: bool>(
        &self,
        l: L,
        ray: &RayLanes<'_, L>,
        index: u32,
        stack: (&mut Stack, usize),
        nearest: &mut Nearest,
    ) {
        let bvh = &*self[index as usize].bvh;
        let tree = (bvh.nodes.as_slice(), bvh.root);
        walk::<L, _, ANY>(l, tree, bvh.packets.as_slice(), ray, stack, nearest);
    }
}
