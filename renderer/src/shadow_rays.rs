//! Gathers the numbers of shadow rays that every renderer has to have in common, for their pictures to agree.

/// Share of the way to a light at which its shadow ray ends: the rounding of direction and distance (a few 2⁻²⁴) must not
/// carry it through the emitter.
pub const SHADOW_REACH: f32 = 1.0 - 8.0 * f32::EPSILON;

/// Scrambles the samples of area lights apart from those of pixels: added to the seed bit by bit (exclusive or).
pub const LIGHT_SEED: u64 = 0x6C69_6768_7473_0000;
