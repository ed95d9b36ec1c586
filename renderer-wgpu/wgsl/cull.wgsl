// Turns the G-buffer into bounds of each tile, and bounds and lights into one bit for each light that can reach it.

struct TileBounds {
    lo: vec3f,
    receivers: u32,
    hi: vec3f,
    pad_0: u32,
    normal_lo: vec3f,
    pad_1: u32,
    normal_hi: vec3f,
    pad_2: u32,
}

@group(0) @binding(1) var gbuffer: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> objects: array<Object>;
@group(0) @binding(3) var<storage, read_write> bounds: array<TileBounds>;

@compute @workgroup_size(64)
fn bound(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if index >= frame.tiles.x * frame.tiles.y {
        return;
    }
    let first = vec2u(index % frame.tiles.x, index / frame.tiles.x) * TILE_EDGE;
    let last = min(first + TILE_EDGE, frame.size);
    var tile = TileBounds(vec3f(F32_MAX), 0u, vec3f(-F32_MAX), 0u, vec3f(1.0), 0u, vec3f(-1.0), 0u);
    for (var y = first.y; y < last.y; y++) {
        for (var x = first.x; x < last.x; x++) {
            let word = textureLoad(gbuffer, vec2u(x, y), 0);
            if !surface_is_there(word) {
                continue;
            }
            let surface = surface_unpack(word, vec2u(x, y));
            if !object_reflects(objects[surface.object], surface.front) {
                continue;
            }
            tile.lo = min(tile.lo, surface.position);
            tile.hi = max(tile.hi, surface.position);
            tile.normal_lo = min(tile.normal_lo, surface.normal);
            tile.normal_hi = max(tile.normal_hi, surface.normal);
            tile.receivers++;
        }
    }
    bounds[index] = tile;
}

struct Batch {
    lights: array<Vsl, BATCH_LIGHTS>,
}

@group(1) @binding(0) var<storage, read> tiles: array<TileBounds>;
@group(1) @binding(1) var<uniform> batch: Batch;
// Lists of all lights; with interleaved sampling of the far ones, and behind them those of the near ones.
@group(1) @binding(2) var<storage, read_write> masks: array<u32>;
// For each word of each tile: upper bound of the radiance that skipped lights would have added, summed over the
// tile's receivers (W m⁻² sr⁻¹), or of the variance that lots bring in units of ε²; and number of lights kept; summed over
// the batches.
@group(1) @binding(3) var<storage, read_write> tallies: array<vec2f>;
@group(1) @binding(4) var<uniform> numbers: BatchNumbers;

@compute @workgroup_size(64)
fn select_lights(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if index >= frame.tiles.x * frame.tiles.y * numbers.words {
        return;
    }
    let tile = tiles[index / numbers.words];
    let word = index % numbers.words;
    let place = index / numbers.words * BATCH_WORDS + word;
    // Lights so near that what they add changes from pixel to pixel: not to be interleaved.
    let away = max(abs(tile.lo - frame.camera.position), abs(tile.hi - frame.camera.position));
    let steep = steep_range(length(away));
    var mask = 0u;
    var near_mask = 0u;
    var skipped = 0.0;
    if tile.receivers > 0u {
        for (var bit = 0u; bit < 32u; bit++) {
            let light = batch.lights[word * 32u + bit];
            let flux_max = max(max(light.flux.x, light.flux.y), light.flux.z);
            let lo = tile.lo - light.position;
            let hi = tile.hi - light.position;
            let highest = dot(max(light.normal * lo, light.normal * hi), vec3f(1.0));
            if flux_max <= 0.0 || highest <= 4.0 * EPSILON_OF_ONE * frame.magnitude {
                continue;
            }
            let gap = max(lo, vec3f(0.0)) - min(hi, vec3f(0.0));
            let nearest_sq = dot(gap, gap);
            // A polygon may rise above a horizon below which its middle lies.
            let is_polygon = PI * nearest_sq < -PATCH_NEAR_AREAS * light.area_term;
            // Largest n · d over the box of normals and the box of vectors to the light.
            let facing = max(max(-lo * tile.normal_lo, -lo * tile.normal_hi),
                             max(-hi * tile.normal_lo, -hi * tile.normal_hi));
            if dot(facing, vec3f(1.0)) <= 0.0 && !is_polygon {
                continue;
            }
            let bound = flux_max * frame.albedo_max / (PI * PI);
            let far = max(abs(lo), abs(hi));
            let by_lot = frame.flux_of_range > 0.0;
            if by_lot {
                skipped += culling_greatest_variance(flux_max / frame.flux_of_range, nearest_sq, dot(far, far)) * f32(tile.receivers);
            }
            if nearest_sq > light.range_sq {
                skipped += select(bound / nearest_sq * f32(tile.receivers), 0.0, by_lot);
                continue;
            }
            if dot(far, far) > light.range_sq {
                skipped += select(bound / light.range_sq * f32(tile.receivers), 0.0, by_lot);
            }
            if frame.interleave > 1u && nearest_sq < steep * steep {
                near_mask |= 1u << bit;
            } else {
                mask |= 1u << bit;
            }
        }
    }
    masks[place] = mask;
    if frame.interleave > 1u {
        masks[frame.tiles.x * frame.tiles.y * BATCH_WORDS + place] = near_mask;
    }
    tallies[place] += vec2f(skipped, f32(countOneBits(mask | near_mask)));
}
