// Turns coordinates and texels beyond the edges of a texture into those that stand for them: twin of wrap.rs.

fn wrap_wrapped(u: f32, wrap: u32) -> f32 {
    if wrap == TEXTURE_REPEAT {
        return u - floor(u);
    }
    if wrap == TEXTURE_MIRROR {
        return 1.0 - abs(u - floor(u * 0.5) * 2.0 - 1.0);
    }
    return clamp(u, 0.0, 1.0);
}

fn wrap_neighbour(index: i32, count: i32, wrap: u32) -> u32 {
    if wrap == TEXTURE_REPEAT {
        if index < 0 {
            return u32(count - 1);
        }
        if index >= count {
            return 0u;
        }
    }
    return u32(clamp(index, 0, count - 1));
}
