//! Turns the eight-lane vocabulary into AVX2 and FMA instructions.

use std::arch::x86_64::{__m256, __m256i};

use pulp::cast;
use pulp::x86::V3;

use super::lanes::{F32x8, Lanes, Slab, U32x8};

/// Holding a [`V3`] proves that the processor has AVX2 and FMA.
#[derive(Clone, Copy)]
pub(super) struct Avx2(pub(super) V3);

pub(super) const ALL_BITS: i32 = -1;
/// In bytes.
const CACHE_LINE: usize = 64;

impl Avx2 {
    /// One layer of a descending sorting network: lanes set in `KEEP_MAX` take the larger of the pair.
    #[inline(always)]
    fn layer<const KEEP_MAX: i32>(self, keys: __m256i, partner: __m256i) -> __m256i {
        let avx2 = self.0.avx2;
        avx2._mm256_blend_epi32::<KEEP_MAX>(
            avx2._mm256_min_epi32(keys, partner),
            avx2._mm256_max_epi32(keys, partner),
        )
    }

    /// `max(near…, 0)` and `min(far…, t_max)` as integers, whose minima and maxima take one cycle instead of four: floats
    /// that are not negative order as integers; a negative one is below them all, whichever negative one it is. So a
    /// negative entry becomes 0, and a negative exit remains below every entry.
    #[inline(always)]
    pub(super) fn entry_and_exit(
        self,
        near: [__m256; 3],
        far: [__m256; 3],
        t_max: __m256,
    ) -> (__m256i, __m256i) {
        let (avx, avx2) = (self.0.avx, self.0.avx2);
        let entry = avx2._mm256_max_epi32(
            avx2._mm256_max_epi32(cast(near[0]), cast(near[1])),
            avx2._mm256_max_epi32(cast(near[2]), avx._mm256_setzero_si256()),
        );
        let exit = avx2._mm256_min_epi32(
            avx2._mm256_min_epi32(cast(far[0]), cast(far[1])),
            avx2._mm256_min_epi32(cast(far[2]), cast(t_max)),
        );
        (entry, exit)
    }

    /// Eight signed integers in descending order: the bitonic network, six layers.
    #[inline(always)]
    fn sort_descending(self, keys: __m256i) -> __m256i {
        let avx2 = self.0.avx2;
        let reversed: __m256i = cast([7u32, 6, 5, 4, 3, 2, 1, 0]);
        let keys = self.layer::<0b0101_0101>(keys, avx2._mm256_shuffle_epi32::<0b10_11_00_01>(keys));
        let keys = self.layer::<0b0011_0011>(keys, avx2._mm256_shuffle_epi32::<0b00_01_10_11>(keys));
        let keys = self.layer::<0b0101_0101>(keys, avx2._mm256_shuffle_epi32::<0b10_11_00_01>(keys));
        let keys = self.layer::<0b0000_1111>(keys, avx2._mm256_permutevar8x32_epi32(keys, reversed));
        let keys = self.layer::<0b0011_0011>(keys, avx2._mm256_shuffle_epi32::<0b01_00_11_10>(keys));
        self.layer::<0b0101_0101>(keys, avx2._mm256_shuffle_epi32::<0b10_11_00_01>(keys))
    }
}

impl Lanes for Avx2 {
    type F = __m256;
    type M = __m256;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        self.0.avx._mm256_set1_ps(value)
    }
    #[inline(always)]
    fn load(self, values: &F32x8) -> __m256 {
        cast(*values)
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_sub_ps(a, b)
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_mul_ps(a, b)
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_min_ps(a, b)
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_max_ps(a, b)
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LE_OQ }>(a, b)
    }
    #[inline(always)]
    fn or(self, a: __m256, b: __m256) -> __m256 {
        self.0.avx._mm256_or_ps(a, b)
    }
    #[inline(always)]
    fn bits(self, mask: __m256) -> u32 {
        self.0.avx._mm256_movemask_ps(mask).cast_unsigned()
    }
    #[inline(always)]
    fn slab(self, plane: __m256, slab: &Slab<__m256>) -> __m256 {
        self.0.fma._mm256_fmsub_ps(plane, slab.inverse, slab.offset)
    }
    /// As integers: see [`Self::entry_and_exit`].
    #[inline(always)]
    fn overlap(self, near: [__m256; 3], far: [__m256; 3], t_max: __m256) -> (__m256, __m256) {
        let (avx, avx2) = (self.0.avx, self.0.avx2);
        let (entry, exit) = self.entry_and_exit(near, far, t_max);
        let apart = avx2._mm256_cmpgt_epi32(entry, exit);
        let all = avx._mm256_set1_epi32(ALL_BITS);
        (cast(avx2._mm256_xor_si256(apart, all)), cast(entry))
    }
    #[inline(always)]
    fn store(self, value: __m256) -> F32x8 {
        cast(value)
    }
    #[inline(always)]
    fn prefetch(self, address: *const u8) {
        for line in 0..4 {
            let address = address.wrapping_add(line * CACHE_LINE).cast::<i8>();
            self.0.sse._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(address);
        }
    }
    #[inline(always)]
    fn order(self, mask: __m256, near: __m256, children: &U32x8) -> (U32x8, F32x8) {
        let (avx, avx2) = (self.0.avx, self.0.avx2);
        // Non-negative floats order as integers; the low three bits make room for the lane, lanes not hit become -1.
        let lane: __m256i = cast([0u32, 1, 2, 3, 4, 5, 6, 7]);
        let distance_bits = avx._mm256_set1_epi32(0x7fff_fff8);
        let keys = avx2._mm256_or_si256(avx2._mm256_and_si256(cast(near), distance_bits), lane);
        let none = avx._mm256_set1_epi32(ALL_BITS);
        let keys: __m256i = cast(avx._mm256_blendv_ps(cast(none), cast(keys), mask));
        let keys = self.sort_descending(keys);
        let refs = avx2._mm256_permutevar8x32_epi32(cast(*children), keys);
        (cast(refs), cast(avx2._mm256_and_si256(keys, distance_bits)))
    }
}
