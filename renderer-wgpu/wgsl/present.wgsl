// Turns the shown layer into display colours of a window.

@group(0) @binding(1) var layer: texture_2d<f32>;

// Whether the target encodes sRGB by itself.
override TARGET_ENCODES: bool = false;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn display(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = min(vec2u(at.xy), frame.size - vec2u(1u));
    let linear = tone_apply(frame.tone_map, textureLoad(layer, pixel, 0).rgb, frame.exposure_ev);
    if TARGET_ENCODES {
        return vec4f(linear, 1.0);
    }
    return vec4f(tone_to_srgb(linear), 1.0);
}
