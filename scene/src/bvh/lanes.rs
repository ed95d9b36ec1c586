//! Turns one vocabulary of eight-lane operations into whatever instructions the processor has.
//!
//! The trait is what the kernels are written in; [`Portable`] is plain Rust (SSE2 or NEON after vectorisation).
//! Comparisons with NaN are false; `min(a, b)` is `b` unless `a < b`, `max(a, b)` is `b` unless `a > b`, as on x86.

/// Lanes in a register, children in a node and triangles in a packet.
pub(super) const WIDTH: usize = 8;

/// Eight `f32`, on a cache-friendly boundary.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub(super) struct F32x8(pub(super) [f32; WIDTH]);

/// Eight `u32`, on a cache-friendly boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub(super) struct U32x8(pub(super) [u32; WIDTH]);

/// Constants of one slab plane per axis: distance = `(plane − origin) · inverse`.
#[derive(Clone, Copy)]
pub(super) struct Slab<F> {
    /// Reciprocal of the direction's component.
    pub(super) inverse: F,
    /// Origin, padded outwards.
    pub(super) origin: F,
    /// `origin · inverse`, for the fused form.
    pub(super) offset: F,
}

/// Eight-lane operations; every implementation rounds each of them as IEEE 754 says.
pub(super) trait Lanes: Copy {
    /// Eight `f32` in a register.
    type F: Copy;
    /// Eight truth values.
    type M: Copy;

    fn splat(self, value: f32) -> Self::F;
    fn load(self, values: &F32x8) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Bit i is lane i's truth value.
    fn bits(self, mask: Self::M) -> u32;
    /// Distance to a slab plane; may be fused, as box tests need only be conservative.
    fn slab(self, plane: Self::F, slab: &Slab<Self::F>) -> Self::F;
    /// Where `max(near…, 0)` ≤ `min(far…)`, and that maximum.
    fn overlap(self, near: [Self::F; 3], far: [Self::F; 3], t_max: Self::F) -> (Self::M, Self::F);
    fn store(self, value: Self::F) -> F32x8;
    /// Asks for the 256 bytes from `address`, which need not exist.
    fn prefetch(self, address: *const u8);
    /// The masked children and their entry distances (rounded down by up to 7 ulps), farthest first, the rest after.
    /// `near` is not negative in masked lanes.
    fn order(self, mask: Self::M, near: Self::F, children: &U32x8) -> (U32x8, F32x8);
}

/// Plain Rust on arrays.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[inline(always)]
fn zip(a: F32x8, b: F32x8, f: impl Fn(f32, f32) -> f32) -> F32x8 {
    let mut out = a;
    for lane in 0..WIDTH {
        out.0[lane] = f(a.0[lane], b.0[lane]);
    }
    out
}

impl Lanes for Portable {
    type F = F32x8;
    type M = U32x8;

    #[inline(always)]
    fn splat(self, value: f32) -> F32x8 {
        F32x8([value; WIDTH])
    }
    #[inline(always)]
    fn load(self, values: &F32x8) -> F32x8 {
        *values
    }
    #[inline(always)]
    fn sub(self, a: F32x8, b: F32x8) -> F32x8 {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: F32x8, b: F32x8) -> F32x8 {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn min(self, a: F32x8, b: F32x8) -> F32x8 {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: F32x8, b: F32x8) -> F32x8 {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, a: F32x8, b: F32x8) -> U32x8 {
        let mut out = U32x8([0; WIDTH]);
        for lane in 0..WIDTH {
            out.0[lane] = if a.0[lane] <= b.0[lane] { u32::MAX } else { 0 };
        }
        out
    }
    #[inline(always)]
    fn or(self, a: U32x8, b: U32x8) -> U32x8 {
        let mut out = a;
        for lane in 0..WIDTH {
            out.0[lane] |= b.0[lane];
        }
        out
    }
    #[inline(always)]
    fn bits(self, mask: U32x8) -> u32 {
        let mut bits = 0;
        for lane in 0..WIDTH {
            bits |= mask.0[lane] & (1 << lane);
        }
        bits
    }
    #[inline(always)]
    fn slab(self, plane: F32x8, slab: &Slab<F32x8>) -> F32x8 {
        self.mul(self.sub(plane, slab.origin), slab.inverse)
    }
    #[inline(always)]
    fn overlap(self, near: [F32x8; 3], far: [F32x8; 3], t_max: F32x8) -> (U32x8, F32x8) {
        let entry = self.max(self.max(near[0], near[1]), self.max(near[2], self.splat(0.0)));
        let exit = self.min(self.min(far[0], far[1]), self.min(far[2], t_max));
        (self.le(entry, exit), entry)
    }
    #[inline(always)]
    fn store(self, value: F32x8) -> F32x8 {
        value
    }
    #[inline(always)]
    fn prefetch(self, _: *const u8) {}
    #[inline(always)]
    fn order(self, mask: U32x8, near: F32x8, children: &U32x8) -> (U32x8, F32x8) {
        let mut out = (U32x8([u32::MAX; WIDTH]), F32x8([0.0; WIDTH]));
        let mut bits = self.bits(mask);
        let mut count = 0;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % WIDTH;
            bits &= bits - 1;
            let mut slot = count;
            while slot > 0 && out.1.0[slot - 1] < near.0[lane] {
                out.0.0[slot % WIDTH] = out.0.0[slot - 1];
                out.1.0[slot % WIDTH] = out.1.0[slot - 1];
                slot -= 1;
            }
            out.0.0[slot % WIDTH] = children.0[lane];
            out.1.0[slot % WIDTH] = near.0[lane];
            count += 1;
        }
        out
    }
}
