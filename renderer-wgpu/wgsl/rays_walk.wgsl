// Turns a ray and the scene's compressed tree into whether anything lies along it; answers as the CPU's `occluded`.
// The module that includes it has `triangle_stops`.

@group(1) @binding(1) var<storage, read> nodes: array<vec4u>;       // five words of four for each node
@group(1) @binding(2) var<storage, read> triangles: array<vec4f>;   // three corners each, unit normal in the fourth components

const WALK_MISS: u32 = 0u;
const WALK_HIT: u32 = 1u;
const WALK_SUSPENDED: u32 = 2u;

// Groups of children that are still to be visited; no deeper than the tree, which is checked when it is built.
var<private> walk_stack: array<vec2u, RAY_STACK>;
var<private> walk_depth: u32;
// Number of the group's first child node; hits in the highest byte, which slots are nodes in the lowest.
var<private> walk_group: vec2u;
// Turns of loops that this invocation has taken.
var<private> walk_turns: u32;

// Puts the root before the walk.
fn walk_begin() {
    walk_depth = 0u;
    walk_group = vec2u(0u, 0x80000000u);
}

// Goes on until something is hit, nothing is left, or the turns of this invocation are used up.
fn walk(f: RayFrame) -> u32 {
    while walk_turns < RAY_TURNS {
        if (walk_group.y & 0xff000000u) == 0u {
            if walk_depth == 0u {
                return WALK_MISS;
            }
            walk_depth -= 1u;
            walk_group = walk_stack[walk_depth];
        }
        let bit = firstLeadingBit(walk_group.y);
        let taken = walk_group;
        walk_group.y &= ~(1u << bit);
        if (walk_group.y & 0xff000000u) != 0u {
            walk_stack[walk_depth] = walk_group;
            walk_depth += 1u;
        }
        let slot = (bit - 24u) ^ f.octant;
        let before = countOneBits(taken.y & 0xffu & ((1u << slot) - 1u));
        let node = (taken.x + before) * 5u;
        let head = nodes[node];
        let links = nodes[node + 1u];
        let hits = node_hits(f, head, links, nodes[node + 2u], nodes[node + 3u], nodes[node + 4u]);
        walk_group = vec2u(links.x, (hits & 0xff000000u) | (head.w >> 24u));
        var found = hits & 0x00ffffffu;
        // One for this turn, one for the last look at the loop below.
        walk_turns += 2u + countOneBits(found);
        while found != 0u {
            let triangle = links.y + firstTrailingBit(found);
            found &= found - 1u;
            let v0 = triangles[triangle * 3u];
            let v1 = triangles[triangle * 3u + 1u];
            let v2 = triangles[triangle * 3u + 2u];
            if triangle_stops(f, triangle, v0, v1, v2) {
                return WALK_HIT;
            }
        }
    }
    return WALK_SUSPENDED;
}

// Children that the ray may enter: nodes in the highest byte, by slot turned by the octant, triangles below.
fn node_hits(f: RayFrame, head: vec4u, links: vec4u, x: vec4u, y: vec4u, z: vec4u) -> u32 {
    let corner = bitcast<vec3f>(head.xyz);
    let step = bitcast<vec3f>(((vec3u(head.w) >> vec3u(0u, 8u, 16u)) & vec3u(0xffu)) << vec3u(23u)) * f.inverse;
    let near = (corner - f.near_origin) * f.inverse;
    let far = (corner - f.far_origin) * f.inverse;
    let turned = f.inverse < vec3f(0.0);
    // x, y and z hold the lower planes of eight children, then the upper ones.
    let x_planes = select(x, x.zwxy, turned.x);
    let y_planes = select(y, y.zwxy, turned.y);
    let z_planes = select(z, z.zwxy, turned.z);
    let first = half_hits(f, links.z, vec3u(x_planes.x, y_planes.x, z_planes.x), vec3u(x_planes.z, y_planes.z, z_planes.z), step, near, far);
    let second = half_hits(f, links.w, vec3u(x_planes.y, y_planes.y, z_planes.y), vec3u(x_planes.w, y_planes.w, z_planes.w), step, near, far);
    return first | second;
}

// The same for four children.
fn half_hits(f: RayFrame, meta_word: u32, near_planes: vec3u, far_planes: vec3u, step: vec3f, near: vec3f, far: vec3f) -> u32 {
    let near_x = vec4f(unpack4xU8(near_planes.x)) * step.x + near.x;
    let near_y = vec4f(unpack4xU8(near_planes.y)) * step.y + near.y;
    let near_z = vec4f(unpack4xU8(near_planes.z)) * step.z + near.z;
    let far_x = vec4f(unpack4xU8(far_planes.x)) * step.x + far.x;
    let far_y = vec4f(unpack4xU8(far_planes.y)) * step.y + far.y;
    let far_z = vec4f(unpack4xU8(far_planes.z)) * step.z + far.z;
    let entry = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
    let exit = min(min(far_x, far_y), min(far_z, vec4f(f.t_max)));
    let kinds = unpack4xU8(meta_word);
    let is_node = (kinds & vec4u(0x18u)) == vec4u(0x18u);
    let places = (kinds ^ select(vec4u(0u), vec4u(f.octant), is_node)) & vec4u(0x1fu);
    let bits = select(vec4u(0u), (kinds >> vec4u(5u)) << places, entry <= exit);
    return bits.x | bits.y | bits.z | bits.w;
}
