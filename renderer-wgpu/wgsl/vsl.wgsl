// Gathers a virtual surface light as the gathering passes read it, and what it adds to a receiver.

struct Vsl {
    position: vec3f,
    range_sq: f32,           // beyond this squared distance it is skipped, m²
    normal: vec3f,
    area_term: f32,          // what the kernel adds to π r², m²
    flux: vec3f,             // W
    object: u32,
}

// What is said of a block of lights.
struct BatchNumbers {
    first: u32,              // index of its first light
    is_last: u32,
    lights: u32,             // number of its lights
    words: u32,              // words of a list that have any of them
}

// Irradiance in W m⁻² that `light` adds at a surface.
fn vsl_irradiance(light: Vsl, position: vec3f, normal: vec3f) -> vec3f {
    let d = light.position - position;
    let transfer = kernel_transfer(d, normal, light.normal, light.area_term);
    if RANGED && dot(d, d) > light.range_sq {
        return vec3f(0.0);
    }
    return light.flux * transfer;
}

// Whether lights have a range at all.
override RANGED: bool = true;
