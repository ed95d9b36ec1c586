// Turns a ray and the scene's compressed tree into whether anything lies along it; answers as the CPU's `occluded`.

// What a ray's node and triangle tests share; twin of `RayFrame` in the scene's structure.
struct RayFrame {
    origin: vec3f,
    t_max: f32,              // in units of the scaled direction
    direction: vec3f,        // scaled by a power of two to a largest component in [1, 2)
    axis: u32,               // its largest component
    near_origin: vec3f,      // padded origins for the near and the far planes of boxes
    octant: u32,             // turns child slots so that nearer ones come first
    far_origin: vec3f,
    inverse: vec3f,          // reciprocal of the direction, finite
    shear: vec2f,            // takes the direction to `axis`
}

@group(1) @binding(1) var<storage, read> nodes: array<vec4u>;       // five words of four for each node
@group(1) @binding(2) var<storage, read> triangles: array<vec4f>;   // three corners each, unit normal in the fourth components

const WALK_MISS: u32 = 0u;
const WALK_HIT: u32 = 1u;
const WALK_SUSPENDED: u32 = 2u;

// Groups of children that are still to be visited; no deeper than the tree, which is checked when it is built.
var<private> walk_stack: array<vec2u, RAY_STACK>;
var<private> walk_depth: u32;
// Number of the group's first child node; hits in the highest byte, which slots are nodes in the lowest.
var<private> walk_group: vec2u;
// Turns of loops that this invocation has taken.
var<private> walk_turns: u32;

fn ray_frame(origin: vec3f, direction: vec3f, t_max: f32, lo: vec3f, hi: vec3f) -> RayFrame {
    var f: RayFrame;
    let magnitude = abs(direction);
    let largest = max(max(magnitude.x, magnitude.y), magnitude.z);
    let exponent = clamp(bitcast<u32>(largest) >> 23u, 1u, 253u);
    f.origin = origin;
    f.direction = direction * bitcast<f32>((254u - exponent) << 23u);
    // A direction of no length leads nowhere.
    f.t_max = select(-1.0, t_max * bitcast<f32>(exponent << 23u), largest > 0.0);
    f.axis = select(select(0u, 1u, magnitude.y > magnitude.x), 2u, magnitude.z > magnitude.x && magnitude.z > magnitude.y);
    let far = max(abs(lo - origin), abs(hi - origin));
    let out = abs(origin);
    let pad = max(max(far.x, far.y), far.z) * NODE_PAD_DISTANCE + max(max(out.x, out.y), out.z) * NODE_PAD_ORIGIN;
    let scaled = abs(f.direction);
    let smallest = max(max(scaled.x, scaled.y), scaled.z) * SMALLEST_COMPONENT;
    let backwards = (bitcast<vec3u>(direction) >> vec3u(31u)) == vec3u(1u);
    let signs = select(vec3f(1.0), vec3f(-1.0), backwards);
    f.inverse = 1.0 / (max(scaled, vec3f(smallest)) * signs);
    f.near_origin = origin + pad * signs;
    f.far_origin = origin - pad * signs;
    let d = ray_permuted(f.direction, f.axis);
    f.shear = d.xy / d.z;
    let forwards = select(vec3u(4u, 2u, 1u), vec3u(0u), backwards);
    f.octant = forwards.x | forwards.y | forwards.z;
    return f;
}

// The components in cyclic order, `axis` last.
fn ray_permuted(v: vec3f, axis: u32) -> vec3f {
    if axis == 0u {
        return v.yzx;
    }
    if axis == 1u {
        return v.zxy;
    }
    return v;
}

// Puts the root before the walk.
fn walk_begin() {
    walk_depth = 0u;
    walk_group = vec2u(0u, 0x80000000u);
}

