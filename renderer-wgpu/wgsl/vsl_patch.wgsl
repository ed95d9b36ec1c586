// Turns a virtual surface light and a receiver into the share of the light's flux that arrives, near ones by their polygons.

struct PatchRecord {
    corners: array<f32, 24>, // from the light, m
    count: u32,
    area: f32,               // m²
}

// Whether the kernel knows polygons at all, and whether lights have a range.
override PATCHES: bool = true;
override RANGED: bool = true;

// Whether the last light was seen as a polygon: `patch_middle` is where to aim then.
var<private> vsl_is_near: bool;

// `origin` is where the receiver's rays leave, off its surface and towards the viewer: from there nothing of the receiver's
// own plane is above the horizon, and a receiver on the line where two walls meet lies before the other wall.
fn vsl_transfer(light: Vsl, index: u32, position: vec3f, origin: vec3f, normal: vec3f) -> f32 {
    let d = light.position - position;
    vsl_is_near = PATCHES && PI * dot(d, d) < -PATCH_NEAR_AREAS * light.area_term;
    if vsl_is_near {
        let from_origin = light.position - origin;
        if dot(light.normal, from_origin) >= 0.0 {
            return 0.0;
        }
        // Of the light's own plane, which a shading normal may lean over.
        let moved = d - from_origin;
        let height = dot(light.normal, d);
        if height * height <= dot(moved, moved) && dot(light.normal, normal) > 0.0 {
            return 0.0;
        }
        let count = patches[index].count;
        for (var i = 0u; i < count; i++) {
            let place = 3u * i;
            patch_corners[i] = from_origin + vec3f(patches[index].corners[place], patches[index].corners[place + 1u],
                                         patches[index].corners[place + 2u]);
        }
        return patch_form_factor(count, normal) / -light.area_term;
    }
    return kernel_transfer(d, normal, light.normal, max(light.area_term, 0.0));
}

// What a light is multiplied by at a squared distance of `r_sq` m²: 0 beyond its range, within one that it has drawn by lot the
// inverse of the probability.
fn vsl_weight(light: Vsl, r_sq: f32) -> f32 {
    if r_sq > light.range_sq {
        return 0.0;
    }
    return culling_weight(r_sq, max(max(light.flux.x, light.flux.y), light.flux.z), frame.flux_of_range);
}

// Irradiance in W m⁻² that `light` adds at a surface.
fn vsl_irradiance(light: Vsl, index: u32, position: vec3f, origin: vec3f, normal: vec3f) -> vec3f {
    if !RANGED {
        return light.flux * vsl_transfer(light, index, position, origin, normal);
    }
    let d = light.position - position;
    let kept = vsl_weight(light, dot(d, d));
    if kept == 0.0 {
        return vec3f(0.0);
    }
    return light.flux * (kept * vsl_transfer(light, index, position, origin, normal));
}
