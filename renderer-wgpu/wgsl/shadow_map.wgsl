// Turns triangles into the depths that a light sees.

struct ShadowView {
    clip_from_world: mat4x4f,
    texel: f32,
    parallel: u32,
    pad_0: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> view: ShadowView;

@vertex
fn corner(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return view.clip_from_world * vec4f(position, 1.0);
}
