// Turns lights into the irradiance that reaches each pixel straight from them, by shadow rays as on the CPU.

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
@group(0) @binding(3) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var<uniform> sky: Sky;
@group(0) @binding(6) var sky_map: texture_2d<f32>;

// A ray that decides over some irradiance.
struct Question {
    direction: vec3f,
    t_max: f32,
    arriving: vec3f,
    asked: bool,             // whether there is anything to decide
}

// Items: each light once, those of a point and directional ones; then each sample, of each area light.
@compute @workgroup_size(8, 8)
fn trace_direct(@builtin(global_invocation_id) id: vec3u) {
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
    let sequence = sobol_sequence(frame.seed_low ^ LIGHT_SEED_LOW, frame.seed_high ^ LIGHT_SEED_HIGH, pixel.y * frame.size.x + pixel.x);
    var traced = 0u;
    while state.next < rays.end && walk_turns < RAY_TURNS_FOR_NEW {
        walk_turns += 2u;
        var index = state.next;
        var u = vec2f(0.5);
        let is_sample = index >= frame.lights;
        if is_sample {
            let number = (index - frame.lights) / frame.lights;
            index = (index - frame.lights) % frame.lights;
            if index == 0u && state.suspended == 0u {
                state.taken_a = 0u;
            }
            var sample = sobol_sample(sequence, rays.sample * frame.light_samples + number);
            sample.dimension = state.taken_a;
            u = sobol_2d(sample);
        }
        let light = lights[index];
        let of_this_kind = (light.kind >= LIGHT_PARALLELOGRAM) == is_sample;
        if of_this_kind && (frame.only_light == ALL_LIGHTS || frame.only_light == index) {
            let question = ask(light, surface, origin, u);
            if question.asked {
                if state.suspended == 0u {
                    walk_begin();
                    traced += 1u;
                } else {
                    pixel_resume(state, slot);
                    state.suspended = 0u;
                }
                let answer = walk(ray_frame(origin, question.direction, question.t_max, rays.lo, rays.hi));
                if answer == WALK_SUSPENDED {
                    pixel_suspend(slot);
                    state.suspended = walk_depth + 1u;
                    state.group = walk_group;
                    break;
                }
                if answer == WALK_MISS {
                    if is_sample {
                        state.sum_b += question.arriving;
                    } else {
                        state.sum_a += question.arriving;
                    }
                }
            }
        }
        if of_this_kind && is_sample {
            state.taken_a += 1u;
        }
        state.next += 1u;
    }
    atomicAdd(&counts[1], traced);
    if state.next >= rays.items {
        textureStore(irradiance, pixel, vec4f(state.sum_a + state.sum_b / f32(frame.light_samples), 0.0));
        state.next = rays.items + 1u;
    } else {
        atomicAdd(&counts[0], 1u);
    }
    pixels[slot] = state;
}

// A triangle among the lights, and what is left to choose a point there.
struct MeshChoice {
    index: u32,
    rest: f32,
}

// The triangle of a mesh that `u` chooses; twin of EmissiveMesh::place.
fn mesh_choice(light: Light, u: f32) -> MeshChoice {
    // The first whose running sum is above: a search in a loop.
    var low = 0u;
    var high = light.map_points - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if lights[light.first_direction + middle].versine_outer > u {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let end = lights[light.first_direction + low].versine_outer;
    var before = 0.0;
    if low > 0u {
        before = lights[light.first_direction + low - 1u].versine_outer;
    }
    var rest = 0.5;
    if end > before {
        rest = clamp((u - before) / (end - before), 0.0, ONE_MINUS_EPSILON);
    }
    return MeshChoice(light.first_direction + low, rest);
}

fn ask(asked_light: Light, surface: Surface, origin: vec3f, asked_place: vec2f) -> Question {
    var light = asked_light;
    var u = asked_place;
    if light.kind == LIGHT_MESH {
        walk_turns += MESH_TURNS;
        let choice = mesh_choice(light, u.x);
        u.x = choice.rest;
        light = lights[choice.index];
        light.power = asked_light.power;
    }
    if light.kind == LIGHT_SKY {
        // Its rows and columns are looked up in loops.
        walk_turns += SKY_TURNS;
        let from_sky = sky_sample_above(surface.normal, u);
        let arriving = light.power * from_sky.irradiance * dot(surface.normal, from_sky.wi);
        let asked = dot(surface.normal, from_sky.wi) > 0.0 && any(arriving > vec3f(0.0));
        return Question(from_sky.wi, F32_MAX, arriving, asked);
    }
    let reached = light_illuminate(light, surface.position, u);
    let cos_theta = dot(surface.normal, reached.wi);
    let arriving = light.power * (reached.irradiance * cos_theta);
    let asked = cos_theta > 0.0 && reached.irradiance > 0.0 && any(light.power != vec3f(0.0));
    let way = way_to_light(surface, origin, reached.wi, reached.distance);
    let t_max = select(SHADOW_REACH, F32_MAX, reached.distance >= F32_MAX);
    return Question(way, t_max, arriving, asked);
}
