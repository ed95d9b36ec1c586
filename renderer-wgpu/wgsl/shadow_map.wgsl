// Turns triangles into the depths that a light sees, and into which of them it sees.

struct ShadowView {
    clip_from_world: mat4x4f,
    texel: f32,
    parallel: u32,
    layer: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> view: ShadowView;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) name: u32,
}

@vertex
fn corner(@location(0) position: vec3f, @builtin(vertex_index) vertex: u32) -> Corner {
    return Corner(view.clip_from_world * vec4f(position, 1.0), vertex / 3u + 1u);
}

@fragment
fn name(in: Corner) -> @location(0) vec4u {
    return vec4u(in.name, 0u, 0u, 0u);
}
