// Turns interleaved irradiance into that of all lights: a mean over the pattern around each pixel, edges respected.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
// Of the far lights, each pixel its part; of the near lights, all.
@group(0) @binding(2) var part: texture_2d<f32>;
@group(0) @binding(3) var near_lights: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn join(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return vec4f(0.0);
    }
    let surface = surface_unpack(word, pixel);
    let edge = i32(frame.interleave);
    var sum = vec3f(0.0);
    var found = 0.0;
    // Each place of the pattern has four pixels around this one, two in each direction: what they say is interpolated,
    // as far as they see the same surface.
    for (var i = 0; i < edge * edge; i++) {
        let ahead = vec2i(i % edge, i / edge);
        let share = vec2f(ahead) / f32(edge);
        var here = vec3f(0.0);
        var weight = 0.0;
        for (var k = 0; k < 4; k++) {
            let turn = vec2i(k & 1, k >> 1u);
            let parts = select(vec2f(1.0) - share, share, turn == vec2i(1));
            let q = vec2i(pixel) + ahead - turn * edge;
            if parts.x * parts.y > 0.0 && sees_same_surface(q, surface) {
                here += textureLoad(part, vec2u(q), 0).rgb * (parts.x * parts.y);
                weight += parts.x * parts.y;
            }
        }
        if weight > 0.0 {
            sum += here / weight;
            found += 1.0;
        }
    }
    return vec4f(sum * (f32(edge * edge) / found) + textureLoad(near_lights, pixel, 0).rgb, 0.0);
}

fn sees_same_surface(q: vec2i, surface: Surface) -> bool {
    if any(q < vec2i(0)) || any(vec2u(q) >= frame.size) {
        return false;
    }
    let word = textureLoad(gbuffer, vec2u(q), 0);
    if !surface_is_there(word) {
        return false;
    }
    let other = surface_unpack(word, vec2u(q));
    // Off the plane by more than a hundredth of the distance, or turned by more than 25°: another surface.
    let off = abs(dot(other.position - surface.position, surface.normal));
    return other.object == surface.object && dot(other.normal, surface.normal) >= 0.9 && off <= 0.01 * surface.distance;
}
