// Turns a virtual surface light and a receiver into what arrives, with the shadows that the light's map knows.
//
// The module that includes it says in `vsl_map_of` which map a light has, or NO_LAYER.

// Whether lights have maps of frame.map_edge² texels.
override MAPPED: bool = false;

// Irradiance in W m⁻² that `light` adds at a surface from which its map shows it.
fn vsl_arriving(light: Vsl, index: u32, position: vec3f, origin: vec3f, normal: vec3f) -> vec3f {
    let irradiance = vsl_irradiance(light, index, position, origin, normal);
    if !MAPPED || all(irradiance == vec3f(0.0)) {
        return irradiance;
    }
    let map = vsl_map_of(index);
    if map == NO_LAYER {
        return irradiance;
    }
    let tangents = basis_tangents(light.normal);
    let to = position - light.position;
    let local_to = vec3f(to * tangents, dot(to, light.normal));
    let local_normal = vec3f(normal * tangents, dot(normal, light.normal));
    return irradiance * distance_map_visibility(map, frame.map_edge, local_to, local_normal);
}
