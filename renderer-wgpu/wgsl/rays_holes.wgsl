// Turns a ray and a triangle into whether it stops the ray: not where it has a hole, as on the CPU.

// What rays/holes.rs lays down: a link for each triangle, then records, masks and alphas.
@group(1) @binding(6) var<storage, read> holes: array<u32>;

// Corners, and the unit normal in the fourth components.
fn triangle_stops(f: RayFrame, triangle: u32, v0: vec4f, v1: vec4f, v2: vec4f) -> bool {
    if !triangle_hit(f, v0.xyz, v1.xyz, v2.xyz, vec3f(v0.w, v1.w, v2.w)) {
        return false;
    }
    let record = holes[triangle];
    if record == NO_HOLES {
        return true;
    }
    let place = triangle_place(f, v0.xyz, v1.xyz, v2.xyz);
    let a = hole_corner(record, 0u);
    let b = hole_corner(record, 1u);
    let c = hole_corner(record, 2u);
    let mask = holes[record + HOLE_RECORD_MASK];
    return hole_alpha(mask, a + (b - a) * place.x + (c - a) * place.y) >= bitcast<f32>(holes[mask + HOLE_MASK_CUTOFF]);
}

fn hole_corner(record: u32, corner: u32) -> vec2f {
    let first = record + HOLE_RECORD_UVS + 2u * corner;
    return vec2f(bitcast<f32>(holes[first]), bitcast<f32>(holes[first + 1u]));
}

// Alpha of the finest level at texture coordinates; twin of `bilinear` in texture.rs.
fn hole_alpha(mask: u32, uv: vec2f) -> f32 {
    let width = holes[mask + HOLE_MASK_WIDTH];
    let height = holes[mask + HOLE_MASK_HEIGHT];
    let wrap_u = holes[mask + HOLE_MASK_WRAP_U];
    let wrap_v = holes[mask + HOLE_MASK_WRAP_V];
    let first = holes[mask + HOLE_MASK_FIRST];
    let place = vec2f(wrap_wrapped(uv.x, wrap_u), wrap_wrapped(uv.y, wrap_v)) * vec2f(f32(width), f32(height)) - 0.5;
    let low = floor(place);
    let fraction = place - low;
    let column = i32(low.x);
    let row = i32(low.y);
    let left = wrap_neighbour(column, i32(width), wrap_u);
    let right = wrap_neighbour(column + 1, i32(width), wrap_u);
    let top = wrap_neighbour(row, i32(height), wrap_v) * width;
    let bottom = wrap_neighbour(row + 1, i32(height), wrap_v) * width;
    let upper = hole_texel(first, top + left) * (1.0 - fraction.x) + hole_texel(first, top + right) * fraction.x;
    let lower = hole_texel(first, bottom + left) * (1.0 - fraction.x) + hole_texel(first, bottom + right) * fraction.x;
    return upper * (1.0 - fraction.y) + lower * fraction.y;
}

// Two alphas in a word, the lower half first.
fn hole_texel(first: u32, index: u32) -> f32 {
    return f32((holes[first + index / 2u] >> ((index & 1u) * 16u)) & 0xffffu) / 65535.0;
}
