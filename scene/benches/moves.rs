//! Turns motions of an object of 100 000 triangles into the time that its tree takes to follow, and the speed of rays
//! through it, against a tree built anew.
//!
//! The knot of `configs/cornell-knot.toml`, turned by 10 to 180 degrees; each time is the best of 7, rays are 300 000
//! from around the room towards it.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use glam::{DQuat, DVec3, Vec3};
use photonstream_scene::{
    Scene,
    bvh::{Ray, SceneBvh},
};
use std::{
    hint::black_box,
    path::Path,
    time::{Duration, Instant},
};

const ROUNDS: usize = 7;
const RAYS: u32 = 300_000;

fn main() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-knot.toml");
    let scene = Scene::load(&config).unwrap();
    let id = scene.object("knot").unwrap();
    let range = scene.objects[id.0 as usize].triangles.clone();
    let ranges: Vec<_> = scene.objects.iter().map(|object| object.triangles.clone()).collect();
    println!("knot of {} triangles: times in ms, rays in millions per second", range.len());
    println!("degrees  build  refit  ratio  whole edit  rays (built)  rays (refitted)");
    for degrees in [10.0f64, 45.0, 90.0, 180.0] {
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), degrees.to_radians());
        let home = scene.objects[id.0 as usize].world_from_rest;
        let mut motion = home;
        motion.matrix3 = glam::DMat3::from_quat(turn) * home.matrix3;
        let moved = scene.with_object_placed(id, motion).unwrap();
        let (vertices, triangles) = (&moved.geometry.vertices, &moved.geometry.triangles);
        let build = best(|| {
            black_box(SceneBvh::build(vertices, triangles, std::slice::from_ref(&range)));
        });
        let mut bvh = scene.bvh.clone();
        let refit = best(|| bvh.rebuild_part(id.0 as usize, vertices, triangles));
        let edit = best(|| {
            black_box(scene.with_object_placed(id, motion).unwrap());
        });
        let anew = SceneBvh::build(vertices, triangles, &ranges);
        println!(
            "{degrees:7} {build:6.2} {refit:6.2} {:6.1} {edit:11.2} {:13.2} {:16.2}",
            build / refit,
            rays(&anew),
            rays(&bvh)
        );
    }
}

/// The shortest of several times, ms.
fn best(mut work: impl FnMut()) -> f64 {
    let times = (0..ROUNDS).map(|_| {
        let clock = Instant::now();
        work();
        clock.elapsed()
    });
    times.min().unwrap_or(Duration::ZERO).as_secs_f64() * 1e3
}

/// Millions of rays a second, from points of a sphere of 0.9 m around the origin towards points of one of 0.5 m.
fn rays(bvh: &SceneBvh) -> f64 {
    let mut state = 1u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / 8_388_608.0 - 1.0
    };
    let mut sphere = |radius: f32| Vec3::new(unit(), unit(), unit()).normalize_or(Vec3::X) * radius;
    let rays: Vec<Ray> = (0..RAYS)
        .map(|_| {
            let origin = sphere(0.9);
            Ray { origin, direction: sphere(0.5) - origin, t_max: f32::INFINITY }
        })
        .collect();
    let time = best(|| {
        black_box(rays.iter().filter(|ray| bvh.closest(ray).is_some()).count());
    });
    f64::from(RAYS) / time / 1e3
}
