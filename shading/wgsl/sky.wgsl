// Turns radiance from infinitely far away into directions drawn by importance, and into irradiance; twin of sky.
//
// The module that includes it has `sky: Sky` and `sky_map: texture_2d<f32>`: the texels of the map, row by row, with the
// share of their row that ends with each as the last component; below them, in as many rows as they need, the shares of the
// whole that end with each row.

struct Sky {
    zenith: vec3f,           // radiance relative to the mean
    kind: u32,
    horizon: vec3f,
    channels: f32,           // number of channels that shine
    ground: vec3f,
    turn: f32,               // of the map about +Y, in full turns
    power: vec3f,            // mean radiance, W m⁻² sr⁻¹
    width: u32,              // texels of the map
    height: u32,
    light: u32,              // index of the light, or none
    pad_0: u32,
    pad_1: u32,
}

struct SkySample {
    wi: vec3f,
    irradiance: vec3f,       // of a surface that faces wi, per unit of mean radiance; 0: no light comes from there
}

// Radiance from the direction `wi`, relative to the mean.
fn sky_relative(wi: vec3f) -> vec3f {
    if sky.kind == SKY_MAP {
        let around = 0.5 + atan2(wi.x, -wi.z) / (2.0 * PI) + sky.turn;
        let down = atan2(sqrt(wi.x * wi.x + wi.z * wi.z), wi.y) / PI;
        let column = u32((around - floor(around)) * f32(sky.width));
        let row = u32(down * f32(sky.height));
        return textureLoad(sky_map, vec2u(min(column, sky.width - 1u), min(row, sky.height - 1u)), 0).rgb;
    }
    return select(sky.horizon + (sky.zenith - sky.horizon) * wi.y, sky.ground, wi.y < 0.0);
}

// The density of samples times 4π where the sky has the given relative radiance.
fn sky_importance(relative: vec3f) -> f32 {
    return (relative.x + relative.y + relative.z) / sky.channels;
}

// A direction drawn by importance.
fn sky_sample(u: vec2f) -> vec3f {
    if sky.kind == SKY_MAP {
        return sky_map_sample(u);
    }
    let a = sky_importance(sky.horizon);
    let b = sky_importance(sky.zenith);
    let below = 0.5 * sky_importance(sky.ground);
    var y = 0.0;
    if u.x < below {
        y = min(u.x / below - 1.0, -F32_MIN_POSITIVE);
    } else {
        let t = min((u.x - below) / (1.0 - below), 1.0);
        let root = sqrt(max(a * a + t * (b * b - a * a), 0.0));
        if a + root > 0.0 {
            y = min(t * (a + b) / (a + root), 1.0);
        }
    }
    let radius = sqrt(max((1.0 - y) * (1.0 + y), 0.0));
    let angle = 2.0 * PI * u.y;
    return vec3f(radius * sin(angle), y, -radius * cos(angle));
}

fn sky_row_end(row: u32) -> f32 {
    return textureLoad(sky_map, vec2u(row % sky.width, sky.height + row / sky.width), 0).a;
}

fn sky_column_end(column: u32, row: u32) -> f32 {
    return textureLoad(sky_map, vec2u(column, row), 0).a;
}

fn sky_map_sample(u: vec2f) -> vec3f {
    // The first row, and in it the first texel, that ends beyond the number.
    var row = 0u;
    var last = sky.height - 1u;
    while row < last {
        let middle = (row + last) / 2u;
        if sky_row_end(middle) <= u.x {
            row = middle + 1u;
        } else {
            last = middle;
        }
    }
    var column = 0u;
    last = sky.width - 1u;
    while column < last {
        let middle = (column + last) / 2u;
        if sky_column_end(middle, row) <= u.y {
            column = middle + 1u;
        } else {
            last = middle;
        }
    }
    var row_before = 0.0;
    if row > 0u {
        row_before = sky_row_end(row - 1u);
    }
    var column_before = 0.0;
    if column > 0u {
        column_before = sky_column_end(column - 1u, row);
    }
    let within_row = sky_within(u.x, row_before, sky_row_end(row));
    let within_column = sky_within(u.y, column_before, sky_column_end(column, row));
    let is_upper = 2u * row < sky.height;
    let from_pole = f32(select(sky.height - 1u - row, row, is_upper));
    let first_sin = sin(from_pole * 0.5 * PI / f32(sky.height));
    let last_sin = sin((from_pole + 1.0) * 0.5 * PI / f32(sky.height));
    let first = first_sin * first_sin;
    let half = first + (last_sin * last_sin - first) * within_row;
    let y = select(2.0 * half - 1.0, 1.0 - 2.0 * half, is_upper);
    let radius = 2.0 * sqrt(max(half * (1.0 - half), 0.0));
    let around = (f32(column) + within_column) / f32(sky.width);
    let angle = 2.0 * PI * (around - 0.5 - sky.turn);
    return vec3f(radius * sin(angle), y, -radius * cos(angle));
}

// Where a number lies between two shares, from 0 to 1.
fn sky_within(u: f32, low: f32, high: f32) -> f32 {
    if high > low {
        return clamp((u - low) / (high - low), 0.0, 1.0);
    }
    return 0.5;
}

// A direction above a surface, half of them drawn by importance, half by the cosine.
fn sky_sample_above(normal: vec3f, u: vec2f) -> SkySample {
    var wi = vec3f(0.0);
    if u.x < 0.5 {
        wi = sky_sample(vec2f(2.0 * u.x, u.y));
        if dot(normal, wi) < 0.0 {
            wi = sky_mirrored(normal, wi);
        }
    } else {
        let v = 2.0 * u.x - 1.0;
        let radius = sqrt(v);
        let angle = 2.0 * PI * u.y;
        let tangents = basis_tangents(normal);
        wi = tangents[0] * (radius * cos(angle)) + tangents[1] * (radius * sin(angle)) + normal * sqrt(max(1.0 - v, 0.0));
    }
    let relative = sky_relative(wi);
    let importance = sky_importance(relative) + sky_importance(sky_relative(sky_mirrored(normal, wi)));
    let pdf_solid_angle = importance / (8.0 * PI) + max(dot(normal, wi), 0.0) / (2.0 * PI);
    if pdf_solid_angle > 0.0 {
        return SkySample(wi, relative / pdf_solid_angle);
    }
    return SkySample(wi, vec3f(0.0));
}

// `wi` mirrored in a surface.
fn sky_mirrored(normal: vec3f, wi: vec3f) -> vec3f {
    return normalize(wi - normal * (2.0 * dot(normal, wi)));
}
