// Turns G-buffer, direct and indirect irradiance into the layer that is shown.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> objects: array<Object>;
@group(0) @binding(3) var direct: texture_2d<f32>;
@group(0) @binding(4) var indirect: texture_2d<f32>;
@group(0) @binding(5) var openness: texture_2d<f32>;
@group(0) @binding(6) var owners: texture_2d<u32>;
// A colour for each light: who owns what, radiosity or age.
@group(0) @binding(7) var<storage, read> colours: array<vec4f>;
@group(0) @binding(8) var<storage, read> tallies: array<vec2f>;
@group(0) @binding(9) var<uniform> sky: Sky;
@group(0) @binding(10) var sky_map: texture_2d<f32>;

// Whether the scene has a sky: else nothing of it is compiled in.
override SKY: bool = true;

// Colours of textures, as bits.
@group(0) @binding(11) var texel: texture_2d<u32>;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn layer(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return layer_of(vec2u(at.xy), vec3f(1.0));
}

@fragment
fn layer_textured(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    return layer_of(pixel, bitcast<vec3f>(textureLoad(texel, pixel, 0).rgb));
}

// The layer at a pixel whose texture has the given colour.
fn layer_of(pixel: vec2u, texture_colour: vec3f) -> vec4f {
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        var background = vec3f(0.0);
        if SKY && (frame.show == SHOW_FULL || frame.show == SHOW_DIRECT) {
            if frame.only_light == ALL_LIGHTS || frame.only_light == sky.light {
                background = sky.power * sky_relative(pixel_ray(pixel));
            }
        }
        return vec4f(finite(background), 1.0);
    }
    let surface = surface_unpack(word, pixel);
    let object = objects[surface.object];
    let albedo = select(vec3f(0.0), object.albedo * texture_colour, object_reflects(object, surface.front));
    let emitted = select(vec3f(0.0), object.emitted, surface.front);
    let brdf = albedo * FRAC_1_PI;
    var colour = vec3f(0.0);
    if frame.show == SHOW_FULL || frame.show == SHOW_DIRECT {
        colour += emitted + brdf * textureLoad(direct, pixel, 0).rgb;
    }
    if frame.show == SHOW_FULL || frame.show == SHOW_INDIRECT {
        colour += brdf * textureLoad(indirect, pixel, 0).rgb * textureLoad(openness, pixel % textureDimensions(openness), 0).r;
    }
    if frame.show == SHOW_ALBEDO {
        colour = albedo;
    } else if frame.show == SHOW_NORMAL {
        colour = (surface.normal + vec3f(1.0)) * 0.5;
    } else if frame.show == SHOW_DEPTH {
        colour = vec3f(surface.distance);
    } else if frame.show == SHOW_OWNER {
        let owner = textureLoad(owners, pixel, 0).y;
        if owner != NO_OWNER {
            colour = colours[owner].rgb;
        }
    } else if frame.show == SHOW_TILES {
        colour = tile_colour(pixel);
    }
    return vec4f(finite(colour), 1.0);
}

// The share of all lights that is in the list of the pixel's tile: blue none, green half, red all.
fn tile_colour(pixel: vec2u) -> vec3f {
    let tile = pixel / TILE_EDGE;
    let first = (tile.y * frame.tiles.x + tile.x) * BATCH_WORDS;
    var kept = 0.0;
    for (var i = 0u; i < BATCH_WORDS; i++) {
        kept += tallies[first + i].y;
    }
    let share = kept / max(f32(frame.vsls), 1.0);
    return clamp(vec3f(2.0 * share - 1.0, 1.0 - abs(2.0 * share - 1.0), 1.0 - 2.0 * share), vec3f(0.0), vec3f(1.0));
}

// The nearest number that a file can hold: what overflowed becomes the largest, what is no number 0.
fn finite(colour: vec3f) -> vec3f {
    let bits = bitcast<vec3u>(colour);
    let special = (bits & vec3u(0x7f800000u)) == vec3u(0x7f800000u);
    let infinite = special & ((bits & vec3u(0x007fffffu)) == vec3u(0u));
    return select(select(colour, vec3f(0.0), special), vec3f(F32_MAX), infinite);
}
