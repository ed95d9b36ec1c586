// Turns each light into a sphere of its range, and each pixel of the sphere into the irradiance it adds.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<uniform> batch: Batch;
@group(0) @binding(3) var<uniform> numbers: BatchNumbers;
@group(0) @binding(4) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(5) var<storage, read> distance_maps: array<u32>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) light: u32,
}

// An octahedron around the sphere: its faces touch it at 1/√3 of the corners' distance.
@vertex
fn sphere(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Corner {
    let light = batch.lights[index];
    // No receiver is farther than the scene is wide.
    let radius = min(sqrt(light.range_sq), 4.0 * SQRT_3 * frame.magnitude) * SQRT_3 * 1.001;
    let face = vertex / 3u;
    let signs = vec3f(select(-1.0, 1.0, (face & 1u) != 0u), select(-1.0, 1.0, (face & 2u) != 0u),
                      select(-1.0, 1.0, (face & 4u) != 0u));
    // Faces with an odd number of negative signs are wound the other way.
    let flipped = signs.x * signs.y * signs.z < 0.0;
    var axis = vertex % 3u;
    if flipped {
        axis = (3u - axis) % 3u;
    }
    var offset = vec3f(0.0);
    offset[axis] = signs[axis] * radius;
    return Corner(clip_from_world(light.position + offset), index);
}

@fragment
fn add(in: Corner) -> @location(0) vec4f {
    let pixel = vec2u(in.clip.xy);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return vec4f(0.0);
    }
    let surface = surface_unpack(word, pixel);
    return vec4f(vsl_arriving(batch.lights[in.light], numbers.first + in.light, surface.position, pixel_ray_origin(surface, pixel), surface.normal), 0.0);
}
