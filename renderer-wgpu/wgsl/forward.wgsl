// Turns the scene, drawn once for each light, into the irradiance that the lights add: without deferred shading.

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> numbers: BatchNumbers;
@group(0) @binding(3) var<storage, read> patches: array<PatchRecord>;
@group(0) @binding(4) var<storage, read> distance_maps: array<u32>;

struct Corner {
    // The same bits as in gbuffer.wgsl: only what is seen passes the test for equal depth.
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) anchor: vec3f,
    @location(1) @interpolate(flat, either) normal: vec3f,
    @location(2) @interpolate(flat, either) light: u32,
    @location(3) bent: vec3f,
}

@vertex
fn corner(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(5) bent: u32,
    @builtin(instance_index) light: u32,
) -> Corner {
    return Corner(clip_from_world(position), position, normal, light, corner_bent(bent));
}

@fragment
fn add(in: Corner) -> @location(0) vec4f {
    let direction = pixel_ray(vec2u(in.clip.xy));
    let position = frame.camera.position + direction * plane_distance(in.anchor, in.normal, direction);
    let bent = shading_normal(in.normal, in.bent);
    let normal = select(-bent, bent, dot(in.normal, direction) < 0.0);
    let origin = position + (normal - direction) * (frame.magnitude * RELATIVE_OFFSET);
    return vec4f(vsl_arriving(batch.lights[in.light], numbers.first + in.light, position, origin, normal), 0.0);
}
