// Turns the lights of each tile's list into the irradiance of its pixels.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<uniform> batch: Batch;
@group(0) @binding(3) var<storage, read> masks: array<u32>;
@group(0) @binding(4) var before: texture_2d<f32>;

// Whether there is irradiance of earlier batches to add to.
override CONTINUES: bool = false;
// Whether a pixel sees only the lights of its place in the pattern of interleaved sampling.
override INTERLEAVED: bool = false;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn gather(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    var irradiance = vec3f(0.0);
    if CONTINUES {
        irradiance = textureLoad(before, pixel, 0).rgb;
    }
    let word = textureLoad(gbuffer, pixel, 0);
    if surface_is_there(word) {
        let surface = surface_unpack(word, pixel);
        let tile = pixel / TILE_EDGE;
        let first = (tile.y * frame.tiles.x + tile.x) * BATCH_WORDS;
        var kept = 0xffffffffu;
        if INTERLEAVED {
            kept = interleaved_lights(pixel);
        }
        for (var i = 0u; i < BATCH_WORDS; i++) {
            var bits = masks[first + i] & kept;
            while bits != 0u {
                let light = batch.lights[i * 32u + firstTrailingBit(bits)];
                bits &= bits - 1u;
                irradiance += vsl_irradiance(light, surface.position, surface.normal);
            }
        }
    }
    return vec4f(irradiance, 0.0);
}

// The lights of every 32 that a pixel sees: those whose index is the pixel's number modulo the pattern's size.
fn interleaved_lights(pixel: vec2u) -> u32 {
    let place = pixel % frame.interleave;
    let number = place.y * frame.interleave + place.x;
    let every = select(0x11111111u, 0x00010001u, frame.interleave == 4u);
    return every << number;
}
