// Turns interleaved irradiance into that of all lights: a mean over the pattern around each pixel, edges respected.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var part: texture_2d<f32>;

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
    // Each place of the pattern has four pixels around this one, two in each direction: the nearest of them that sees
    // the same surface speaks for the place.
    for (var i = 0; i < edge * edge; i++) {
        let ahead = vec2i(i % edge, i / edge);
        let behind = ahead - edge;
        let near = select(behind, ahead, ahead <= vec2i(edge / 2));
        let far = select(ahead, behind, ahead <= vec2i(edge / 2));
        var offsets = array<vec2i, 4>(near, vec2i(far.x, near.y), vec2i(near.x, far.y), far);
        for (var k = 0; k < 4; k++) {
            let q = vec2i(pixel) + offsets[k];
            if sees_same_surface(q, surface) {
                sum += textureLoad(part, vec2u(q), 0).rgb;
                found += 1.0;
                break;
            }
        }
    }
    return vec4f(sum * (f32(edge * edge) / found), 0.0);
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
