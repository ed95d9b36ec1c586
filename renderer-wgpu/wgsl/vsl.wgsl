// Gathers a virtual surface light as the gathering passes read it.

struct Vsl {
    position: vec3f,
    range_sq: f32,           // beyond this squared distance it is skipped, m²: its range, or the one it has drawn
    normal: vec3f,
    area_term: f32,          // what the kernel adds to π r², m²; less than 0: minus the area of its polygon
    flux: vec3f,             // W
    object: u32,
}

// What is said of a block of lights.
struct BatchNumbers {
    first: u32,              // index of its first light
    is_last: u32,
    lights: u32,             // number of its lights
    words: u32,              // words of a list that have any of them
}
