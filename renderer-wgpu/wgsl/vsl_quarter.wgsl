// Turns points of the scene into places on a virtual surface light's shadow map: an octahedral map, drawn in quarters.

struct VslView {
    position: vec3f,         // off the light's surface
    near: f32,               // m, in the 1-norm of the light's axes
    tangent: vec3f,
    pad_0: u32,
    bitangent: vec3f,
    pad_1: u32,
    normal: vec3f,
    edge: f32,               // of the map, in texels
}

@group(0) @binding(0) var<uniform> view: VslView;

// The signs of x and y, in the light's axes, of a quarter of the hemisphere: + +, - +, + -, - -.
fn quarter_signs(quarter: u32) -> vec2f {
    return vec2f(select(1.0, -1.0, (quarter & 1u) != 0u), select(1.0, -1.0, (quarter & 2u) != 0u));
}

// A quarter of the hemisphere is seen through a face of the octahedron |x| + |y| + |z| = 1: by a perspective view onto it, for
// on a face the 1-norm is linear. The place on the square is (x + y, x - y), its rows downwards; depth is near / 1-norm.
fn quarter_clip(position: vec3f, quarter: u32) -> vec4f {
    let to = position - view.position;
    let p = vec3f(dot(to, view.tangent), dot(to, view.bitangent), dot(to, view.normal));
    return vec4f(p.x + p.y, p.y - p.x, view.near, dot(p.xy, quarter_signs(quarter)) + p.z);
}

// Whether a fragment at `at`, in texels, is on the face of its quarter: the faces meet on the diagonals.
fn is_on_quarter(at: vec2f, quarter: u32) -> bool {
    let place = at * (2.0 / view.edge) - 1.0;
    let p = vec2f(place.x + place.y, place.x - place.y);
    return all((p < vec2f(0.0)) == (quarter_signs(quarter) < vec2f(0.0)));
}
