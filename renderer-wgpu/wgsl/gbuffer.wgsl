// Turns triangles into the G-buffer: what each pixel's ray meets first.

struct Corner {
    // The same bits as in forward.wgsl, which draws at equal depth.
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) anchor: vec3f,
    @location(1) @interpolate(flat, either) normal: vec3f,
    @location(2) @interpolate(flat, either) object: u32,
    @location(3) bent: vec3f,
}

@vertex
fn corner(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) object: u32,
    @location(5) bent: u32,
) -> Corner {
    return Corner(clip_from_world(position), position, normal, object, corner_bent(bent));
}

@fragment
fn surface(in: Corner) -> @location(0) vec4u {
    let direction = pixel_ray(vec2u(in.clip.xy));
    let normal = shading_normal(in.normal, in.bent);
    let front = dot(in.normal, direction) < 0.0;
    let distance = plane_distance(in.anchor, in.normal, direction);
    return surface_pack(distance, select(-normal, normal, front), in.object, front);
}
