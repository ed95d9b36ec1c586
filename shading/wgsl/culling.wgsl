// Turns a light's index into a lot, and a distance into what the light is multiplied by where it is kept; twin of culling.rs.

// The lot in (0, 1] of light `index`.
fn culling_lot(index: u32, first: u32) -> f32 {
    let bits = first + index * 0x9E3779B9u;
    // What f32 cannot hold is dropped before it could round, up or down as the device likes.
    let dropped = 8u - min(countLeadingZeros(bits), 8u);
    return f32((bits >> dropped) + 1u) * (f32(1u << dropped) * (1.0 / 4294967296.0));
}

// 1/p at a squared distance of `r_sq` m²; `flux_of_range` is 0 where no light is drawn by lot.
fn culling_weight(r_sq: f32, flux_max: f32, flux_of_range: f32) -> f32 {
    if flux_of_range > 0.0 {
        return max(r_sq * min(flux_of_range / flux_max, F32_MAX), 1.0);
    }
    return 1.0;
}

// The greatest p (1 - p) over squared distances from `nearest_sq` to `farthest_sq`.
fn culling_greatest_variance(range_sq: f32, nearest_sq: f32, farthest_sq: f32) -> f32 {
    if range_sq <= 0.0 || farthest_sq <= range_sq {
        return 0.0;
    }
    let p = min(min(max(0.5, range_sq / farthest_sq), range_sq / max(nearest_sq, range_sq)), 1.0);
    return p * (1.0 - p);
}
