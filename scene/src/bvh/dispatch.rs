//! Turns one query into code for the best instruction set that the running processor has.

use glam::vec3;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};
use pulp::{Simd, WithSimd};

use super::lanes::{Lanes, Portable};
#[cfg(target_arch = "x86_64")]
use super::lanes_x86::Avx2;
#[cfg(target_arch = "x86_64")]
use super::lanes_x86_512::Avx512;
use super::ray_frame::RayFrame;
use super::scene_bvh::{Part, SceneBvh};
use super::triangle::Nearest;
use super::walk::{Leaves, RayLanes, Stack, walk};
use super::{Hit, Ray};

/// What the kernels are compiled for; holding a variant proves that the processor has it.
///
/// AVX-512 is used with eight lanes, too, for its registers and its truth values.
#[derive(Clone, Copy, Debug)]
pub(super) enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
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
        found.extend(V4::try_new().map(Instructions::Avx512));
        found.extend(V3::try_new().map(Instructions::Avx2));
    }
    found.push(Instructions::Portable);
    found
}

impl Instructions {
    pub(super) fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            Self::Portable => "portable",
        }
    }

    #[inline(always)]
    pub(super) fn run<const ANY: bool>(self, query: Query<'_, ANY>) -> Answer {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => query.vectorised(simd, Avx512(simd)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => query.vectorised(simd, Avx2(simd)),
            Self::Portable => run_portable(query),
        }
    }
}

/// Not inlined, so that what chooses is small.
#[inline(never)]
fn run_portable<const ANY: bool>(query: Query<'_, ANY>) -> Answer {
    if query.scene.parts.len() == 1 {
        query.run::<_, true>(Portable)
    } else {
        query.run::<_, false>(Portable)
    }
}

/// One ray against one scene, in six registers, as the answer is in two: a ray costs as little as 100 ns, and to load as a
/// whole what was stored in parts waits for the ray before to be finished.
pub(super) struct Query<'a, const ANY: bool> {
    pub(super) scene: &'a SceneBvh,
    pub(super) stack: &'a mut Stack,
    /// Origin, direction and `t_max`: pairs that are never an array in memory.
    ox_oy: u64,
    oz_dx: u64,
    dy_dz: u64,
    t_max: f32,
}

impl<'a, const ANY: bool> Query<'a, ANY> {
    #[inline(always)]
    pub(super) fn new(scene: &'a SceneBvh, stack: &'a mut Stack, ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let (ox_oy, oz_dx, dy_dz) = (pair(o.x, o.y), pair(o.z, d.x), pair(d.y, d.z));
        Self { scene, stack, ox_oy, oz_dx, dy_dz, t_max: ray.t_max }
    }

    #[inline(always)]
    fn ray(&self) -> Ray {
        let ((ox, oy), (oz, dx), (dy, dz)) = (unpair(self.ox_oy), unpair(self.oz_dx), unpair(self.dy_dz));
        Ray { origin: vec3(ox, oy, oz), direction: vec3(dx, dy, dz), t_max: self.t_max }
    }
}

#[inline(always)]
fn pair(low: f32, high: f32) -> u64 {
    u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32
}

#[inline(always)]
fn unpair(bits: u64) -> (f32, f32) {
    (f32::from_bits(bits as u32), f32::from_bits((bits >> 32) as u32))
}

/// A hit as bits: distance and u; v and the triangle's number, which is `u32::MAX` where there is none.
#[derive(Clone, Copy)]
pub(super) struct Answer(u64, u64);

impl Answer {
    const NOTHING: Self = Self(0, u64::MAX);

    #[inline(always)]
    fn new(nearest: &Nearest, t_scale: f32) -> Self {
        let id = if nearest.found { nearest.id } else { u32::MAX };
        Self(pair(nearest.t * t_scale, nearest.u), pair(nearest.v, f32::from_bits(id)))
    }

    #[inline(always)]
    pub(super) fn is_hit(self) -> bool {
        self.1 >> 32 != u64::from(u32::MAX)
    }

    #[inline(always)]
    pub(super) fn hit(self) -> Option<Hit> {
        let ((t, u), (v, _)) = (unpair(self.0), unpair(self.1));
        self.is_hit().then_some(Hit { t, u, v, triangle: (self.1 >> 32) as u32 })
    }
}

/// `ONE`: the scene has one part.
struct With<L, Q, const ONE: bool>(L, Q);

impl<L: Lanes, const ANY: bool, const ONE: bool> WithSimd for With<L, Query<'_, ANY>, ONE> {
    type Output = Answer;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Answer {
        self.1.run::<_, ONE>(self.0)
    }
}

impl<const ANY: bool> Query<'_, ANY> {
    #[inline(always)]
    fn vectorised<S: Simd, L: Lanes>(self, simd: S, l: L) -> Answer {
        if self.scene.parts.len() == 1 {
            simd.vectorize(With::<_, _, true>(l, self))
        } else {
            simd.vectorize(With::<_, _, false>(l, self))
        }
    }

    #[inline(always)]
    fn run<L: Lanes, const ONE: bool>(self, l: L) -> Answer {
        let Some(frame) = RayFrame::new(&self.ray(), self.scene.lo, self.scene.hi) else {
            return Answer::NOTHING;
        };
        let ray = RayLanes::new(l, &frame, self.scene.holes.as_deref());
        let mut nearest = Nearest::none(frame.t_max);
        let stack = (self.stack, 0);
        match self.scene.parts.as_slice() {
            [part] if ONE => {
                let bvh = &*part.bvh;
                let tree = (&*bvh.nodes, bvh.root);
                walk::<L, _, ANY>(l, tree, &*bvh.packets, &ray, stack, &mut nearest);
            }
            _ if ONE => {}
            parts => {
                let tree = (self.scene.top.as_slice(), self.scene.root);
                walk::<L, _, ANY>(l, tree, parts, &ray, stack, &mut nearest);
            }
        }
        Answer::new(&nearest, frame.t_scale)
    }
}

impl<L: Lanes> Leaves<L> for [Part] {
    #[inline(always)]
    fn address(&self, index: u32) -> *const u8 {
        self.as_ptr().wrapping_add(index as usize).cast()
    }

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
        let tree = (&*bvh.nodes, bvh.root);
        walk::<L, _, ANY>(l, tree, &*bvh.packets, ray, stack, nearest);
    }
}
