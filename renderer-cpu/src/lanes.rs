//! Turns operators into SIMD instructions: numbers in the lanes of any instruction set, and vectors of them.
//!
//! All is inlined into code that was compiled for the instruction set; closures would not be.

use core::ops::{Add, Mul, Sub};
use glam::Vec3;
use pulp::Simd;

/// A number in each lane.
pub(crate) struct Lanes<S: Simd> {
    pub(crate) simd: S,
    pub(crate) value: S::f32s,
}

impl<S: Simd> Clone for Lanes<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Lanes<S> {}

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.with(self.simd.$instruction(self.value, other.value))
            }
        }
    };
}

operator!(Add, add, add_f32s);
operator!(Sub, sub, sub_f32s);
operator!(Mul, mul, mul_f32s);

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, x: f32) -> Self {
        Self { simd, value: simd.splat_f32s(x) }
    }

    #[inline(always)]
    pub(crate) fn with(self, value: S::f32s) -> Self {
        Self { simd: self.simd, value }
    }

    /// The same number in all lanes.
    #[inline(always)]
    pub(crate) fn all(self, x: f32) -> Self {
        Self::splat(self.simd, x)
    }

    #[inline(always)]
    pub(crate) fn over(self, other: Self) -> Self {
        self.with(self.simd.div_f32s(self.value, other.value))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.with(self.simd.abs_f32s(self.value))
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.with(self.simd.max_f32s(self.value, other.value))
    }

    #[inline(always)]
    pub(crate) fn clamp(self, low: f32, high: f32) -> Self {
        let least = self.max(self.all(low));
        self.with(self.simd.min_f32s(least.value, self.all(high).value))
    }

    #[inline(always)]
    pub(crate) fn is_above(self, other: Self) -> S::m32s {
        self.simd.greater_than_f32s(self.value, other.value)
    }

    /// Where `mask` is set this, else `other`.
    #[inline(always)]
    pub(crate) fn where_set(self, mask: S::m32s, other: Self) -> Self {
        self.with(self.simd.select_f32s(mask, self.value, other.value))
    }

    /// The largest whole number that is not larger; of numbers from 0 to 2²².
    #[inline(always)]
    pub(crate) fn floor(self) -> Self {
        // What is added leaves no room for a fraction.
        let whole = self.all(8_388_608.0);
        let rounded = (self + whole) - whole;
        (rounded - self.all(1.0)).where_set(rounded.is_above(self), rounded)
    }
}

/// A vector in each lane.
pub(crate) struct Vectors<S: Simd> {
    pub(crate) x: Lanes<S>,
    pub(crate) y: Lanes<S>,
    pub(crate) z: Lanes<S>,
}

impl<S: Simd> Clone for Vectors<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Vectors<S> {}

impl<S: Simd> Vectors<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, v: Vec3) -> Self {
        Self { x: Lanes::splat(simd, v.x), y: Lanes::splat(simd, v.y), z: Lanes::splat(simd, v.z) }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}
