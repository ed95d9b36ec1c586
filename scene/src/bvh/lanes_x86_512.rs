//! Turns the eight-lane vocabulary into AVX-512 instructions on 256-bit registers: 32 of them, and truth values as bits.

use std::arch::x86_64::{__m256, __m256i};

use pulp::cast;
use pulp::x86::V4;

use super::lanes::{F32x8, Lanes, Slab, U32x8};
use super::lanes_x86::{ALL_BITS, Avx2};

/// Holding a [`V4`] proves that the processor has AVX-512 F, VL, BW, CD and DQ; what AVX2 has already is taken from
/// there, and compiled anew.
#[derive(Clone, Copy)]
pub(super) struct Avx512(pub(super) V4);

impl Avx512 {
    #[inline(always)]
    fn avx2(self) -> Avx2 {
        Avx2(*self.0)
    }

    /// As [`Avx2`]'s layer, in two instructions instead of three.
    #[inline(always)]
    fn layer<const KEEP_MAX: u8>(self, keys: __m256i, partner: __m256i) -> __m256i {
        let smaller = self.0.avx2._mm256_min_epi32(keys, partner);
        self.0.avx512f._mm256_mask_max_epi32(smaller, KEEP_MAX, keys, partner)
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

impl Lanes for Avx512 {
    type F = __m256;
    type M = u8;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        self.avx2().splat(value)
    }
    #[inline(always)]
    fn load(self, values: &F32x8) -> __m256 {
        self.avx2().load(values)
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        self.avx2().sub(a, b)
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        self.avx2().mul(a, b)
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        self.avx2().min(a, b)
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        self.avx2().max(a, b)
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u8 {
        self.0.avx512f._mm256_cmp_ps_mask::<{ std::arch::x86_64::_CMP_LE_OQ }>(a, b)
    }
    #[inline(always)]
    fn or(self, a: u8, b: u8) -> u8 {
        a | b
    }
    #[inline(always)]
    fn bits(self, mask: u8) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    fn slab(self, plane: __m256, slab: &Slab<__m256>) -> __m256 {
        self.avx2().slab(plane, slab)
    }
    /// As integers, as with AVX2.
    #[inline(always)]
    fn overlap(self, near: [__m256; 3], far: [__m256; 3], t_max: __m256) -> (u8, __m256) {
        let (entry, exit) = self.avx2().entry_and_exit(near, far, t_max);
        (self.0.avx512f._mm256_cmple_epi32_mask(entry, exit), cast(entry))
    }
    #[inline(always)]
    fn store(self, value: __m256) -> F32x8 {
        self.avx2().store(value)
    }
    #[inline(always)]
    fn prefetch(self, address: *const u8) {
        self.avx2().prefetch(address);
    }
    #[inline(always)]
    fn order(self, mask: u8, near: __m256, children: &U32x8) -> (U32x8, F32x8) {
        let (avx, avx2) = (self.0.avx, self.0.avx2);
        // Non-negative floats order as integers; the low three bits make room for the lane, lanes not hit become -1.
        let lane: __m256i = cast([0u32, 1, 2, 3, 4, 5, 6, 7]);
        let distance_bits = avx._mm256_set1_epi32(0x7fff_fff8);
        let keys = avx2._mm256_or_si256(avx2._mm256_and_si256(cast(near), distance_bits), lane);
        let keys = self.0.avx512f._mm256_mask_mov_epi32(avx._mm256_set1_epi32(ALL_BITS), mask, keys);
        let keys = self.sort_descending(keys);
        let refs = avx2._mm256_permutevar8x32_epi32(cast(*children), keys);
        (cast(refs), cast(avx2._mm256_and_si256(keys, distance_bits)))
    }
}
