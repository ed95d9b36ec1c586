//! Turns virtual surface lights into irradiance with the shadows that their distance maps know: pixels in SIMD lanes.
//!
//! Each lane does what [`photonstream_shading::distance_map::visibility`] does in the same order, and no multiply-add is fused:
//! all instruction sets give the same bits.

use crate::{
    InstructionSet,
    cull::{Emitter, Selection},
    gather,
    lanes::{Lanes, Vectors},
    patched,
    tile::{self, MAX_LANES, Tile},
};
use core::f32::consts::PI;
use photonstream_renderer::{Patch, VslSet};
use photonstream_shading::distance_map::{Axes, bias, unpack};
use pulp::{Simd, WithSimd};

/// Adds the irradiance of the selected lights, as far as their maps show the receiver, to `tile`. Returns the sum of the upper
/// bounds of what was skipped, in W m⁻² sr⁻¹.
pub(crate) fn accumulate(set: InstructionSet, vsls: &VslSet, selection: &Selection, tile: &mut Tile) -> f64 {
    gather::on(set, Mapped { vsls, selection, tile })
}

struct Mapped<'a> {
    vsls: &'a VslSet,
    selection: &'a Selection,
    tile: &'a mut Tile,
}

impl WithSimd for Mapped<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { vsls, selection, tile } = self;
        let mut skipped = 0.0;
        for light in selection.near.iter().chain(&selection.partial) {
            skipped += add_point(simd, &Mapping::new(vsls, light), tile);
        }
        for (light, patch) in &selection.patched {
            skipped += add_patch(simd, &Mapping::new(vsls, light), patch, tile);
        }
        skipped
    }
}

/// A light with its map.
struct Mapping<'a> {
    light: &'a Emitter,
    axes: Axes,
    texels: &'a [u16],
    edge: u32,
}

impl<'a> Mapping<'a> {
    fn new(vsls: &'a VslSet, light: &'a Emitter) -> Self {
        let axes = Axes::of(-light.inverse_normal);
        Self { light, axes, texels: vsls.map(light.index as usize), edge: vsls.map_edge() }
    }
}

/// Adds a light as a point, as [`crate::gather`] does, where its map shows the receiver.
#[inline(always)]
fn add_point<S: Simd>(simd: S, mapping: &Mapping<'_>, tile: &mut Tile) -> f64 {
    let light = mapping.light;
    let zero = Lanes::splat(simd, 0.0);
    let inverse_normal = Vectors::splat(simd, light.inverse_normal);
    let mut skipped = 0.0;
    for block in 0..tile.used / S::F32_LANES {
        let (d, n) = receivers(simd, light, tile, block);
        let r_sq = d.dot(d);
        let cosines = n.dot(d).max(zero) * inverse_normal.dot(d).max(zero);
        let denominator = r_sq * (zero.all(PI) * r_sq + zero.all(light.area_term));
        // 0/0 where pixel and light coincide: nothing arrives.
        let transfer = cosines.over(denominator).where_set(denominator.is_above(zero), zero);
        if simd.reduce_max_f32s(transfer.value) <= 0.0 {
            continue;
        }
        let is_beyond = r_sq.is_above(zero.all(light.range_sq));
        let bound = zero.all(light.bound).over(r_sq).where_set(transfer.is_above(zero), zero);
        skipped += f64::from(simd.reduce_sum_f32s(bound.where_set(is_beyond, zero).value));
        // Of lights that have drawn their range, those that are left make up for the others.
        let weight = (r_sq * zero.all(light.weight_slope)).max(zero.all(1.0));
        let transfer = zero.where_set(is_beyond, transfer * weight);
        add(light, transfer * seen(mapping, d, n), tile, block);
    }
    skipped
}

/// Adds a light as a polygon where its map shows the receiver.
#[inline(always)]
fn add_patch<S: Simd>(simd: S, mapping: &Mapping<'_>, patch: &Patch, tile: &mut Tile) -> f64 {
    let light = mapping.light;
    let mut skipped = 0.0;
    for block in 0..tile.used / S::F32_LANES {
        let mut transfers = [0.0; MAX_LANES];
        for (i, arrives) in (block * S::F32_LANES..).zip(&mut transfers[..S::F32_LANES]) {
            let Some(surface) = &tile.surfaces[i] else { continue };
            let d = light.position - tile.position.get(i);
            let d_origin = light.position - surface.ray_origin;
            let transfer = patched::seen(light, patch, d, d_origin, tile.normal.get(i)).transfer;
            let r_sq = d.length_squared();
            if transfer > 0.0 && r_sq > light.range_sq {
                skipped += f64::from(light.bound / r_sq);
            } else {
                *arrives = transfer * light.weight(r_sq);
            }
        }
        if transfers == [0.0; MAX_LANES] {
            continue;
        }
        let (d, n) = receivers(simd, light, tile, block);
        let transfer = d.x.with(S::as_simd_f32s(&transfers).0[0]);
        add(light, transfer * seen(mapping, d, n), tile, block);
    }
    skipped
}

