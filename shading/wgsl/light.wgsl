// Turns light sources into the irradiance that arrives from them; twin of light.rs.

struct Light {
    position: vec3f,       // corner of an area light
    kind: u32,
    direction: vec3f,      // the way the light travels; unit normal of the emitting side of an area light
    versine_inner: f32,
    edge_u: vec3f,
    versine_outer: f32,
    edge_v: vec3f,
    emitter_offset: f32,   // how far a point of the emitter is moved off its surface, in m
    power: vec3f,
    first_map: u32,        // its first shadow map
    maps: u32,             // number of its shadow maps
    map_points: u32,       // points of an area light that have maps
    first_direction: u32,  // of a sky or mesh: where its directions, points or triangles begin among the lights
    pad_0: u32,
}

struct Illumination {
    wi: vec3f,
    distance: f32,
    irradiance: f32,       // of a surface that faces wi, per unit of power; 0: no light goes there
}

// What reaches `x`; `u` chooses the point of an area light.
fn light_illuminate(light: Light, x: vec3f, u: vec2f) -> Illumination {
    switch light.kind {
        case LIGHT_POINT: {
            return light_from_position(light.position - x, 1.0 / (4.0 * PI), 0.0, light);
        }
        case LIGHT_SPOT: {
            let d = light.position - x;
            let wi = d / sqrt(dot(d, d));
            let to_axis = wi + light.direction;
            let profile = light_spot_profile(dot(to_axis, to_axis) * 0.5, light.versine_inner, light.versine_outer);
            return light_from_position(d, profile * FRAC_1_PI / (light.versine_inner + light.versine_outer), 0.0, light);
        }
        case LIGHT_DIRECTIONAL: {
            return Illumination(-light.direction, F32_MAX, 1.0);
        }
        default: {
            return light_from_position(light_emitter_point(light, u) - x, 0.0, FRAC_1_PI, light);
        }
    }
}

// A point of the emitter just off its surface.
fn light_emitter_point(light: Light, u: vec2f) -> vec3f {
    var a = u;
    if light.kind == LIGHT_TRIANGLE {
        a = light_triangle(u);
    }
    return light.position + light.edge_u * a.x + light.edge_v * a.y + light.direction * light.emitter_offset;
}

// Uniform barycentric weights of the second and third corner; twin of sampling::triangle.
fn light_triangle(u: vec2f) -> vec2f {
    if u.y > u.x {
        let x = u.x * 0.5;
        return vec2f(x, u.y - x);
    }
    let y = u.y * 0.5;
    return vec2f(u.x - y, y);
}

fn light_spot_profile(versine: f32, versine_inner: f32, versine_outer: f32) -> f32 {
    let width = versine_outer - versine_inner;
    if versine <= versine_inner {
        return 1.0;
    }
    if versine >= versine_outer {
        return 0.0;
    }
    let x = (versine_outer - versine) / width;
    return x * x * (3.0 - 2.0 * x);
}

// Inverse-square light at vector `d` from the receiver: `intensity` plus `cosine_intensity` times the emitter's cosine.
fn light_from_position(d: vec3f, intensity: f32, cosine_intensity: f32, light: Light) -> Illumination {
    let distance_sq = dot(d, d);
    let distance = sqrt(distance_sq);
    if !(distance_sq > 0.0) {
        return Illumination(vec3f(0.0), 0.0, 0.0);
    }
    let wi = d / distance;
    let cos_emitter = max(-dot(light.direction, wi), 0.0);
    let irradiance = (intensity + cosine_intensity * cos_emitter) / distance_sq;
    if irradiance > 0.0 && irradiance <= F32_MAX {
        return Illumination(wi, distance, irradiance);
    }
    return Illumination(wi, distance, 0.0);
}
