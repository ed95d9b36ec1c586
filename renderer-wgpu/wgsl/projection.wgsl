// Turns points of the scene into clip space, and pixels of a triangle into exact distances along their rays.

// Reversed depth without a far plane: near / view depth, whose relative precision is the same everywhere.
fn clip_from_world(position: vec3f) -> vec4f {
    let camera = frame.camera;
    let d = position - camera.position;
    let depth = dot(d, camera.forward);
    let size = vec2f(frame.size);
    let scale = vec2f(size.y / size.x, 1.0) / camera.tan_half_fov;
    let centred = vec2f(dot(d, camera.right), dot(d, camera.up)) * scale;
    let shift = (frame.jitter - vec2f(0.5)) * vec2f(-2.0, 2.0) / size;
    return vec4f(centred + shift * depth, camera.near, depth);
}

// Distance in m along `direction` (unit, from the eye) to the plane through `anchor`: free of the rasteriser's
// rounding. The smallest f32 above 0 at least, which 0, nothing, is not.
fn plane_distance(anchor: vec3f, normal: vec3f, direction: vec3f) -> f32 {
    let distance = dot(normal, anchor - frame.camera.position) / dot(normal, direction);
    return clamp(distance, 1e-37, F32_MAX);
}
