// Turns a list of rays into whether each meets anything: what tests compare with the CPU.

struct Query {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    pad_0: f32,
}

@group(0) @binding(0) var<storage, read> queries: array<Query>;
@group(0) @binding(1) var<storage, read_write> answers: array<u32>;
@group(0) @binding(2) var<storage, read> bounds: array<vec4f, 2>;

@compute @workgroup_size(64)
fn answer(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if index >= arrayLength(&answers) {
        return;
    }
    let query = queries[index];
    walk_begin();
    answers[index] = walk(ray_frame(query.origin, query.direction, query.t_max, bounds[0].xyz, bounds[1].xyz));
}
