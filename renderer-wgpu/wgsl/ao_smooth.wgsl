// Turns the noisy open share of each pixel into its mean over the pattern of samples, edges respected.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var noisy: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn smooth_open(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return vec4f(1.0);
    }
    let surface = surface_unpack(word, pixel);
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0u; i < 16u; i++) {
        let q = vec2i(pixel) + vec2i(i32(i % 4u), i32(i / 4u)) - 2;
        if any(q < vec2i(0)) || any(vec2u(q) >= frame.size) {
            continue;
        }
        let other_word = textureLoad(gbuffer, vec2u(q), 0);
        if !surface_is_there(other_word) {
            continue;
        }
        let other = surface_unpack(other_word, vec2u(q));
        if dot(other.normal, surface.normal) < 0.9 || abs(dot(other.position - surface.position, surface.normal)) > 0.01 * surface.distance {
            continue;
        }
        sum += textureLoad(noisy, vec2u(q), 0).r;
        weight += 1.0;
    }
    return vec4f(sum / weight);
}
