// Turns linear radiance into display colour; twin of tone.rs.

fn tone_apply(tone_map: u32, radiance: vec3f, exposure_ev: f32) -> vec3f {
    let x = max(radiance * exp2(exposure_ev), vec3f(0.0));
    var mapped = x;
    if tone_map == TONE_MAP_REINHARD {
        mapped = x / (vec3f(1.0) + x);
    } else if tone_map == TONE_MAP_ACES {
        let inverse = 1.0 / max(x, vec3f(1e-20));
        mapped = (vec3f(2.51) + 0.03 * inverse) / (vec3f(2.43) + 0.59 * inverse + 0.14 * inverse * inverse);
    }
    return clamp(mapped, vec3f(0.0), vec3f(1.0));
}

// Display-linear colour as sRGB in [0, 1], not rounded.
fn tone_to_srgb(linear: vec3f) -> vec3f {
    let low = 12.92 * linear;
    let high = 1.055 * pow(max(linear, vec3f(1e-20)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3f(0.0031308));
}
