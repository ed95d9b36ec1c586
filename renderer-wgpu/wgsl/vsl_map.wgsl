// Turns a virtual surface light and a receiver into what arrives, with the shadows that the light's distance map knows.

// Whether lights have maps: two texels a word, frame.map_edge² of them for each light.
override MAPPED: bool = false;

// Irradiance in W m⁻² that `light` adds at a surface from which its map shows it.
fn vsl_arriving(light: Vsl, index: u32, position: vec3f, origin: vec3f, normal: vec3f) -> vec3f {
    let irradiance = vsl_irradiance(light, index, position, origin, normal);
    if !MAPPED || all(irradiance == vec3f(0.0)) {
        return irradiance;
    }
    let edge = frame.map_edge;
    let tangents = basis_tangents(light.normal);
    let to = position - light.position;
    let local_to = vec3f(to * tangents, dot(to, light.normal));
    let local_normal = vec3f(normal * tangents, dot(normal, light.normal));
    return irradiance * distance_map_visibility(index * (edge * edge / 2u), edge, local_to, local_normal);
}
