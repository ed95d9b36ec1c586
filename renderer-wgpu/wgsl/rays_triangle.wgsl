// Turns a ray and a triangle into whether they meet, exactly as on the CPU.

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

// Twin of `resolve`: signs of the edge functions are exact; the distance is that to the triangle's plane, in f32.
fn triangle_hit(f: RayFrame, v0: vec3f, v1: vec3f, v2: vec3f, normal: vec3f) -> bool {
    let moved = v0 - f.origin;
    let a = ray_permuted(moved, f.axis);
    let b = ray_permuted(v1 - f.origin, f.axis);
    let c = ray_permuted(v2 - f.origin, f.axis);
    let p = a.xy - f.shear * a.z;
    let q = b.xy - f.shear * b.z;
    let r = c.xy - f.shear * c.z;
    let edges = vec3i(edge_sign(r, q), edge_sign(p, r), edge_sign(q, p));
    let smallest = min(min(edges.x, edges.y), edges.z);
    let largest = max(max(edges.x, edges.y), edges.z);
    if (smallest < 0 && largest > 0) || (smallest == 0 && largest == 0) {
        return false;
    }
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

// Barycentric (u, v) of where a ray that hits a triangle does; twin of `resolve`, with edge functions rounded to f32.
fn triangle_place(f: RayFrame, v0: vec3f, v1: vec3f, v2: vec3f) -> vec2f {
    let a = ray_permuted(v0 - f.origin, f.axis);
    let b = ray_permuted(v1 - f.origin, f.axis);
    let c = ray_permuted(v2 - f.origin, f.axis);
    let p = a.xy - f.shear * a.z;
    let q = b.xy - f.shear * b.z;
    let r = c.xy - f.shear * c.z;
    let edges = vec3f(r.x * q.y - r.y * q.x, p.x * r.y - p.y * r.x, q.x * p.y - q.y * p.x);
    return edges.yz / (edges.x + edges.y + edges.z);
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
