// Turns virtual surface lights into the irradiance that reaches each pixel from them, by rays to all or to some.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> lights: array<Vsl>;
@group(0) @binding(3) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var<storage, read> patches: array<PatchRecord>;

// Sums the weights of the lights from `rays.items` to `rays.end`: what each would add if it were seen.
@compute @workgroup_size(8, 8)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_band(id.xy) {
        return;
    }
    let pixel = vec2u(id.x, rays.first_row + id.y);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        return;
    }
    let surface = surface_unpack(word, pixel);
    let slot = pixel_slot(id.xy);
    var total = pixels[slot].total;
    for (var i = rays.items; i < rays.end; i++) {
        total += weight(lights[i], transfer(lights[i], i, surface, pixel));
    }
    pixels[slot].total = total;
}

// Items are lights. With a budget, two sets of samples are laid over the sum of weights, stratified each on its own,
// so that their difference tells the error of their mean.
@compute @workgroup_size(8, 8)
fn trace_indirect(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_band(id.xy) {
        return;
    }
    let slot = pixel_slot(id.xy);
    var state = pixels[slot];
    if state.next > rays.items {
        return;
    }
    let pixel = vec2u(id.x, rays.first_row + id.y);
    let word = textureLoad(gbuffer, pixel, 0);
    if !surface_is_there(word) {
        textureStore(irradiance, pixel, vec4f(0.0));
        pixels[slot].next = rays.items + 1u;
        return;
    }
    let surface = surface_unpack(word, pixel);
    let origin = pixel_ray_origin(surface, pixel);
    let offset = frame.magnitude * RELATIVE_OFFSET;
    let sequence = sobol_sequence(frame.seed_low ^ VSL_SEED, frame.seed_high, pixel.y * frame.size.x + pixel.x);
    let samples_b = rays.budget / 2u;
    let samples_a = rays.budget - samples_b;
    var traced = 0u;
    while state.next < rays.end && walk_turns < RAY_TURNS_FOR_NEW {
        walk_turns += 2u;
        let light = lights[state.next];
        let reaching = transfer(light, state.next, surface, pixel);
        if reaching > 0.0 {
            if state.suspended == 0u {
                state.weight_a = 1.0;
                state.weight_b = 0.0;
                if rays.budget > 0u {
                    let share = weight(light, reaching);
                    state.running += share;
                    let passed_a = samples_before(state.running / state.total, samples_a, state.taken_a, sequence, false);
                    let passed_b = samples_before(state.running / state.total, samples_b, state.taken_b, sequence, true);
                    state.weight_a = f32(passed_a - state.taken_a) * state.total / (f32(samples_a) * share);
                    state.weight_b = 0.0;
                    if samples_b > 0u {
                        state.weight_b = f32(passed_b - state.taken_b) * state.total / (f32(samples_b) * share);
                    }
                    state.taken_a = passed_a;
                    state.taken_b = passed_b;
                }
            }
            if state.weight_a > 0.0 || state.weight_b > 0.0 {
                if state.suspended == 0u {
                    walk_begin();
                    traced += 1u;
                } else {
                    pixel_resume(state, slot);
                    state.suspended = 0u;
                }
                var target_place = light.position;
                if vsl_is_near {
                    target_place = origin + patch_middle;
                }
                let direction = target_place + light.normal * offset - origin;
                let answer = walk(ray_frame(origin, direction, SHADOW_REACH, rays.lo, rays.hi));
                if answer == WALK_SUSPENDED {
                    pixel_suspend(slot);
                    state.suspended = walk_depth + 1u;
                    state.group = walk_group;
                    break;
                }
                if answer == WALK_MISS {
                    let arriving = light.flux * reaching;
                    state.sum_a += arriving * state.weight_a;
                    state.sum_b += arriving * state.weight_b;
                }
            }
        }
        state.next += 1u;
    }
    atomicAdd(&counts[1], traced);
    if state.next >= rays.items {
        var sum = state.sum_a;
        if samples_b > 0u {
            let share_a = f32(samples_a) / f32(rays.budget);
            sum = state.sum_a * share_a + state.sum_b * (1.0 - share_a);
        }
        textureStore(irradiance, pixel, vec4f(sum, 0.0));
        state.next = rays.items + 1u;
    } else {
        atomicAdd(&counts[0], 1u);
    }
    pixels[slot] = state;
}

// Share of the light's flux that arrives where nothing is between, times what makes up for lights that are not kept.
fn transfer(light: Vsl, index: u32, surface: Surface, pixel: vec2u) -> f32 {
    let d = light.position - surface.position;
    let kept = vsl_weight(light, dot(d, d));
    if kept == 0.0 {
        return 0.0;
    }
    return kept * vsl_transfer(light, index, surface.position, pixel_ray_origin(surface, pixel), surface.normal);
}

// Luminance of what would arrive.
fn weight(light: Vsl, reaching: f32) -> f32 {
    return dot(light.flux, LUMINANCE) * reaching;
}

// How many samples of a set lie below `share` of the sum of weights: one in each of `count` strata.
fn samples_before(share: f32, count: u32, taken: u32, sequence: u32, second: bool) -> u32 {
    let at = share * f32(count);
    let stratum = u32(at);
    if stratum < taken {
        return taken;
    }
    if stratum >= count {
        return count;
    }
    var sample = sobol_sample(sequence, rays.sample);
    sample.dimension = stratum;
    let u = sobol_2d(sample);
    return stratum + u32(select(u.x, u.y, second) < at - f32(stratum));
}