// Goes on until something is hit, nothing is left, or the turns of this invocation are used up.
fn walk(f: RayFrame) -> u32 {
    while walk_turns < RAY_TURNS {
        if (walk_group.y & 0xff000000u) == 0u {
            if walk_depth == 0u {
                return WALK_MISS;
            }
            walk_depth -= 1u;
            walk_group = walk_stack[walk_depth];
        }
        let bit = firstLeadingBit(walk_group.y);
        let taken = walk_group;
        walk_group.y &= ~(1u << bit);
        if (walk_group.y & 0xff000000u) != 0u {
            walk_stack[walk_depth] = walk_group;
            walk_depth += 1u;
        }
        let slot = (bit - 24u) ^ f.octant;
        let before = countOneBits(taken.y & 0xffu & ((1u << slot) - 1u));
        let node = (taken.x + before) * 5u;
        let head = nodes[node];
        let links = nodes[node + 1u];
        let hits = node_hits(f, head, links, nodes[node + 2u], nodes[node + 3u], nodes[node + 4u]);
        walk_group = vec2u(links.x, (hits & 0xff000000u) | (head.w >> 24u));
        var found = hits & 0x00ffffffu;
        // One for this turn, one for the last look at the loop below.
        walk_turns += 2u + countOneBits(found);
        while found != 0u {
            let triangle = links.y + firstTrailingBit(found);
            found &= found - 1u;
            if triangle_hit(f, triangle) {
                return WALK_HIT;
            }
        }
    }
    return WALK_SUSPENDED;
}

// Children that the ray may enter: nodes in the highest byte, by slot turned by the octant, triangles below.
fn node_hits(f: RayFrame, head: vec4u, links: vec4u, x: vec4u, y: vec4u, z: vec4u) -> u32 {
    let corner = bitcast<vec3f>(head.xyz);
    let step = bitcast<vec3f>(((vec3u(head.w) >> vec3u(0u, 8u, 16u)) & vec3u(0xffu)) << vec3u(23u)) * f.inverse;
    let near = (corner - f.near_origin) * f.inverse;
    let far = (corner - f.far_origin) * f.inverse;
    let turned = f.inverse < vec3f(0.0);
    // x, y and z hold the lower planes of eight children, then the upper ones.
    let x_planes = select(x, x.zwxy, turned.x);
    let y_planes = select(y, y.zwxy, turned.y);
    let z_planes = select(z, z.zwxy, turned.z);
    let first = half_hits(f, links.z, vec3u(x_planes.x, y_planes.x, z_planes.x), vec3u(x_planes.z, y_planes.z, z_planes.z), step, near, far);
    let second = half_hits(f, links.w, vec3u(x_planes.y, y_planes.y, z_planes.y), vec3u(x_planes.w, y_planes.w, z_planes.w), step, near, far);
    return first | second;
}

// The same for four children.
fn half_hits(f: RayFrame, meta_word: u32, near_planes: vec3u, far_planes: vec3u, step: vec3f, near: vec3f, far: vec3f) -> u32 {
    let near_x = vec4f(unpack4xU8(near_planes.x)) * step.x + near.x;
    let near_y = vec4f(unpack4xU8(near_planes.y)) * step.y + near.y;
    let near_z = vec4f(unpack4xU8(near_planes.z)) * step.z + near.z;
    let far_x = vec4f(unpack4xU8(far_planes.x)) * step.x + far.x;
    let far_y = vec4f(unpack4xU8(far_planes.y)) * step.y + far.y;
    let far_z = vec4f(unpack4xU8(far_planes.z)) * step.z + far.z;
    let entry = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
    let exit = min(min(far_x, far_y), min(far_z, vec4f(f.t_max)));
    let kinds = unpack4xU8(meta_word);
    let is_node = (kinds & vec4u(0x18u)) == vec4u(0x18u);
    let places = (kinds ^ select(vec4u(0u), vec4u(f.octant), is_node)) & vec4u(0x1fu);
    let bits = select(vec4u(0u), (kinds >> vec4u(5u)) << places, entry <= exit);
    return bits.x | bits.y | bits.z | bits.w;
}

