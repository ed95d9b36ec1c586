// Turns the index of a virtual surface light into its shadow map, and a texel of that into an inverse distance.

@group(0) @binding(9) var shadow_maps: texture_depth_2d_array;
// Of each light: NO_LAYER where it has none.
@group(0) @binding(10) var<storage, read> shadow_layers: array<u32>;
@group(0) @binding(11) var shadow_nearest: sampler;

fn vsl_map_of(index: u32) -> u32 {
    return shadow_layers[index];
}

// What four neighbours of a layer hold, in m⁻¹. The sampler is clamped at the edges: from the middle between the texels it gathers
// one of them twice there.
fn distance_map_inverses(layer: u32, edge: u32, near: vec2u, far: vec2u) -> vec4f {
    let middle = select(vec2f(near + 1u), vec2f(far), far == vec2u(0u)) / f32(edge);
    let gathered = textureGather(shadow_maps, shadow_nearest, middle, layer);
    return gathered.wzxy * frame.map_depth_scale;
}
