// Turns a unit normal into an orthonormal basis.

// Two unit tangents, t and b with t × b = n.
fn basis_tangents(n: vec3f) -> mat2x3f {
    let sign = select(-1.0, 1.0, (bitcast<u32>(n.z) & 0x80000000u) == 0u);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return mat2x3f(vec3f(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3f(b, sign + n.y * n.y * a, -n.y));
}
