// Turns the distances that a virtual surface light sees around itself into what of it a receiver sees: octahedral maps.
//
// The module that includes it has `distance_maps`, an array of words of two texels each.

fn distance_map_unpack(texel: u32) -> f32 {
    return bitcast<f32>((texel + DISTANCE_LEAST) << DISTANCE_SHIFT);
}

// What is compared with the texels: the receiver's normal and the inverse of its plane's height over the light, both in the
// light's axes, and the inverse of its own distance.
struct DistanceReceiver {
    n: vec3f,
    inverse_height: f32,
    own: f32,
    is_plane: bool,
    scale: f32,
}

// The weight of the texel (u, v) where it shows the receiver.
fn distance_map_part(first: u32, edge: u32, receiver: DistanceReceiver, u: i32, v: i32, weight: f32) -> f32 {
    let step = 2.0 / f32(edge);
    let a = (f32(u) + 0.5) * step - 1.0;
    let b = (f32(v) + 0.5) * step - 1.0;
    let x = 0.5 * (a + b);
    let y = 0.5 * (a - b);
    let z = 1.0 - abs(x) - abs(y);
    let plane = dot(receiver.n, vec3f(x, y, z)) * receiver.inverse_height;
    let nearest = select(receiver.own, plane, receiver.is_plane && plane > receiver.own);
    let index = u32(v) * edge + u32(u);
    let word = distance_maps[first + index / 2u];
    let inverse = distance_map_unpack((word >> (16u * (index & 1u))) & 0xffffu);
    return select(0.0, weight, inverse <= nearest * receiver.scale);
}

// The share of the light, in [0, 1], that a receiver sees: `to` leads from the light to it, in m, and `normal` is its own, both
// in the light's axes; the map of edge² texels begins at word `first`.
fn distance_map_visibility(first: u32, edge: u32, to: vec3f, normal: vec3f) -> f32 {
    let size = f32(edge);
    let m = max(abs(to.x) + abs(to.y) + max(to.z, 0.0), F32_MIN_POSITIVE);
    let height = dot(normal, to);
    let own = 1.0 / m;
    let receiver = DistanceReceiver(normal, 1.0 / height, own, height < 0.0, 1.0 + DISTANCE_BIAS_TEXELS / size);
    let p = vec2f(to.x + to.y, to.x - to.y);
    // One more than from the first texel's middle.
    let place = clamp(0.5 * size * (p * own) + 0.5 * size + 0.5, vec2f(0.0), vec2f(size));
    let low = floor(place);
    let share = place - low;
    let rest = 1.0 - share;
    let last = i32(edge) - 1;
    let near = clamp(vec2i(low) - 1, vec2i(0), vec2i(last));
    let far = clamp(vec2i(low), vec2i(0), vec2i(last));
    return distance_map_part(first, edge, receiver, near.x, near.y, rest.x * rest.y)
        + distance_map_part(first, edge, receiver, far.x, near.y, share.x * rest.y)
        + distance_map_part(first, edge, receiver, near.x, far.y, rest.x * share.y)
        + distance_map_part(first, edge, receiver, far.x, far.y, share.x * share.y);
}
