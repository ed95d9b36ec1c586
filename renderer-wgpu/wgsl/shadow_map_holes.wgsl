// Turns triangles whose textures have holes into the depths that a light sees, and into which of them it sees.

struct ShadowView {
    clip_from_world: mat4x4f,
    texel: f32,
    parallel: u32,
    layer: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> view: ShadowView;
@group(0) @binding(1) var<storage, read> texels: array<vec2u>;
@group(0) @binding(2) var<storage, read> layouts: array<TextureLayout>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) object: u32,
    @location(1) uv: vec2f,
}

@vertex
fn corner(@location(0) position: vec3f, @location(2) object: u32, @location(3) uv: vec2f) -> Corner {
    return Corner(view.clip_from_world * vec4f(position, 1.0), object, uv);
}

@fragment
fn holes(in: Corner) {
    let picture = layouts[in.object];
    if picture.levels > 0u && texture_bilinear(picture, in.uv, 0u).w < picture.cutoff {
        discard;
    }
}
