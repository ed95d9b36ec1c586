// Turns the G-buffer into the share of the hemisphere over each pixel that nearby surfaces leave open.
//
// Source: Mittring, "Finding Next Gen: CryEngine 2", 2007, with cosine-weighted samples over the surface's hemisphere.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn open(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return vec4f(1.0);
    }
    let surface = surface_unpack(word, pixel);
    // A pattern of 4 × 4 pixels shares one set of samples, which the smoothing then joins.
    let place = pixel % 4u;
    let sequence = sobol_sequence(frame.seed_low, frame.seed_high, place.y * 4u + place.x);
    var blocked = 0.0;
    for (var i = 0u; i < frame.ao_samples; i++) {
        var sample = sobol_sample(sequence, i);
        let u = sobol_2d(sample);
        sample.dimension = 1u;
        let reach = sobol_2d(sample).x;
        let angle = 2.0 * PI * u.y;
        let sphere = vec3f(sqrt(max(1.0 - (2.0 * u.x - 1.0) * (2.0 * u.x - 1.0), 0.0)) * vec2f(cos(angle), sin(angle)), 2.0 * u.x - 1.0);
        // The normal plus a point of the unit sphere is cosine distributed.
        let direction = normalize(surface.normal * 1.0001 + sphere);
        let point = surface.position + direction * (frame.ao_radius * reach);
        let clip = clip_from_world(point);
        if clip.w <= frame.camera.near {
            continue;
        }
        let ndc = clip.xy / clip.w;
        let q = (vec2f(ndc.x, -ndc.y) * 0.5 + 0.5) * vec2f(frame.size);
        if any(q < vec2f(0.0)) || any(q >= vec2f(frame.size)) {
            continue;
        }
        let other_word = textureLoad(gbuffer, vec2u(q), 0);
        if !surface_is_there(other_word) {
            continue;
        }
        let other = surface_unpack(other_word, vec2u(q));
        // Blocked where what is seen there lies before the point, over this surface and within reach.
        let d = other.position - surface.position;
        let before = other.distance < length(point - frame.camera.position) * 0.999;
        let over = dot(d, surface.normal) > 0.02 * frame.ao_radius;
        if before && over && dot(d, d) < frame.ao_radius * frame.ao_radius {
            blocked += 1.0;
        }
    }
    return vec4f(1.0 - blocked / f32(frame.ao_samples));
}
