// Turns a ray to a light without extent into whether it is free, by the triangles that the light's shadow map names.

// A corner of a triangle as it is drawn.
struct MapCorner {
    position: array<f32, 3>,
    normal: array<f32, 3>,
    object: u32,
    bent: u32,
}

fn map_corner(index: u32) -> vec3f {
    let place = corners[index].position;
    return vec3f(place[0], place[1], place[2]);
}

// Whether the way from `origin` along `wi` is free for `reach` times its length.
//
// The 4 × 4 texels around the place name what the light sees there, and the ray itself is tested against each of these
// triangles: a shadow's edge is as sharp and as exact as the triangles, and nothing leaks where surfaces meet. Triangles
// finer than texels may all be missed although the surface that they make up lies before the light: the place is dark too
// where the planes of the four nearest all do, by more than a texel.
fn shadow_free(index: u32, origin: vec3f, wi: vec3f, reach: f32) -> bool {
    let view = views[index];
    let clip = view.clip_from_world * vec4f(origin, 1.0);
    let texel = view.texel * select(clip.w, 1.0, view.parallel != 0u);
    let size = vec2f(textureDimensions(names));
    // The corner in the middle of the 4 × 4, and those between its quarters.
    let middle = round((vec2f(clip.x, -clip.y) / clip.w * 0.5 + 0.5) * size);
    let low = (middle - 1.0) / size;
    let high = (middle + 1.0) / size;
    var a = textureGather(0, names, nearest, low, view.layer);
    var b = textureGather(0, names, nearest, vec2f(high.x, low.y), view.layer);
    var c = textureGather(0, names, nearest, vec2f(low.x, high.y), view.layer);
    var d = textureGather(0, names, nearest, high, view.layer);
    // Those around the middle; a gather starts at the lower left and goes round.
    let near = vec4u(a.y, b.x, c.z, d.w);
    var is_covered = all(near != vec4u(0u));
    let project = map_projection(wi);
    // The names in falling order, each once. Some drivers run both sides of every branch, but no turn of a loop too many.
    loop {
        let largest = max(max(a, b), max(c, d));
        let name = max(max(largest.x, largest.y), max(largest.z, largest.w));
        if name == 0u {
            break;
        }
        a = select(a, vec4u(0u), a == vec4u(name));
        b = select(b, vec4u(0u), b == vec4u(name));
        c = select(c, vec4u(0u), c == vec4u(name));
        d = select(d, vec4u(0u), d == vec4u(name));
        let first = (name - 1u) * 3u;
        let facing = corners[first].normal;
        let normal = vec3f(facing[0], facing[1], facing[2]);
        let v0 = map_corner(first) - origin;
        let height = dot(normal, v0);
        let slope = dot(normal, wi);
        let is_before = height * slope > 0.0 && abs(height) < abs(slope) * reach;
        // Edge functions compare two products in the same way for both triangles at an edge: no ray slips between.
        let p = v0 * project;
        let q = (map_corner(first + 1u) - origin) * project;
        let r = (map_corner(first + 2u) - origin) * project;
        let one = vec3f(r.x, p.x, q.x) * vec3f(q.y, r.y, p.y);
        let other = vec3f(r.y, p.y, q.y) * vec3f(q.x, r.x, p.x);
        if is_before && (all(one >= other) || all(one <= other)) {
            return false;
        }
        let is_apart = is_before && abs(height) > texel * COVERED_TEXELS;
        is_covered = is_covered && (is_apart || all(near != vec4u(name)));
    }
    return !is_covered;
}

// Takes points to the plane across the largest component of `wi`, along `wi`.
fn map_projection(wi: vec3f) -> mat2x3f {
    let magnitude = abs(wi);
    if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
        return mat2x3f(vec3f(-wi.y / wi.x, 1.0, 0.0), vec3f(-wi.z / wi.x, 0.0, 1.0));
    }
    if magnitude.y >= magnitude.z {
        return mat2x3f(vec3f(1.0, -wi.x / wi.y, 0.0), vec3f(0.0, -wi.z / wi.y, 1.0));
    }
    return mat2x3f(vec3f(1.0, 0.0, -wi.x / wi.z), vec3f(0.0, 1.0, -wi.y / wi.z));
}
