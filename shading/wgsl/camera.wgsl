// Turns pixels into rays; twin of camera.rs.

struct Camera {
    position: vec3f,
    tan_half_fov: f32,
    forward: vec3f,
    near: f32,
    right: vec3f,
    pad_0: f32,
    up: vec3f,
    pad_1: f32,
}

// Unit direction through picture coordinates in pixels of a picture of `size`.
fn camera_direction(camera: Camera, at: vec2f, size: vec2u) -> vec3f {
    let scale = 2.0 * camera.tan_half_fov / f32(size.y);
    let right = (at.x - 0.5 * f32(size.x)) * scale;
    let up = (0.5 * f32(size.y) - at.y) * scale;
    return normalize(camera.forward + camera.right * right + camera.up * up);
}
