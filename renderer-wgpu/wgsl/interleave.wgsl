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
    let edge = frame.interleave;
    // Any window of the pattern's size holds every place of the pattern once.
    let first = vec2i(pixel) - vec2i(i32(edge / 2u));
    var sum = vec3f(0.0);
    var weight = 0.0;
    for (var i = 0u; i < edge * edge; i++) {
        let q = first + vec2i(i32(i % edge), i32(i / edge));
        if any(q < vec2i(0)) || any(vec2u(q) >= frame.size) {
            continue;
        }
        let other_word = textureLoad(gbuffer, vec2u(q), 0);
        if !surface_is_there(other_word) {
            continue;
        }
        let other = surface_unpack(other_word, vec2u(q));
        // Off the plane by more than a hundredth of the distance, or turned by more than 25°: another surface.
        let off = abs(dot(other.position - surface.position, surface.normal));
        if other.object != surface.object || dot(other.normal, surface.normal) < 0.9 || off > 0.01 * surface.distance {
            continue;
        }
        sum += textureLoad(part, vec2u(q), 0).rgb;
        weight += 1.0;
    }
    return vec4f(sum * (f32(edge * edge) / weight), 0.0);
}
