// Turns the lights of each tile's list into the irradiance of its pixels.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<uniform> batch: Batch;
@group(0) @binding(3) var<storage, read> masks: array<u32>;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var before_near: texture_2d<f32>;
@group(0) @binding(6) var<uniform> numbers: BatchNumbers;
@group(0) @binding(7) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(8) var<storage, read> distance_maps: array<u32>;

// Whether there is irradiance of earlier batches to add to.
override CONTINUES: bool = false;

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
        irradiance += sum_of_list(surface, pixel_ray_origin(surface, pixel), first_word(pixel), 0xffffffffu);
    }
    return vec4f(irradiance, 0.0);
}

struct Parts {
    @location(0) far: vec4f,
    @location(1) near: vec4f,
}

// Of the far lights those of the pixel's place in the pattern, of the near ones all; a light passes smoothly from one to
// the other, so that what neighbours add fits together whatever list of whatever tile it comes from.
@fragment
fn gather_interleaved(@builtin(position) at: vec4f) -> Parts {
    let pixel = vec2u(at.xy);
    var far = vec3f(0.0);
    var near = vec3f(0.0);
    if CONTINUES {
        far = textureLoad(before, pixel, 0).rgb;
        near = textureLoad(before_near, pixel, 0).rgb;
    }
    let word = textureLoad(gbuffer, pixel, 0);
    if surface_is_there(word) {
        let surface = surface_unpack(word, pixel);
        let place = interleaved_lights(pixel);
        let first = first_word(pixel);
        let origin = pixel_ray_origin(surface, pixel);
        far += sum_of_list(surface, origin, first, place);
        let steep = steep_range(surface.distance);
        let first_near = frame.tiles.x * frame.tiles.y * BATCH_WORDS + first;
        for (var i = 0u; i < numbers.words; i++) {
            var bits = masks[first_near + i];
            while bits != 0u {
                let bit = firstTrailingBit(bits);
                bits &= bits - 1u;
                let light = batch.lights[i * 32u + bit];
                // What overflows would be no number once its share is taken.
                let added = min(vsl_arriving(light, numbers.first + i * 32u + bit, surface.position, origin, surface.normal), vec3f(1e37));
                let share_far = smoothstep(0.5 * steep, steep, distance(light.position, surface.position));
                near += added * (1.0 - share_far);
                far += added * select(0.0, share_far, ((place >> bit) & 1u) == 1u);
            }
        }
    }
    return Parts(vec4f(far, 0.0), vec4f(near, 0.0));
}

fn first_word(pixel: vec2u) -> u32 {
    let tile = pixel / TILE_EDGE;
    return (tile.y * frame.tiles.x + tile.x) * BATCH_WORDS;
}

// Irradiance of the lights of a list that are `kept`, a mask of every 32.
fn sum_of_list(surface: Surface, origin: vec3f, first: u32, kept: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < numbers.words; i++) {
        var bits = masks[first + i] & kept;
        while bits != 0u {
            let place = i * 32u + firstTrailingBit(bits);
            bits &= bits - 1u;
            sum += vsl_arriving(batch.lights[place], numbers.first + place, surface.position, origin, surface.normal);
        }
    }
    return sum;
}

// The lights of every 32 that a pixel sees: those whose index is the pixel's number modulo the pattern's size.
fn interleaved_lights(pixel: vec2u) -> u32 {
    let place = pixel % frame.interleave;
    let number = place.y * frame.interleave + place.x;
    let every = select(0x11111111u, 0x00010001u, frame.interleave == 4u);
    return every << number;
}
