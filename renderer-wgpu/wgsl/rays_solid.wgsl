// Turns a ray and a triangle into whether it stops the ray, in scenes whose textures have no holes: where it is hit.

// Corners, and the unit normal in the fourth components.
fn triangle_stops(f: RayFrame, triangle: u32, v0: vec4f, v1: vec4f, v2: vec4f) -> bool {
    return triangle_hit(f, v0.xyz, v1.xyz, v2.xyz, vec3f(v0.w, v1.w, v2.w));
}
