// Turns the words of published distance maps into inverse distances.
//
// The module that includes it has `distance_maps`, an array of words of two texels each.

fn distance_map_unpack(texel: u32) -> f32 {
    return bitcast<f32>((texel + DISTANCE_LEAST) << DISTANCE_SHIFT);
}

// What the texel (u, v) holds, of the map of edge² texels that begins at word `first`.
fn distance_map_inverse(first: u32, edge: u32, u: u32, v: u32) -> f32 {
    let index = v * edge + u;
    let word = distance_maps[first + index / 2u];
    return distance_map_unpack((word >> (16u * (index & 1u))) & 0xffffu);
}

fn distance_map_inverses(first: u32, edge: u32, near: vec2u, far: vec2u) -> vec4f {
    return vec4f(distance_map_inverse(first, edge, near.x, near.y), distance_map_inverse(first, edge, far.x, near.y),
                 distance_map_inverse(first, edge, near.x, far.y), distance_map_inverse(first, edge, far.x, far.y));
}
