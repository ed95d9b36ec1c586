// Turns a point into the share of a beam that reaches it, by the depths in the beam's shadow map. The module that includes it has
// `views`, `maps` and `nearest`.

// Share of a beam that reaches a surface: each of the four texels around it against the surface's own plane in its middle, so
// that neither slope nor filter asks for a bias. A texel where the plane would lie before what the beam sees there does not
// see this surface: it is asked about the place itself, or light would leak in at the foot of a wall.
fn shadow_beam_lit(index: u32, position: vec3f, normal: vec3f) -> f32 {
    let view = views[index];
    let m = view.clip_from_world;
    let place = (m * vec4f(position, 1.0)).xyz;
    let across = vec3f(m[0].x, m[1].x, m[2].x);
    let along = vec3f(m[0].y, m[1].y, m[2].y);
    let ahead = vec3f(m[0].z, m[1].z, m[2].z);
    // The plane in the map's own axes, and how its depth changes from texel to texel.
    let facing = dot(ahead, normal) / dot(ahead, ahead);
    let size = vec2f(textureDimensions(maps));
    let slope = vec2f(-dot(across, normal) / dot(across, across), dot(along, normal) / dot(along, along)) * (2.0 / size) / facing;
    let at = (vec2f(place.x, -place.y) * 0.5 + 0.5) * size - 0.5;
    let low = floor(at);
    let f = at - low;
    // A gather starts at the lower left and goes round.
    let seen = textureGather(maps, nearest, (low + 1.0) / size, index);
    let change = slope.x * vec4f(-f.x, 1.0 - f.x, 1.0 - f.x, -f.x) + slope.y * vec4f(1.0 - f.y, 1.0 - f.y, -f.y, -f.y);
    let bias = BEAM_BIAS_TEXELS * view.texel * length(ahead);
    let tolerance = bias + BEAM_SLOPE_TOLERANCE * abs(change);
    let behind = seen - place.z;
    let is_lit = (change + tolerance >= behind) & ((change - tolerance <= behind) | (vec4f(bias) >= behind));
    let weights = vec4f(1.0 - f.x, f.x, f.x, 1.0 - f.x) * vec4f(f.y, f.y, 1.0 - f.y, 1.0 - f.y);
    return dot(select(vec4f(0.0), weights, is_lit), vec4f(1.0));
}
