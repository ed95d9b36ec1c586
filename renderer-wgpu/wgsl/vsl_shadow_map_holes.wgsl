// Turns triangles whose textures have holes into the depths that a virtual surface light sees in a quarter of its hemisphere.

@group(0) @binding(1) var<storage, read> texels: array<vec2u>;
@group(0) @binding(2) var<storage, read> layouts: array<TextureLayout>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) quarter: u32,
    @location(1) @interpolate(flat, either) object: u32,
    @location(2) uv: vec2f,
}

@vertex
fn corner(
    @location(0) position: vec3f,
    @location(2) object: u32,
    @location(3) uv: vec2f,
    @builtin(instance_index) quarter: u32,
) -> Corner {
    return Corner(quarter_clip(position, quarter), quarter, object, uv);
}

@fragment
fn holes(in: Corner) {
    if !is_on_quarter(in.clip.xy, in.quarter) {
        discard;
    }
    let picture = layouts[in.object];
    if picture.levels > 0u && texture_bilinear(picture, in.uv, 0u).w < picture.cutoff {
        discard;
    }
}