/// From a block of receivers to the light, and their normals.
#[inline(always)]
fn receivers<S: Simd>(simd: S, light: &Emitter, tile: &Tile, block: usize) -> (Vectors<S>, Vectors<S>) {
    let place = load(simd, &tile.position, tile.used, block);
    (Vectors::splat(simd, light.position).minus(place), load(simd, &tile.normal, tile.used, block))
}

#[inline(always)]
fn load<S: Simd>(simd: S, from: &tile::Vectors, used: usize, block: usize) -> Vectors<S> {
    Vectors {
        x: Lanes { simd, value: S::as_simd_f32s(&from.x[..used]).0[block] },
        y: Lanes { simd, value: S::as_simd_f32s(&from.y[..used]).0[block] },
        z: Lanes { simd, value: S::as_simd_f32s(&from.z[..used]).0[block] },
    }
}

#[inline(always)]
fn add<S: Simd>(light: &Emitter, transfer: Lanes<S>, tile: &mut Tile, block: usize) {
    let used = tile.used;
    let irradiance = &mut tile.irradiance;
    let channels = [&mut irradiance.x, &mut irradiance.y, &mut irradiance.z];
    for (channel, flux) in channels.into_iter().zip(light.flux.to_array()) {
        let sum = &mut S::as_mut_simd_f32s(&mut channel[..used]).0[block];
        *sum = (transfer.with(*sum) + transfer.all(flux) * transfer).value;
    }
}

/// The share of the light that each receiver sees by the map: [`photonstream_shading::distance_map::visibility`].
#[inline(always)]
fn seen<S: Simd>(mapping: &Mapping<'_>, d: Vectors<S>, normal: Vectors<S>) -> Lanes<S> {
    let simd = d.x.simd;
    let zero = d.x.all(0.0);
    let to = Vectors { x: zero - d.x, y: zero - d.y, z: zero - d.z };
    let tangent = Vectors::splat(simd, mapping.axes.tangent);
    let bitangent = Vectors::splat(simd, mapping.axes.bitangent);
    let up = Vectors::splat(simd, mapping.axes.normal);
    let to = Vectors { x: tangent.dot(to), y: bitangent.dot(to), z: up.dot(to) };
    let n = Vectors { x: tangent.dot(normal), y: bitangent.dot(normal), z: up.dot(normal) };
    let size = mapping.edge as f32;
    let m = (to.x.abs() + to.y.abs() + to.z.max(zero)).max(zero.all(f32::MIN_POSITIVE));
    let height = n.dot(to);
    let own = zero.all(1.0).over(m);
    let receiver = Receiver {
        n,
        own,
        inverse_height: zero.all(1.0).over(height),
        is_plane: zero.is_above(height),
        scale: zero.all(1.0 + bias(mapping.edge)),
    };
    let (x, y) = (place(size, to.x + to.y, own), place(size, to.x - to.y, own));
    let (column, row) = (x.floor(), y.floor());
    let (share_x, share_y) = (x - column, y - row);
    let one = zero.all(1.0);
    let (rest_x, rest_y) = (one - share_x, one - share_y);
    let last = size - 1.0;
    let (left, right) = ((column - one).clamp(0.0, last), column.clamp(0.0, last));
    let (below, above) = ((row - one).clamp(0.0, last), row.clamp(0.0, last));
    let seen = zero + receiver.part(mapping, left, below, rest_x * rest_y);
    let seen = seen + receiver.part(mapping, right, below, share_x * rest_y);
    let seen = seen + receiver.part(mapping, left, above, rest_x * share_y);
    seen + receiver.part(mapping, right, above, share_x * share_y)
}

/// Place in the map, in texels and one more than from the first one's middle.
#[inline(always)]
fn place<S: Simd>(size: f32, p: Lanes<S>, own: Lanes<S>) -> Lanes<S> {
    (p.all(0.5 * size) * (p * own) + p.all(0.5 * size + 0.5)).clamp(0.0, size)
}

/// What is compared with the texels.
struct Receiver<S: Simd> {
    n: Vectors<S>,
    own: Lanes<S>,
    inverse_height: Lanes<S>,
    is_plane: S::m32s,
    scale: Lanes<S>,
}

