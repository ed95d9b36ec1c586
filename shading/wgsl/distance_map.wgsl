// Turns the distances that a virtual surface light sees around itself into what of it a receiver sees: octahedral maps.
//
// The module that includes it says in `distance_map_inverses` what four texels hold: the inverse distances (m⁻¹) of the texels
// (near.x, near.y), (far.x, near.y), (near.x, far.y) and (far.x, far.y) of the map of edge² texels that `first` stands for.

// What is compared with the texels: the receiver's normal and the inverse of its plane's height over the light, both in the
// light's axes, and the inverse of its own distance.
struct DistanceReceiver {
    n: vec3f,
    inverse_height: f32,
    own: f32,
    is_plane: bool,
    scale: f32,
}

// The largest inverse distance with which the texel (u, v) shows the receiver.
fn distance_map_limit(edge: u32, receiver: DistanceReceiver, u: i32, v: i32) -> f32 {
    let step = 2.0 / f32(edge);
    let a = (f32(u) + 0.5) * step - 1.0;
    let b = (f32(v) + 0.5) * step - 1.0;
    let x = 0.5 * (a + b);
    let y = 0.5 * (a - b);
    let z = 1.0 - abs(x) - abs(y);
    let plane = dot(receiver.n, vec3f(x, y, z)) * receiver.inverse_height;
    let nearest = select(receiver.own, plane, receiver.is_plane && plane > receiver.own);
    return nearest * receiver.scale;
}

// The share of the light, in [0, 1], that a receiver sees: `to` leads from the light to it, in m, and `normal` is its own, both
// in the light's axes; `first` stands for the map of edge² texels.
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
    let limits = vec4f(distance_map_limit(edge, receiver, near.x, near.y), distance_map_limit(edge, receiver, far.x, near.y),
                       distance_map_limit(edge, receiver, near.x, far.y), distance_map_limit(edge, receiver, far.x, far.y));
    let weights = vec4f(rest.x, share.x, rest.x, share.x) * vec4f(rest.y, rest.y, share.y, share.y);
    let is_seen = distance_map_inverses(first, edge, vec2u(near), vec2u(far)) <= limits;
    let seen = select(vec4f(0.0), weights, is_seen);
    return seen.x + seen.y + seen.z + seen.w;
}
