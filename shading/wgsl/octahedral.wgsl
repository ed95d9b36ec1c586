// Turns unit vectors into two numbers and back; twin of octahedral.rs.

fn octahedral_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select(octahedral_fold(p), p, n.z >= 0.0);
}

fn octahedral_decode(p: vec2f) -> vec3f {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let xy = select(octahedral_fold(p), p, z >= 0.0);
    return normalize(vec3f(xy, z));
}

fn octahedral_fold(p: vec2f) -> vec2f {
    return (vec2f(1.0) - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
}
