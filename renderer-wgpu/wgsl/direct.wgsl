// Turns lights and their shadow maps into the irradiance that reaches each pixel straight from them.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
@group(0) @binding(3) var<storage, read> views: array<ShadowView>;
@group(0) @binding(4) var maps: texture_depth_2d_array;
@group(0) @binding(5) var compare: sampler_comparison;
// Number of the triangle that a light without extent sees, plus one; 0: none.
@group(0) @binding(6) var names: texture_2d_array<u32>;
@group(0) @binding(7) var<storage, read> corners: array<MapCorner>;
@group(0) @binding(8) var nearest: sampler;

// What the scene has: the rest is not compiled in.
override DELTA_LIGHTS: bool = true;
override AREA_LIGHTS: bool = true;
override SKY: bool = true;
override SHADOWS: bool = true;
// Whether the maps of lights without extent name triangles.
override NAMED_MAPS: bool = true;

@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return covering_triangle(vertex);
}

@fragment
fn arrive(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return vec4f(0.0);
    }
    let surface = surface_unpack(word, pixel);
    let origin = pixel_ray_origin(surface, pixel);
    var irradiance = vec3f(0.0);
    for (var i = 0u; i < frame.lights; i++) {
        if frame.only_light != ALL_LIGHTS && frame.only_light != i {
            continue;
        }
        let light = lights[i];
        if light.kind < LIGHT_PARALLELOGRAM {
            if DELTA_LIGHTS {
                irradiance += arriving(light, surface, origin, vec2f(0.5), light.first_map);
            }
        } else if light.kind == LIGHT_SKY {
            if SKY {
                // Directions that all pixels share: each has its map, of depths.
                for (var k = 0u; k < light.map_points; k++) {
                    let sun = lights[light.first_direction + k];
                    irradiance += arriving_from_sky(sun, surface);
                }
            }
        } else if light.kind == LIGHT_MESH {
            if AREA_LIGHTS {
                // Points that all pixels share: each is a light of its own.
                var sum = vec3f(0.0);
                for (var k = 0u; k < light.map_points; k++) {
                    var part = lights[light.first_direction + k];
                    part.power = light.power;
                    sum += arriving(part, surface, origin, vec2f(0.0), part.first_map);
                }
                irradiance += sum / f32(light.map_points);
            }
        } else if AREA_LIGHTS {
            // Points that all pixels share: each has its maps.
            var sum = vec3f(0.0);
            for (var k = 0u; k < light.map_points; k++) {
                let u = sobol_2d(sobol_sample(sobol_sequence(MAP_SEED, 0u, i), k));
                sum += arriving(light, surface, origin, u, light.first_map + k * AREA_FACES);
            }
            irradiance += sum / f32(light.map_points);
        }
    }
    return vec4f(irradiance, 0.0);
}

// Irradiance from one direction of a sky.
fn arriving_from_sky(sun: Light, surface: Surface) -> vec3f {
    let cos_theta = -dot(surface.normal, sun.direction);
    if cos_theta <= 0.0 {
        return vec3f(0.0);
    }
    var lit = 1.0;
    if SHADOWS && sun.maps > 0u {
        lit = shadow_beam_lit(sun.first_map, surface.position, surface.normal);
    }
    return sun.power * (cos_theta * lit);
}

// Irradiance through one point of a light.
fn arriving(light: Light, surface: Surface, origin: vec3f, u: vec2f, first_map: u32) -> vec3f {
    let reached = light_illuminate(light, surface.position, u);
    let cos_theta = dot(surface.normal, reached.wi);
    if cos_theta <= 0.0 || reached.irradiance <= 0.0 {
        return vec3f(0.0);
    }
    var lit = 1.0;
    if SHADOWS && light.maps > 0u {
        var map = first_map;
        if light.kind == LIGHT_POINT || (light.kind == LIGHT_SPOT && light.maps > 1u) {
            map += cube_face(-reached.wi);
        } else if light.kind >= LIGHT_PARALLELOGRAM {
            let across = normalize(light.edge_u);
            let along = cross(light.direction, across);
            map += half_cube_face(vec3f(dot(across, -reached.wi), dot(along, -reached.wi), dot(light.direction, -reached.wi)));
        }
        if NAMED_MAPS && light.kind < LIGHT_PARALLELOGRAM {
            let way = way_to_light(surface, origin, reached.wi, reached.distance);
            let is_free = shadow_free(map, origin, way, select(SHADOW_REACH, F32_MAX, reached.distance >= F32_MAX));
            lit = select(0.0, 1.0, is_free);
        } else if AREA_LIGHTS || !NAMED_MAPS {
            lit = shadow_lit(map, surface.position, surface.normal, cos_theta);
        }
    }
    return light.power * (reached.irradiance * cos_theta * lit);
}
