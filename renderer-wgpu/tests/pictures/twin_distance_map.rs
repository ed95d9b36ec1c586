//! The shader twin of distance maps gives the same numbers on the device.

use crate::twins::{check, uniform, vector};
use glam::Vec3;
use photonstream_shading::{basis, distance_map, wgsl};

/// A map of 8² texels in the inputs' last words, each of which becomes two texels; receivers all around the light.
#[test]
fn distance_map() {
    let maps = "var<private> distance_maps: array<u32, 32>;";
    let parts = [wgsl::BASIS, maps, wgsl::DISTANCE_TEXELS, wgsl::DISTANCE_MAP];
    let body = "let n = normalize(vec3f(x[0], x[1], x[2]) - 0.5);
        let t = basis_tangents(n);
        let to = (vec3f(x[3], x[4], x[5]) - vec3f(0.5, 0.5, 0.0)) * vec3f(4.0, 4.0, 2.0);
        let normal = normalize(vec3f(x[6], x[7], x[8]) - vec3f(0.5, 0.5, 0.9));
        for (var i = 0u; i < 32u; i++) {
            let texel = u32(x[9u + i % 7u] * 4096.0) + 31000u;
            distance_maps[i] = texel | ((texel ^ 0x355u) << 16u);
        }
        let seen = distance_map_visibility(0u, 8u, to, normal);
        y = array<f32, 4>(seen, t[0].x, t[1].y, distance_map_unpack(u32(x[15] * 65535.0)));";
    let mut partly = 0;
    let inputs = uniform();
    let texels = |x: &[f32; 16]| -> Vec<u16> {
        let pair = |i: usize| {
            let texel = (x[9 + i % 7] * 4096.0) as u16 + 31000;
            [texel, texel ^ 0x355]
        };
        (0..32).flat_map(pair).collect()
    };
    let seen = |x: &[f32; 16]| {
        let to = (vector(x, 3) - Vec3::new(0.5, 0.5, 0.0)) * Vec3::new(4.0, 4.0, 2.0);
        let normal = (vector(x, 6) - Vec3::new(0.5, 0.5, 0.9)).normalize();
        distance_map::visibility(&texels(x), 8, to, normal)
    };
    for x in &inputs {
        partly += usize::from(seen(x) > 0.0 && seen(x) < 1.0);
    }
    assert!(partly * 4 > inputs.len(), "{partly}: hardly a receiver is at a shadow's edge");
    // Where a texel is just as far as the receiver the last bit decides: N inputs without any such.
    let is_decided = |x: &&[f32; 16]| {
        let to = (vector(x, 3) - Vec3::new(0.5, 0.5, 0.0)) * Vec3::new(4.0, 4.0, 2.0);
        let normal = (vector(x, 6) - Vec3::new(0.5, 0.5, 0.9)).normalize();
        let lookup = distance_map::Lookup::new(8, to, normal);
        let map = texels(x);
        let close = |corner: usize| {
            let inverse = distance_map::unpack(map[lookup.texels[corner] as usize]);
            (inverse / lookup.limits[corner] - 1.0).abs() < 1e-4
        };
        // Nor where it is between two texels.
        let at_edge = lookup.weights.iter().any(|&w| w < 1e-4);
        !(0..4).any(close) && !at_edge && normal.dot(to).abs() > 1e-3
    };
    let mut decided: Vec<[f32; 16]> = inputs.iter().filter(is_decided).copied().collect();
    assert!(decided.len() * 4 > 3 * inputs.len(), "{}", decided.len());
    decided.truncate(decided.len() / 64 * 64);
    check("distance_map", &parts, body, 1e-3, &decided, |x| {
        let n = (vector(x, 0) - 0.5).normalize();
        let (t, b) = basis::tangents(n);
        [seen(x), t.x, b.y, distance_map::unpack((x[15] * 65535.0) as u16)]
    });
}
