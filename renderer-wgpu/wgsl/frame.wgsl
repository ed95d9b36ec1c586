// Gathers what is the same for every pixel of a picture, and turns a G-buffer word into the surface seen there.

struct Frame {
    camera: Camera,
    size: vec2u,             // pixels
    tiles: vec2u,            // columns and rows of tiles
    jitter: vec2f,           // place of the sample within its pixel
    epsilon: f32,            // W m⁻² sr⁻¹; 0: no light has a range
    albedo_max: f32,
    magnitude: f32,          // largest coordinate of the scene in m
    area_factor: f32,        // 1 for the disc kernel, 0 for the point, -1 for polygons
    interleave: u32,         // edge of the pattern of interleaved sampling
    vsls: u32,
    lights: u32,
    light_samples: u32,      // points of an area light per pixel
    seed_low: u32,
    seed_high: u32,
    only_light: u32,         // index, or ALL_LIGHTS
    show: u32,
    exposure_ev: f32,
    tone_map: u32,
    ao_radius: f32,          // m
    ao_samples: u32,
    flux_of_range: f32,      // flux that has a range of 1 m, in W; 0 where no light draws its range by lot
    first_lot: u32,          // where the lots of the lights begin
    map_edge: u32,           // texels; 0: no maps of virtual surface lights
    map_depth_scale: f32,    // depth in shadow maps of virtual surface lights to inverse distance, m⁻¹
    pad_0: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

struct Object {
    albedo: vec3f,
    sides: u32,              // bit 0: the front reflects, bit 1: the back
    emitted: vec3f,          // radiance of the front, W m⁻² sr⁻¹
    pad_0: u32,
}

// A G-buffer word: distance along the pixel's ray in m (0: nothing), normal of the visible side, object and side.
struct Surface {
    position: vec3f,
    distance: f32,
    normal: vec3f,
    object: u32,
    front: bool,
}

fn surface_pack(distance: f32, normal: vec3f, object: u32, front: bool) -> vec4u {
    let folded = bitcast<vec2u>(octahedral_encode(normal));
    return vec4u(bitcast<u32>(distance), folded, object << 1u | u32(front));
}

fn surface_unpack(word: vec4u, pixel: vec2u) -> Surface {
    let distance = bitcast<f32>(word.x);
    let position = frame.camera.position + pixel_ray(pixel) * distance;
    let normal = octahedral_decode(bitcast<vec2f>(word.yz));
    return Surface(position, distance, normal, word.w >> 1u, (word.w & 1u) == 1u);
}

fn surface_is_there(word: vec4u) -> bool {
    return word.x != 0u;
}

// Where rays leave a surface: off it towards the viewer.
fn surface_ray_origin(surface: Surface) -> vec3f {
    return surface.position + surface.normal * (frame.magnitude * RELATIVE_OFFSET);
}

fn pixel_ray(pixel: vec2u) -> vec3f {
    return camera_direction(frame.camera, vec2f(pixel) + frame.jitter, frame.size);
}

// Where a pixel's rays leave: off the surface, and as far back towards the eye, for the way there is free. A point that
// rounding has put behind the neighbouring wall comes out from there again.
fn pixel_ray_origin(surface: Surface, pixel: vec2u) -> vec3f {
    return surface_ray_origin(surface) - pixel_ray(pixel) * (frame.magnitude * RELATIVE_OFFSET);
}

// The way from where rays leave to a light's point at `distance` along `wi` from the surface itself: a lamp may be nearer than
// a few times the way between. In units of its own length, which is 1 for a light infinitely far away.
fn way_to_light(surface: Surface, origin: vec3f, wi: vec3f, distance: f32) -> vec3f {
    if distance >= F32_MAX {
        return wi;
    }
    return wi * distance - (origin - surface.position);
}

// Whether the visible side of the surface reflects light.
fn object_reflects(object: Object, front: bool) -> bool {
    return (object.sides & select(2u, 1u, front)) != 0u;
}

// Within this distance in m of a surface at `distance` from the eye, what a light adds changes much over the pixels of
// the pattern of interleaved sampling.
fn steep_range(distance: f32) -> f32 {
    let pixel = distance * 2.0 * frame.camera.tan_half_fov / f32(frame.size.y);
    return pixel * f32(frame.interleave) * STEEP_PIXELS;
}

// A triangle that covers the picture, from its vertex number.
fn covering_triangle(vertex: u32) -> vec4f {
    let at = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(at * 2.0 - 1.0, 0.0, 1.0);
}
