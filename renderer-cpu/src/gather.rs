//! Turns virtual surface lights into irradiance without shadows: pixels in SIMD lanes, one light after the other.
//!
//! No multiply-add is fused, and each lane does what [`photonstream_shading::Kernel::transfer`] does in the same
//! order: AVX-512, AVX2 and plain code give the same bits.

use crate::{
    cull::{Emitter, Selection},
    tile::Tile,
};
use core::f32::consts::PI;
use pulp::{Simd, WithSimd};

/// Which instructions the gathering loop uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstructionSet {
    /// The widest one that the processor has.
    Detected,
    /// AVX2, 8 lanes; plain code where it is missing.
    Avx2,
    /// What every processor of the architecture has.
    Portable,
}

/// Lights per block: their data (13 KB) stays in the first-level cache while all pixels of a tile pass over it.
const BLOCK: usize = 256;

/// Adds the irradiance of the selected lights to `tile`. Returns the sum over lanes of the upper bounds of what was
/// skipped, in W m⁻² sr⁻¹.
pub(crate) fn accumulate(set: InstructionSet, selection: &Selection, tile: &mut Tile) -> f64 {
    on(set, Gather { near: &selection.near, partial: &selection.partial, by_lot: selection.by_lot, tile })
}

/// Runs `work` with an instruction set.
pub(crate) fn on<W: WithSimd>(set: InstructionSet, work: W) -> W::Output {
    match set {
        InstructionSet::Detected => pulp::Arch::new().dispatch(work),
        InstructionSet::Avx2 => avx2(work),
        InstructionSet::Portable => pulp::Scalar128b.vectorize(work),
    }
}

#[cfg(target_arch = "x86_64")]
fn avx2<W: WithSimd>(work: W) -> W::Output {
    match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => pulp::Scalar128b.vectorize(work),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn avx2<W: WithSimd>(work: W) -> W::Output {
    pulp::Scalar128b.vectorize(work)
}

struct Gather<'a> {
    near: &'a [Emitter],
    partial: &'a [Emitter],
    /// Whether these have drawn their ranges.
    by_lot: bool,
    tile: &'a mut Tile,
}

impl WithSimd for Gather<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        for block in self.near.chunks(BLOCK) {
            add_block::<S, false, false>(simd, block, self.tile);
        }
        let partial = self.partial.chunks(BLOCK);
        if self.by_lot {
            partial.map(|block| add_block::<S, true, true>(simd, block, self.tile)).sum()
        } else {
            partial.map(|block| add_block::<S, true, false>(simd, block, self.tile)).sum()
        }
    }
}

