//! Turns a scene file into the figures of `photonstream bench`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

fn main() {
    let path = std::env::args().nth(1).unwrap();
    let scene = photonstream_scene::Scene::load(std::path::Path::new(&path)).unwrap();
    let report =
        photonstream_simulator::bench::run(std::sync::Arc::new(scene), &Default::default(), &mut |_| {})
            .unwrap();
    println!("{report}");
}
