// Turns a point into the share of a light's point that reaches it, by the depths in its shadow map.

struct ShadowView {
    clip_from_world: mat4x4f,
    texel: f32,              // edge of a texel in m: at distance 1 of a perspective view, everywhere of a parallel one
    parallel: u32,
    layer: u32,              // of the map that names triangles
    pad_1: u32,
}

// The face of a cube around the light: +x -x +y -y +z -z.
fn cube_face(d: vec3f) -> u32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return select(1u, 0u, d.x > 0.0);
    }
    if a.y >= a.z {
        return select(3u, 2u, d.y > 0.0);
    }
    return select(5u, 4u, d.z > 0.0);
}

// The face of the half cube before an emitter, in the emitter's frame: +x -x +y -y, then ahead.
fn half_cube_face(d: vec3f) -> u32 {
    let a = abs(d);
    if a.z >= a.x && a.z >= a.y {
        return 4u;
    }
    if a.x >= a.y {
        return select(1u, 0u, d.x > 0.0);
    }
    return select(3u, 2u, d.y > 0.0);
}

// Share of the light that reaches a surface: percentage-closer filtering over 3 × 3 bilinear taps.
fn shadow_lit(index: u32, position: vec3f, normal: vec3f, cos_theta: f32) -> f32 {
    let view = views[index];
    let depth = (view.clip_from_world * vec4f(position, 1.0)).w;
    // Moved off the surface by the texels that its slope spans.
    let texel = view.texel * select(depth, 1.0, view.parallel != 0u);
    let sin_theta = sqrt(max(1.0 - cos_theta * cos_theta, 0.0));
    let clip = view.clip_from_world * vec4f(position + normal * (texel * SHADOW_NORMAL_TEXELS * sin_theta), 1.0);
    let place = clip.xyz / clip.w;
    let size = vec2f(textureDimensions(maps));
    let uv = vec2f(place.x, -place.y) * 0.5 + 0.5;
    var lit = 0.0;
    for (var i = 0u; i < 9u; i++) {
        let tap = vec2f(f32(i % 3u), f32(i / 3u)) - 1.0;
        lit += textureSampleCompareLevel(maps, compare, uv + tap / size, index, place.z);
    }
    return lit / 9.0;
}
