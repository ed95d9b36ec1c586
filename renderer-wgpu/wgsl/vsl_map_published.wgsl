// Turns the index of a virtual surface light into the place of its published distance map.

fn vsl_map_of(index: u32) -> u32 {
    // Two texels a word.
    return index * (frame.map_edge * frame.map_edge / 2u);
}
