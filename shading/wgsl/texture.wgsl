// Turns texture coordinates into a colour: twin of texture.rs. The module that includes it has `texels: array<vec2u>`, and
// wrap.wgsl.

struct TextureLayout {
    first: u32,
    width: u32,
    height: u32,
    levels: u32,
    wrap_u: u32,
    wrap_v: u32,
    cutoff: f32,             // alpha below it is a hole
    pad_0: u32,
}

struct TextureLevel {
    first: u32,
    width: u32,
    height: u32,
}

fn texture_level(picture: TextureLayout, index: u32) -> TextureLevel {
    let last = min(index, picture.levels - 1u);
    var first = picture.first;
    for (var i = 0u; i < last; i++) {
        first += max(picture.width >> i, 1u) * max(picture.height >> i, 1u);
    }
    return TextureLevel(first, max(picture.width >> last, 1u), max(picture.height >> last, 1u));
}

fn texture_level_of_width(density: f32, width_m: f32) -> f32 {
    return log2(min(max(density * width_m, 1.0), F32_MAX));
}

fn texture_footprint(pixel: f32, distance: f32, cos_theta: f32) -> f32 {
    return pixel * distance / sqrt(max(cos_theta, 0.01));
}

fn texture_sample(picture: TextureLayout, uv: vec2f, level: f32) -> vec4f {
    let whole = floor(level);
    let fraction = level - whole;
    let fine = texture_bilinear(picture, uv, u32(whole));
    if fraction <= 0.0 {
        return fine;
    }
    return fine + (texture_bilinear(picture, uv, u32(whole) + 1u) - fine) * fraction;
}

fn texture_bilinear(picture: TextureLayout, uv: vec2f, index: u32) -> vec4f {
    let level = texture_level(picture, index);
    let size = vec2f(f32(level.width), f32(level.height));
    let place = vec2f(wrap_wrapped(uv.x, picture.wrap_u), wrap_wrapped(uv.y, picture.wrap_v)) * size - 0.5;
    let low = floor(place);
    let fraction = place - low;
    let column = i32(low.x);
    let row = i32(low.y);
    let left = wrap_neighbour(column, i32(level.width), picture.wrap_u);
    let right = wrap_neighbour(column + 1, i32(level.width), picture.wrap_u);
    let top = level.first + wrap_neighbour(row, i32(level.height), picture.wrap_v) * level.width;
    let bottom = level.first + wrap_neighbour(row + 1, i32(level.height), picture.wrap_v) * level.width;
    let upper = texture_unpack(texels[top + left]) * (1.0 - fraction.x) + texture_unpack(texels[top + right]) * fraction.x;
    let lower = texture_unpack(texels[bottom + left]) * (1.0 - fraction.x) + texture_unpack(texels[bottom + right]) * fraction.x;
    return upper * (1.0 - fraction.y) + lower * fraction.y;
}

fn texture_unpack(texel: vec2u) -> vec4f {
    return vec4f(unpack2x16unorm(texel.x), unpack2x16unorm(texel.y));
}
