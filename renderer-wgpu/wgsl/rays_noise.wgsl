// Turns the two sets of samples of each pixel into sums by rows: squared error, irradiance, pixels that show anything.

// (Squared standard error, irradiance, pixels), means over the channels.
@group(0) @binding(4) var<storage, read_write> row_sums: array<vec4f>;

@compute @workgroup_size(64)
fn sum_rows(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= rays.rows || rays.first_row + id.x >= frame.size.y {
        return;
    }
    let samples_b = f32(rays.budget / 2u);
    let samples = f32(rays.budget);
    let samples_a = samples - samples_b;
    var sum = vec3f(0.0);
    for (var x = 0u; x < frame.size.x; x++) {
        let state = pixels[id.x * frame.size.x + x];
        let difference = state.sum_a - state.sum_b;
        // Variance of the mean of all, from that of the difference of the two sets' means.
        let variance = dot(difference, difference) * (samples_a * samples_b) / (samples * samples * 3.0);
        let mean = dot(state.sum_a * samples_a + state.sum_b * samples_b, vec3f(1.0 / 3.0)) / samples;
        sum += vec3f(variance, mean, f32(state.total > 0.0));
    }
    row_sums[rays.first_row + id.x] += vec4f(sum, 0.0);
}
