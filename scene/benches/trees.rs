//! Turns scenes into the time that their trees take to be built, by one thread and by as many as there are processors.
//!
//! Sponza (`configs/sponza.toml`, where its model is found) and 2 000 balls of 40 to 520 triangles;
//! each time is the best of 5, the two kinds taking turns.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use glam::Vec3;
use photonstream_scene::{Scene, bvh::SceneBvh};
use std::{hint::black_box, ops::Range, path::Path, time::Instant};

const ROUNDS: usize = 5;
const OBJECTS: u32 = 2_000;

fn main() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let [one, all] = [1, threads].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    println!("scene            parts  triangles  1 thread, ms  {threads} threads, ms  ratio");
    let compare = |name: &str, vertices: &[Vec3], triangles: &[[u32; 3]], parts: &[Range<u32>]| {
        let mut best = [f64::INFINITY; 2];
        for _ in 0..ROUNDS {
            for (pool, best) in [&one, &all].into_iter().zip(&mut best) {
                let clock = Instant::now();
                pool.install(|| black_box(SceneBvh::build(vertices, triangles, parts)));
                *best = best.min(clock.elapsed().as_secs_f64() * 1e3);
            }
        }
        let [one, all] = best;
        println!(
            "{name:15} {:6} {:10} {one:13.1} {all:14.1} {:6.2}",
            parts.len(),
            triangles.len(),
            one / all
        );
    };
    match Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/sponza.toml")) {
        Ok(scene) => {
            let parts: Vec<_> = scene.objects.iter().map(|object| object.triangles.clone()).collect();
            compare("sponza", &scene.geometry.vertices, &scene.geometry.triangles, &parts);
        }
        Err(error) => println!("SKIP sponza: {error}"),
    }
    let (vertices, triangles, parts) = balls();
    compare("balls", &vertices, &triangles, &parts);
}

/// Balls on a square grid, of 2 to 26 bands of 20 triangles.
fn balls() -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<Range<u32>>) {
    let (mut vertices, mut triangles, mut parts) = (Vec::new(), Vec::<[u32; 3]>::new(), Vec::new());
    for object in 0..OBJECTS {
        let (bands, first) = (2 + object % 25, triangles.len() as u32);
        let centre = Vec3::new((object % 45) as f32, 0.0, (object / 45) as f32);
        let base = vertices.len() as u32;
        for band in 0..=bands {
            for step in 0..10 {
                let (theta, phi) = (band as f32 / bands as f32 * 3.0 + 0.05, step as f32 * 0.628_318_5);
                let ring = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                vertices.push(centre + ring * 0.4);
            }
        }
        for band in 0..bands {
            for step in 0..10 {
                let [a, b] = [band * 10 + step, band * 10 + (step + 1) % 10].map(|i| base + i);
                triangles.extend([[a, b, a + 10], [b, b + 10, a + 10]]);
            }
        }
        parts.push(first..triangles.len() as u32);
    }
    (vertices, triangles, parts)
}
