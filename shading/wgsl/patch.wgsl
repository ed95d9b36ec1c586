// Turns a receiver and the polygon of a virtual surface light into the share of its radiosity that arrives; twin of patch.rs.

// What a form factor is of: the corners as they are seen from the receiver, in m.
var<private> patch_corners: array<vec3f, PATCH_MAX_CORNERS>;
// The mean of the corners that are left above the horizon: where to aim a shadow ray.
var<private> patch_middle: vec3f;

// Irradiance at a receiver of normal `n` over the patch's radiosity, in [0, 1]. The receiver lies before the patch's plane.
fn patch_form_factor(count: u32, n: vec3f) -> f32 {
    if count < 3u {
        return 0.0;
    }
    // Corners above the horizon are followed one by one: each edge adds its angle once both its ends are known.
    var found = 0u;
    var sum = vec3f(0.0);
    var first = vec3f(0.0);
    var last = vec3f(0.0);
    var factor = 0.0;
    var before = patch_corners[count - 1u];
    var height_before = dot(n, before);
    for (var i = 0u; i < count; i++) {
        let corner = patch_corners[i];
        let height = dot(n, corner);
        if (height > 0.0) != (height_before > 0.0) {
            // Weights of both ends, each exact to ulps: of a far end and a near one the near one's digits are kept.
            let whole = height_before - height;
            let crossing = corner * (height_before / whole) - before * (height / whole);
            if found == 0u {
                first = crossing;
            } else {
                factor += patch_edge(last, crossing, n);
            }
            last = crossing;
            sum += crossing;
            found += 1u;
        }
        if height > 0.0 {
            if found == 0u {
                first = corner;
            } else {
                factor += patch_edge(last, corner, n);
            }
            last = corner;
            sum += corner;
            found += 1u;
        }
        before = corner;
        height_before = height;
    }
    if found < 3u {
        return 0.0;
    }
    patch_middle = sum / f32(found);
    factor += patch_edge(last, first, n);
    return clamp(-factor / (2.0 * PI), 0.0, 1.0);
}

fn patch_edge(start: vec3f, end: vec3f, n: vec3f) -> f32 {
    let across = cross(start, end);
    let sine = length(across);
    if sine > 0.0 {
        return dot(n, across) * (patch_angle(sine, dot(start, end)) / sine);
    }
    return 0.0;
}

// atan2(sine, cosine) for `sine` > 0, in radians.
fn patch_angle(sine: f32, cosine: f32) -> f32 {
    let magnitude = abs(cosine);
    let ratio = min(sine, magnitude) / max(sine, magnitude);
    let s = ratio * ratio;
    var p = 0.0028662258f;
    p = p * s - 0.016165737f;
    p = p * s + 0.04290961f;
    p = p * s - 0.07528964f;
    p = p * s + 0.10656264f;
    p = p * s - 0.142089f;
    p = p * s + 0.19993551f;
    p = p * s - 0.33333144f;
    p = p * s + 1.0f;
    var a = ratio * p;
    if sine > magnitude {
        a = 0.5 * PI - a;
    }
    return select(a, PI - a, cosine < 0.0);
}
