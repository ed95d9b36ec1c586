// Turns triangles with textures into the G-buffer, and into the texture's colour at each pixel.

@group(0) @binding(1) var<storage, read> texels: array<vec2u>;
@group(0) @binding(2) var<storage, read> layouts: array<TextureLayout>;

struct Corner {
    // The same bits as in forward.wgsl, which draws at equal depth.
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) anchor: vec3f,
    @location(1) @interpolate(flat, either) normal: vec3f,
    @location(2) @interpolate(flat, either) object: u32,
    @location(3) uv: vec2f,
    @location(4) @interpolate(flat, either) density: f32,
    @location(5) bent: vec3f,
}

struct Seen {
    @location(0) surface: vec4u,
    @location(1) colour: vec4u,  // the bits of linear RGB
}

@vertex
fn corner(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) object: u32,
    @location(3) uv: vec2f,
    @location(4) density: f32,
    @location(5) bent: u32,
) -> Corner {
    return Corner(clip_from_world(position), position, normal, object, uv, density, corner_bent(bent));
}

@fragment
fn surface(in: Corner) -> Seen {
    let direction = pixel_ray(vec2u(in.clip.xy));
    let normal = shading_normal(in.normal, in.bent);
    let slope = dot(in.normal, direction);
    let front = slope < 0.0;
    let distance = plane_distance(in.anchor, in.normal, direction);
    let picture = layouts[in.object];
    var colour = vec3f(1.0);
    if picture.levels > 0u {
        if texture_bilinear(picture, in.uv, 0u).w < picture.cutoff {
            discard;
        }
        let pixel = 2.0 * frame.camera.tan_half_fov / f32(frame.size.y);
        let width = texture_footprint(pixel, distance, abs(slope));
        colour = texture_sample(picture, in.uv, texture_level_of_width(in.density, width)).rgb;
    }
    let word = surface_pack(distance, select(-normal, normal, front), in.object, front);
    return Seen(word, vec4u(bitcast<vec3u>(colour), 0u));
}
