// Turns each light into the disc of its area, on its surface.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<storage, read> colours: array<vec4f>;
@group(0) @binding(3) var<uniform> numbers: BatchNumbers;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f,
    @location(1) @interpolate(flat, either) colour: vec3f,
}

@vertex
fn quad(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Corner {
    let light = batch.lights[index];
    if dot(light.normal, light.normal) == 0.0 {
        // A refused record: beyond the picture.
        return Corner(vec4f(2.0, 2.0, 2.0, 1.0), vec2f(0.0), vec3f(0.0));
    }
    let colour = colours[numbers.first + index];
    let at = vec2f(select(-1.0, 1.0, (vertex & 1u) != 0u), select(-1.0, 1.0, (vertex & 2u) != 0u));
    let helper = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(light.normal.x) > 0.7);
    let across = normalize(cross(helper, light.normal));
    let along = cross(light.normal, across);
    // A little off the surface, and smaller than the patch, so that neighbours stay apart.
    let radius = 0.8 * colour.w;
    let place = light.position + (across * at.x + along * at.y) * radius + light.normal * (frame.magnitude * 1e-3);
    return Corner(clip_from_world(place), at, colour.rgb);
}

@fragment
fn disc(in: Corner) -> @location(0) vec4f {
    if dot(in.at, in.at) > 1.0 {
        discard;
    }
    return vec4f(in.colour, 1.0);
}
