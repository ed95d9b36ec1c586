// Turns a receiver and a virtual surface light into the share of its flux that arrives; twin of kernel.rs.

// cos θ cos θ_s K in m⁻²; `area_term` is what the kernel adds to π r²: the light's area, or 0 for the point.
fn kernel_transfer(d: vec3f, n: vec3f, n_s: vec3f, area_term: f32) -> f32 {
    let r_sq = dot(d, d);
    let cosines = max(dot(n, d), 0.0) * max(-dot(n_s, d), 0.0);
    let denominator = r_sq * (PI * r_sq + area_term);
    if cosines > 0.0 && denominator > 0.0 {
        return cosines / denominator;
    }
    return 0.0;
}

// Beyond this squared distance a light adds less than `epsilon` to any radiance; F32_MAX for `epsilon` = 0.
fn kernel_range_sq(flux_max: f32, albedo_max: f32, epsilon: f32) -> f32 {
    if epsilon > 0.0 {
        return min(flux_max * albedo_max / (PI * PI * epsilon), F32_MAX);
    }
    return F32_MAX;
}
