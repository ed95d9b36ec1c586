// Gathers what a pixel's rays have brought so far, kept between dispatches: none may take many turns of loops.

struct RaysDispatch {
    lo: vec3f,               // bounds of the scene
    end: u32,                // this dispatch goes no further than this item
    hi: vec3f,
    items: u32,              // lights, or samples of lights, of the whole pass
    first_row: u32,          // of the band of the picture
    rows: u32,
    sample: u32,             // number of the camera sample
    budget: u32,             // rays per pixel; 0: as many as there are lights
}

struct PixelRays {
    sum_a: vec3f,
    next: u32,               // first item that is not finished; beyond all: the pixel is finished
    sum_b: vec3f,
    suspended: u32,          // 0, or the depth of the suspended ray's stack plus one
    total: f32,              // weight of all lights
    running: f32,            // weight of the lights before `next`, and of a suspended one
    taken_a: u32,            // samples that fell on them
    taken_b: u32,
    weight_a: f32,           // of the suspended ray
    weight_b: f32,
    group: vec2u,            // where it goes on
}

@group(1) @binding(0) var<uniform> rays: RaysDispatch;
@group(1) @binding(3) var<storage, read_write> pixels: array<PixelRays>;
@group(1) @binding(4) var<storage, read_write> stacks: array<vec2u>;
// Pixels that the last dispatch left unfinished, and rays traced.
@group(1) @binding(5) var<storage, read_write> counts: array<atomic<u32>, 2>;

// Number of a pixel's state within the band.
fn pixel_slot(id: vec2u) -> u32 {
    return id.y * frame.size.x + id.x;
}

fn is_in_band(id: vec2u) -> bool {
    return id.x < frame.size.x && id.y < rays.rows && rays.first_row + id.y < frame.size.y;
}

// Takes the stack of a suspended ray back.
fn pixel_resume(state: PixelRays, slot: u32) {
    walk_depth = state.suspended - 1u;
    walk_group = state.group;
    for (var i = 0u; i < walk_depth; i++) {
        walk_stack[i] = stacks[slot * RAY_STACK + i];
    }
    walk_turns += walk_depth + 1u;
}

// Keeps the stack of a ray that is suspended.
fn pixel_suspend(slot: u32) {
    for (var i = 0u; i < walk_depth; i++) {
        stacks[slot * RAY_STACK + i] = walk_stack[i];
    }
}
