// Turns what is packed into the corner of a triangle into its shading normal.

// The shading normal of a corner, unit, or zero where the triangle is flat.
fn corner_bent(bent: u32) -> vec3f {
    return select(octahedral_decode(unpack2x16snorm(bent)), vec3f(0.0), bent == NO_BEND);
}
