//! The shader twin of texture lookups gives the same numbers on the device.

use crate::twins::{check, uniform};
use glam::Vec2;
use photonstream_shading::{
    texture::{self, Layout, Wrap},
    wgsl,
};

/// Texel `i` of a texture of 5 × 3 in three levels.
fn texel(i: u32) -> [u32; 2] {
    [i.wrapping_mul(0x9E37_79B9), i.wrapping_mul(0x85EB_CA6B) ^ 0x1234_5678]
}

/// Every wrap, odd edges, and levels from the finest to beyond the coarsest; coordinates in [-2, 2].
#[test]
fn texture_lookups() {
    let parts = ["var<private> texels: array<vec2u, 18>;", wgsl::WRAP, wgsl::TEXTURE];
    let body = "for (var i = 0u; i < 18u; i++) {
            texels[i] = vec2u(i * 0x9E3779B9u, (i * 0x85EBCA6Bu) ^ 0x12345678u);
        }
        let place = TextureLayout(0u, 5u, 3u, 3u, u32(x[3] * 3.0), u32(x[4] * 3.0), 0.0, 0u);
        let seen = texture_sample(place, vec2f(x[0], x[1]) * 4.0 - 2.0, x[2]);
        y = array<f32, 4>(seen.x, seen.y, seen.z, seen.w);";
    let texels: Vec<_> = (0..18).map(texel).collect();
    let wrap = |x: f32| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][(x * 3.0) as usize];
    let layout = |x: &[f32; 16]| Layout {
        first: 0,
        width: 5,
        height: 3,
        levels: 3,
        wrap_u: wrap(x[3]),
        wrap_v: wrap(x[4]),
    };
    let mut inputs = uniform();
    inputs.iter_mut().for_each(|x| x[2] = texture::level_of_width(1.0, 16.0 * x[2]));
    check("texture", &parts, body, 1.0, &inputs, |x| {
        let uv = Vec2::new(x[0], x[1]) * 4.0 - 2.0;
        texture::sample(&texels, &layout(x), uv, x[2]).to_array()
    });
    let body = "y[0] = texture_level_of_width(x[0] * 100.0, x[1]);
        y[1] = texture_footprint(x[2], x[3] * 10.0, x[4]);";
    let parts = ["var<private> texels: array<vec2u, 18>;", wgsl::WRAP, wgsl::TEXTURE];
    check("texture_level", &parts, body, 1.0, &uniform(), |x| {
        [texture::level_of_width(x[0] * 100.0, x[1]), texture::footprint(x[2], x[3] * 10.0, x[4]), 0.0, 0.0]
    });
}