impl<S: Simd> Receiver<S> {
    /// The weight of a texel where it shows the receiver.
    #[inline(always)]
    fn part(&self, mapping: &Mapping<'_>, u: Lanes<S>, v: Lanes<S>, weight: Lanes<S>) -> Lanes<S> {
        let simd = u.simd;
        let size = mapping.edge as f32;
        let (half, one, step) = (u.all(0.5), u.all(1.0), u.all(2.0 / size));
        let (a, b) = ((u + half) * step - one, (v + half) * step - one);
        let (px, py) = (half * (a + b), half * (a - b));
        let pz = one - px.abs() - py.abs();
        let plane = self.n.dot(Vectors { x: px, y: py, z: pz }) * self.inverse_height;
        let follows = simd.and_m32s(self.is_plane, plane.is_above(self.own));
        let limit = plane.where_set(follows, self.own) * self.scale;
        let inverse = look_up(mapping.texels, v * u.all(size) + u);
        u.all(0.0).where_set(inverse.is_above(limit), weight)
    }
}

/// The texels at whole numbers.
#[inline(always)]
fn look_up<S: Simd>(texels: &[u16], index: Lanes<S>) -> Lanes<S> {
    let mut places = [0.0; MAX_LANES];
    S::as_mut_simd_f32s(&mut places).0[0] = index.value;
    let mut inverses = [0.0; MAX_LANES];
    for (inverse, place) in inverses[..S::F32_LANES].iter_mut().zip(places) {
        // Not negative, and no more than the edge squared.
        *inverse = unpack(texels.get(place as i32 as usize).copied().unwrap_or(0));
    }
    index.with(S::as_simd_f32s(&inverses).0[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cull::Culling, tile::random};
    use glam::Vec3;
    use photonstream_protocol::{DISTANCE_TEXELS, DistanceRecord};
    use photonstream_renderer::Vsl;
    use photonstream_shading::{Kernel, distance_map, sobol::Sequence};

    /// Random pixels, lights and maps, some coincident: every instruction set gives bit for bit the f32 sum of
    /// `Kernel::transfer` times `distance_map::visibility` in the order of the lights. N = 1 000 pixels × 100 lights, seed 5.
    #[test]
    fn every_lane_is_the_plain_sum() {
        let points = random::points(5);
        let (edge, count) = (16, 100);
        let records: Vec<DistanceRecord> = (0..count * (edge * edge) as usize / DISTANCE_TEXELS)
            .map(|i| DistanceRecord {
                texels: std::array::from_fn(|k| {
                    let mut s = Sequence::new(6, 0).sample((i * 16 + k) as u64);
                    let [a, b] = s.next_2d().map(|u| u32::from(distance_map::pack(0.3 + 2.0 * u)));
                    a | b << 16
                }),
            })
            .collect();
        let vsls = (0..count).map(|i| Vsl {
            position: points[i * 3].0,
            normal: points[i * 3 + 1].1,
            flux: points[i * 3 + 2].0.abs(),
            area: 0.01 * (i % 7) as f32,
            object: 0,
        });
        let vsls = VslSet::new(vsls).unwrap().with_distances(&records);
        assert_eq!(vsls.map_edge(), edge);
        for kernel in Kernel::ALL {
            let culling =
                Culling { kernel, epsilon: 0.0, stochastic: false, albedo_max: 1.0, magnitude: 1.0 };
            for set in [InstructionSet::Detected, InstructionSet::Avx2, InstructionSet::Portable] {
                let mut tile = random::tile(&points, 1000);
                let mut selection = Selection::default();
                culling.select(&vsls, &tile, 0, &mut selection);
                assert_eq!(accumulate(set, &vsls, &selection, &mut tile), 0.0);
                let mut shadowed = 0;
                for (i, &(x, n)) in points[..1000].iter().enumerate() {
                    let mut expected = Vec3::ZERO;
                    for k in 0..vsls.len() {
                        let d = vsls.position()[k] - x;
                        let axes = Axes::of(vsls.normal()[k]);
                        let transfer = kernel.transfer(d, n, vsls.normal()[k], vsls.area()[k]);
                        let seen = distance_map::visibility(vsls.map(k), edge, axes.local(-d), axes.local(n));
                        expected += vsls.flux()[k] * (transfer * seen);
                        shadowed += usize::from(transfer > 0.0 && seen < 1.0);
                    }
                    let expected = if random::is_there(i) { expected } else { Vec3::ZERO };
                    assert_eq!(tile.irradiance.get(i), expected, "{kernel}, {set:?}, pixel {i}");
                }
                assert!(shadowed > 10_000, "{shadowed}");
            }
        }
    }
}
