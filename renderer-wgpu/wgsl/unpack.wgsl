// Turns published records into lights, and leaves out those that no picture may show.

struct Record {
    changed_frame: vec2u,
    generation: u32,
    object: u32,
    position: array<f32, 3>,
    area: f32,
    normal: array<f32, 3>,
    standard_error: f32,
    flux: array<f32, 3>,
    mean_age_s: f32,
}

@group(0) @binding(1) var<storage, read> records: array<Record>;
@group(0) @binding(2) var<storage, read_write> lights: array<Vsl>;
// Number of records that were left out.
@group(0) @binding(3) var<storage, read_write> refused: atomic<u32>;
// Polygons of the records; fewer than records where there are none.
@group(0) @binding(4) var<storage, read> patches: array<PatchRecord>;

struct PatchRecord {
    corners: array<f32, 24>,
    count: u32,
    area: f32,
}

@compute @workgroup_size(64)
fn unpack(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if index >= arrayLength(&lights) {
        return;
    }
    var light = Vsl();
    if index < frame.vsls {
        let record = records[index];
        let position = vec3f(record.position[0], record.position[1], record.position[2]);
        let normal = vec3f(record.normal[0], record.normal[1], record.normal[2]);
        let flux = vec3f(record.flux[0], record.flux[1], record.flux[2]);
        let flux_max = max(max(flux.x, flux.y), flux.z);
        let usable = is_within(position, MAX_COORDINATE) && is_within(normal, 2.0) && is_within(flux, MAX_FLUX)
            && is_within(vec3f(record.area), MAX_COORDINATE)
            && min(min(flux.x, flux.y), min(flux.z, record.area)) >= 0.0
            && abs(dot(normal, normal) - 1.0) < 1e-4;
        if usable {
            var range_sq = kernel_range_sq(flux_max, frame.albedo_max, frame.epsilon);
            if frame.flux_of_range > 0.0 {
                range_sq = min(range_sq / culling_lot(index, frame.first_lot), F32_MAX);
            }
            var area_term = record.area * frame.area_factor;
            if frame.area_factor < 0.0 {
                area_term = -patch_area(index);
            }
            light = Vsl(position, range_sq, normal, area_term, flux, record.object);
        } else {
            atomicAdd(&refused, 1u);
        }
    }
    lights[index] = light;
}

// Area of a record's polygon, 0 where there is none that can be used.
fn patch_area(index: u32) -> f32 {
    // Whatever else a record says, a polygon has at most eight corners.
    if index >= arrayLength(&patches) || frame.vsls > arrayLength(&patches) {
        return 0.0;
    }
    let count = patches[index].count;
    let area = patches[index].area;
    var is_usable = count >= 3u && count <= PATCH_MAX_CORNERS && is_within(vec3f(area), MAX_COORDINATE) && area > 0.0;
    for (var i = 0u; i < 3u * PATCH_MAX_CORNERS; i++) {
        is_usable = is_usable && is_within(vec3f(patches[index].corners[i]), MAX_COORDINATE);
    }
    return select(0.0, area, is_usable);
}

// Whether all components are numbers of at most this size. By bits: compilers may take any float for a number.
fn is_within(v: vec3f, largest: f32) -> bool {
    let magnitude = bitcast<vec3u>(v) & vec3u(0x7fffffffu);
    return all(magnitude <= vec3u(bitcast<u32>(largest)));
}