// Twin of `resolve`: signs of the edge functions are exact; the distance is that to the triangle's plane, in f32.
fn triangle_hit(f: RayFrame, index: u32) -> bool {
    let v0 = triangles[index * 3u];
    let v1 = triangles[index * 3u + 1u];
    let v2 = triangles[index * 3u + 2u];
    let moved = v0.xyz - f.origin;
    let a = ray_permuted(moved, f.axis);
    let b = ray_permuted(v1.xyz - f.origin, f.axis);
    let c = ray_permuted(v2.xyz - f.origin, f.axis);
    let p = a.xy - f.shear * a.z;
    let q = b.xy - f.shear * b.z;
    let r = c.xy - f.shear * c.z;
    let edges = vec3i(edge_sign(r, q), edge_sign(p, r), edge_sign(q, p));
    let smallest = min(min(edges.x, edges.y), edges.z);
    let largest = max(max(edges.x, edges.y), edges.z);
    if (smallest < 0 && largest > 0) || (smallest == 0 && largest == 0) {
        return false;
    }
    let normal = vec3f(v0.w, v1.w, v2.w);
    let height = dot(normal, moved);
    let slope = dot(normal, f.direction);
    var t = 0.0;
    if slope != 0.0 {
        t = height / slope;
    }
    // The distance is clamped to the triangle's own padded box.
    let low = min(min(a, b), c);
    let high = max(max(a, b), c);
    let extent = max(-low, high);
    let pad = max(max(extent.x, extent.y), extent.z) * TRIANGLE_PAD;
    let inverse = ray_permuted(f.inverse, f.axis);
    let one = (low - pad) * inverse;
    let other = (high + pad) * inverse;
    let entries = min(one, other);
    let exits = max(one, other);
    let entry = max(max(entries.x, entries.y), entries.z);
    let exit = min(min(exits.x, exits.y), exits.z);
    t = min(max(t, entry), exit);
    return entry <= exit && t > 0.0 && t < f.t_max;
}

// Sign of p.x q.y - p.y q.x, exact: rounding keeps the order of two products, or makes them equal.
fn edge_sign(p: vec2f, q: vec2f) -> i32 {
    let first = p.x * q.y;
    let second = p.y * q.x;
    if first > second {
        return 1;
    }
    if first < second {
        return -1;
    }
    return product_order(p.x, q.y, p.y, q.x);
}

// Sign of a b - c d in whole numbers: mantissas of 24 bits have products of 48.
fn product_order(a: f32, b: f32, c: f32, d: f32) -> i32 {
    let first = exact_product(a, b);
    let second = exact_product(c, d);
    let negative = first.x < 0;
    if first.x != second.x {
        return select(-1, 1, first.x > second.x);
    }
    var order = 0;
    if first.y != second.y {
        order = select(-1, 1, first.y > second.y);
    } else if first.z != second.z {
        order = select(-1, 1, first.z > second.z);
    } else if first.w != second.w {
        order = select(-1, 1, first.w > second.w);
    }
    return select(order, -order, negative);
}

// Sign, exponent, upper and lower 24 bits of a product. Numbers below 2⁻¹²⁶ count as zero.
fn exact_product(a: f32, b: f32) -> vec4i {
    let x = bitcast<u32>(a);
    let y = bitcast<u32>(b);
    let exponent_a = (x >> 23u) & 0xffu;
    let exponent_b = (y >> 23u) & 0xffu;
    if exponent_a == 0u || exponent_b == 0u {
        return vec4i(0);
    }
    let m = (x & 0x7fffffu) | 0x800000u;
    let n = (y & 0x7fffffu) | 0x800000u;
    let middle = (m >> 12u) * (n & 0xfffu) + (m & 0xfffu) * (n >> 12u);
    let sum = (m & 0xfffu) * (n & 0xfffu) + ((middle & 0xfffu) << 12u);
    var high = (m >> 12u) * (n >> 12u) + (middle >> 12u) + (sum >> 24u);
    var low = sum & 0xffffffu;
    var exponent = exponent_a + exponent_b + 1u;
    if high < 0x800000u {
        high = (high << 1u) | (low >> 23u);
        low = (low << 1u) & 0xffffffu;
        exponent -= 1u;
    }
    let sign = select(1, -1, ((x ^ y) >> 31u) == 1u);
    return vec4i(sign, i32(exponent), i32(high), i32(low));
}