/// Adds one block of lights to every pixel of the tile; with `RANGED`, lanes beyond a light's range are skipped and
/// the bounds of what they lose are summed; with `BY_LOT` nothing is lost, and the others make up for it.
#[inline(always)]
fn add_block<S: Simd, const RANGED: bool, const BY_LOT: bool>(
    simd: S,
    lights: &[Emitter],
    tile: &mut Tile,
) -> f64 {
    let used = tile.used;
    let lanes = |values| S::as_simd_f32s(values).0;
    let (px, py, pz) =
        (lanes(&tile.position.x[..used]), lanes(&tile.position.y[..used]), lanes(&tile.position.z[..used]));
    let (nx, ny, nz) =
        (lanes(&tile.normal.x[..used]), lanes(&tile.normal.y[..used]), lanes(&tile.normal.z[..used]));
    let er = S::as_mut_simd_f32s(&mut tile.irradiance.x[..used]).0;
    let eg = S::as_mut_simd_f32s(&mut tile.irradiance.y[..used]).0;
    let eb = S::as_mut_simd_f32s(&mut tile.irradiance.z[..used]).0;
    let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
    let pi = simd.splat_f32s(PI);
    let mut lost = 0.0f64;
    let add = |a, b| simd.add_f32s(a, b);
    let sub = |a, b| simd.sub_f32s(a, b);
    let mul = |a, b| simd.mul_f32s(a, b);
    let splat = |x| simd.splat_f32s(x);
    for i in 0..px.len() {
        let (px, py, pz) = (px[i], py[i], pz[i]);
        let (nx, ny, nz) = (nx[i], ny[i], nz[i]);
        let (mut r, mut g, mut b) = (er[i], eg[i], eb[i]);
        let mut lost_lanes = zero;
        for light in lights {
            let dx = sub(splat(light.position.x), px);
            let dy = sub(splat(light.position.y), py);
            let dz = sub(splat(light.position.z), pz);
            let r_sq = add(add(mul(dx, dx), mul(dy, dy)), mul(dz, dz));
            let cos = add(add(mul(nx, dx), mul(ny, dy)), mul(nz, dz));
            let inverse = light.inverse_normal;
            let cos_s =
                add(add(mul(splat(inverse.x), dx), mul(splat(inverse.y), dy)), mul(splat(inverse.z), dz));
            let cosines = mul(simd.max_f32s(cos, zero), simd.max_f32s(cos_s, zero));
            let denominator = mul(r_sq, add(mul(pi, r_sq), splat(light.area_term)));
            let quotient = simd.div_f32s(cosines, denominator);
            // 0/0 where pixel and light coincide: nothing arrives.
            let mut transfer = simd.select_f32s(simd.greater_than_f32s(denominator, zero), quotient, zero);
            if RANGED {
                let beyond = simd.greater_than_f32s(r_sq, splat(light.range_sq));
                if BY_LOT {
                    transfer = mul(transfer, simd.max_f32s(mul(r_sq, splat(light.weight_slope)), one));
                } else {
                    let bound = simd.div_f32s(splat(light.bound), r_sq);
                    let arrives = simd.greater_than_f32s(transfer, zero);
                    let bound = simd.select_f32s(arrives, bound, zero);
                    lost_lanes = add(lost_lanes, simd.select_f32s(beyond, bound, zero));
                }
                transfer = simd.select_f32s(beyond, zero, transfer);
            }
            r = add(r, mul(splat(light.flux.x), transfer));
            g = add(g, mul(splat(light.flux.y), transfer));
            b = add(b, mul(splat(light.flux.z), transfer));
        }
        (er[i], eg[i], eb[i]) = (r, g, b);
        if RANGED {
            lost += f64::from(simd.reduce_sum_f32s(lost_lanes));
        }
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cull::Culling, tile::random};
    use glam::Vec3;
    use photonstream_renderer::{Vsl, VslSet};
    use photonstream_shading::Kernel;

    /// Random pixels and lights, some of them coincident: every instruction set gives bit for bit the f32 sum of
    /// `Kernel::transfer` in the order of the lights. N = 1000 pixels × 300 lights, seed 3.
    #[test]
    fn every_lane_is_the_plain_sum() {
        let points = random::points(3);
        let vsls = VslSet::new((0..300).map(|i| Vsl {
            position: points[i * 3].0,
            normal: points[i * 3 + 1].1,
            flux: points[i * 3 + 2].0.abs(),
            area: 0.01 * (i % 7) as f32,
            object: 0,
        }))
        .unwrap();
        for kernel in Kernel::ALL {
            let culling =
                Culling { kernel, epsilon: 0.0, stochastic: false, albedo_max: 1.0, magnitude: 1.0 };
            for set in [InstructionSet::Detected, InstructionSet::Avx2, InstructionSet::Portable] {
                let mut tile = random::tile(&points, 1000);
                let mut selection = Selection::default();
                culling.select(&vsls, &tile, 0, &mut selection);
                assert_eq!(accumulate(set, &selection, &mut tile), 0.0);
                for (i, &(x, n)) in points[..1000].iter().enumerate() {
                    let mut expected = Vec3::ZERO;
                    for k in 0..vsls.len() {
                        let d = vsls.position()[k] - x;
                        expected += vsls.flux()[k] * kernel.transfer(d, n, vsls.normal()[k], vsls.area()[k]);
                    }
                    let expected = if random::is_there(i) { expected } else { Vec3::ZERO };
                    assert_eq!(tile.irradiance.get(i), expected, "{kernel}, {set:?}, pixel {i}");
                }
            }
        }
    }
}
