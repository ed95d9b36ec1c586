// Turns a triangle's normal and the normals of its corners into the one that light is weighed by; twin of surface.rs.

// `bent` is the weighted sum of the corners' normals, on the same side as `flat`, of unit length.
fn shading_normal(flat: vec3f, bent: vec3f) -> vec3f {
    let length_sq = dot(bent, bent);
    let cosine = dot(flat, bent);
    // Neither zero nor NaN is larger.
    if cosine > 0.0 && cosine * cosine > SHADING_COS * SHADING_COS * length_sq {
        return bent * inverseSqrt(length_sq);
    }
    return flat;
}
