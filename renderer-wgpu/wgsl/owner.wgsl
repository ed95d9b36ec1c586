// Turns each pixel into the virtual surface light that owns it: the nearest of its object whose normal is compatible.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<uniform> batch: Batch;
// Of earlier batches: squared distance (bits) and index of the best, squared distance and index of the best of the side.
@group(0) @binding(3) var before: texture_2d<u32>;
@group(0) @binding(4) var<uniform> numbers: BatchNumbers;

override CONTINUES: bool = false;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn find(@builtin(position) at: vec4f) -> @location(0) vec4u {
    let pixel = vec2u(at.xy);
    var best = vec4u(bitcast<u32>(F32_MAX), NO_OWNER, bitcast<u32>(F32_MAX), NO_OWNER);
    if CONTINUES {
        best = textureLoad(before, pixel, 0);
    }
    let word = textureLoad(gbuffer, pixel, 0);
    if surface_is_there(word) {
        let surface = surface_unpack(word, pixel);
        for (var i = 0u; i < numbers.lights; i++) {
            let light = batch.lights[i];
            let cos_between = dot(light.normal, surface.normal);
            if light.object != surface.object || cos_between <= 0.0 {
                continue;
            }
            let d = light.position - surface.position;
            let distance_sq = dot(d, d);
            if distance_sq < bitcast<f32>(best.z) {
                best = vec4u(best.xy, bitcast<u32>(distance_sq), numbers.first + i);
            }
            if cos_between >= COMPATIBLE_COS && distance_sq < bitcast<f32>(best.x) {
                best = vec4u(bitcast<u32>(distance_sq), numbers.first + i, best.zw);
            }
        }
    }
    // After the last batch the shown index is that of the compatible one, else of the side.
    if numbers.is_last == 1u && best.y == NO_OWNER {
        best.y = best.w;
    }
    return best;
}
