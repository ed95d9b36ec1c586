// Turns triangles into the depths that a virtual surface light sees in a quarter of its hemisphere.

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) quarter: u32,
}

@vertex
fn corner(@location(0) position: vec3f, @builtin(instance_index) quarter: u32) -> Corner {
    return Corner(quarter_clip(position, quarter), quarter);
}

@fragment
fn depth(in: Corner) {
    if !is_on_quarter(in.clip.xy, in.quarter) {
        discard;
    }
}
