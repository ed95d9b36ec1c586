//! Turns rays into the claim that the device answers each as the CPU's structure does.

use super::*;
use crate::pipelines::{computing, groups_of_64};

const ANSWERS: shader::Source = shader::Source {
    name: "rays_answers",
    parts: &[
        include_str!("../../../wgsl/rays_triangle.wgsl"),
        include_str!("../../../wgsl/rays_solid.wgsl"),
        include_str!("../../../wgsl/rays_walk.wgsl"),
        include_str!("../../../wgsl/rays_answers.wgsl"),
    ],
};

const ANSWERS_HOLES: shader::Source = shader::Source {
    name: "rays_answers",
    parts: &[
        photonstream_shading::wgsl::WRAP,
        include_str!("../../../wgsl/rays_triangle.wgsl"),
        include_str!("../../../wgsl/rays_holes.wgsl"),
        include_str!("../../../wgsl/rays_walk.wgsl"),
        include_str!("../../../wgsl/rays_answers.wgsl"),
    ],
};

/// Answers of the device, and the seconds that it took after a first round.
pub(super) fn device(gpu: &Gpu, scene: &Scene, queries: &[Ray], timed: bool) -> (Vec<bool>, f64) {
    let rays = rays_of(gpu, scene);
    let words: Vec<[f32; 8]> = queries
        .iter()
        .map(|r| {
            let (o, d) = (r.origin, r.direction);
            [o.x, o.y, o.z, r.t_max.min(f32::MAX), d.x, d.y, d.z, 0.0]
        })
        .collect();
    let [lo, hi] = rays.bounds;
    let bounds = upload(gpu, "bounds", bytemuck::cast_slice(&[lo.extend(0.0), hi.extend(0.0)]));
    let words = upload(gpu, "queries", bytemuck::cast_slice(&words));
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
    let answers = buffer(gpu, "answers", queries.len() as u64 * 4, usage);
    let source = if rays.holes.is_some() { &ANSWERS_HOLES } else { &ANSWERS };
    let pipeline = computing(gpu, source, "answer");
    let holes = rays.holes.as_ref().map(|holes| (6, holes.words.as_entire_binding()));
    let groups = [
        bind(
            gpu,
            &pipeline.get_bind_group_layout(0),
            (0..).zip([words.as_entire_binding(), answers.as_entire_binding(), bounds.as_entire_binding()]),
        ),
        bind(
            gpu,
            &pipeline.get_bind_group_layout(1),
            (1..).zip([rays.nodes.as_entire_binding(), rays.triangles.as_entire_binding()]).chain(holes),
        ),
    ];
    let run = || {
        let start = std::time::Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            for (index, group) in groups.iter().enumerate() {
                pass.set_bind_group(index as u32, group, &[]);
            }
            let (x, y) = groups_of_64(queries.len() as u32);
            pass.dispatch_workgroups(x, y, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.wait().unwrap();
        start.elapsed().as_secs_f64()
    };
    let mut seconds = run();
    if timed {
        seconds = (0..5).map(|_| run()).fold(f64::INFINITY, f64::min);
    }
    let answers = readback::buffer::<u32>(gpu, &answers).unwrap();
    assert!(answers.iter().all(|&a| a < 2), "no ray is suspended here");
    (answers.into_iter().map(|a| a == 1).collect(), seconds)
}

/// Segments between points just off the scene's surfaces, by area; a run of `run` of them ends at the same point.
pub(super) fn segments(scene: &Scene, count: u32, run: u32) -> Vec<Ray> {
    let targets = scattered_vsls(scene, 4_096);
    let (lo, hi) = scene.bvh.bounds();
    let offset = lo.abs().max(hi.abs()).max_element() * surface::RELATIVE_OFFSET;
    let place = |i: usize| targets.position()[i] + targets.normal()[i] * offset;
    let sequence = Sequence::new(5, 0);
    (0..count)
        .map(|i| {
            let choose = |u: f32| (u * targets.len() as f32) as usize % targets.len();
            let from = choose(sequence.sample(u64::from(i)).next_1d());
            let to = choose(Sequence::new(6, 0).sample(u64::from(i / run)).next_1d());
            Ray { origin: place(from), direction: place(to) - place(from), t_max: SHADOW_REACH }
        })
        .collect()
}

fn compare(gpu: &Gpu, scene: &Scene, queries: &[Ray], name: &str) {
    let (found, _) = device(gpu, scene, queries, false);
    let differing: Vec<_> =
        queries.iter().zip(&found).filter(|(r, f)| scene.bvh.occluded(r) != **f).collect();
    assert!(
        differing.is_empty(),
        "{name}: {} of {}: {:?}",
        differing.len(),
        queries.len(),
        differing.first()
    );
    let hits = found.iter().filter(|hit| **hit).count();
    assert!(hits > 0 && hits < queries.len(), "{name}: {hits} hits say nothing");
}

/// N = 3 × 65 536 shadow rays: not one answer differs.
#[test]
fn shadow_rays_get_the_answers_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for name in ["cornell-box.toml", "cornell-knot.toml", "two-rooms.toml"] {
        let scene = config(name);
        compare(&gpu, &scene, &segments(&scene, 1 << 16, 1), name);
    }
}

/// Rays at vertices and at middles of edges, from outside and from far away, along axes too: nothing leaks between
/// triangles, and nothing is hit beside them. N = 4 rays for each of 6 000 corners and edges or so.
#[test]
fn rays_at_corners_and_edges_get_the_answers_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let geometry = &scene.geometry;
    let mut queries = Vec::new();
    for triangle in 0..geometry.triangles.len() as u32 {
        let [a, b, _] = geometry.triangle(triangle);
        let normal = geometry.normals[triangle as usize];
        for target in [a, (a + b) * 0.5] {
            for origin in [target + normal, Vec3::new(target.x, target.y, 40.0), scene.camera.position] {
                queries.push(Ray { origin, direction: target - origin, t_max: f32::INFINITY });
            }
            queries.push(Ray { origin: target + normal, direction: -normal, t_max: 0.5 });
        }
    }
    compare(&gpu, &scene, &queries, "corners and edges");
}

/// The scene far from its origin and tiny: the paddings scale with it. N = 3 × 65 536.
#[test]
fn other_scales_and_places_get_the_answers_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for (scale, shift) in [(1e-4, 0.0), (1e4, 0.0), (1.0, 300.0)] {
        let mut scene = config("cornell-box.toml");
        let mut geometry = (*scene.geometry).clone();
        for v in &mut geometry.vertices {
            *v = *v * scale + Vec3::splat(shift);
        }
        let all = 0..geometry.triangles.len() as u32;
        scene.bvh = photonstream_scene::bvh::SceneBvh::build(&geometry.vertices, &geometry.triangles, &[all]);
        scene.geometry = Arc::new(geometry);
        compare(&gpu, &scene, &segments(&scene, 1 << 16, 1), &format!("{scale}, {shift}"));
    }
}

/// A pile of equal triangles, a single triangle, none at all: the tree stays within the stack.
#[test]
fn odd_sets_of_triangles_make_sound_trees() {
    for copies in [0usize, 1, 2, 3, 1_000, 20_000] {
        let mut geometry = Geometry { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y], ..Geometry::default() };
        geometry.triangles = vec![[0, 1, 2]; copies].into();
        let tree = Tree::new(&geometry);
        assert!(tree.depth <= RAY_STACK, "{copies}: {}", tree.depth);
        assert_eq!(tree.triangles.len(), copies.max(1), "one that is nowhere stands for none");
        let leaves: u32 = tree
            .nodes
            .iter()
            .map(|n| {
                (0..8)
                    .filter(|c| n.imask >> c & 1 == 0)
                    .map(|c| (n.child_meta[c] >> 5).count_ones())
                    .sum::<u32>()
            })
            .sum();
        assert_eq!(leaves as usize, copies);
    }
}

/// Nodes and triangles beyond a binding, and a tree deeper than the stack: named, with the limit. Limits are asked of the
/// device, 128 MiB on the software rasteriser.
#[test]
fn what_is_too_large_is_named() {
    let Some(gpu) = gpu() else { return };
    let limits = gpu.device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if limit > 1 << 30 {
        crate::test_gpu::skip("one binding of it takes more than this test wants to allocate");
        return;
    }
    let sound = || Tree::new(&Geometry::default());
    assert!(check_size(&gpu, &sound()).is_ok());
    let mut nodes = sound();
    nodes.nodes.resize(limit as usize / 80 + 1, Default::default());
    let mut triangles = sound();
    triangles.triangles.resize(limit as usize / 48 + 1, [[0.0; 4]; 3]);
    let deep = Tree { depth: RAY_STACK + 1, ..sound() };
    for (tree, named) in [(nodes, "nodes"), (triangles, "triangles"), (deep, "levels")] {
        let error = check_size(&gpu, &tree).unwrap_err();
        assert!(
            matches!(&error, GpuError::TooLarge { what, found, limit, .. } if what.contains(named) && found > limit),
            "{error}"
        );
    }
}

/// `cargo test --release -p photonstream-renderer-wgpu --lib -- --ignored --nocapture rays_per_second`
#[test]
#[ignore = "measures"]
fn rays_per_second() {
    let Some(gpu) = gpu() else { return };
    for name in ["cornell-box.toml", "cornell-knot.toml"] {
        let scene = config(name);
        let start = std::time::Instant::now();
        let tree = Tree::new(&scene.geometry);
        println!("{name}: {} levels, built in {:.0} ms", tree.depth, start.elapsed().as_secs_f64() * 1e3);
        for run in [1, 4_096] {
            let queries = segments(&scene, 1 << 20, run);
            let (found, seconds) = device(&gpu, &scene, &queries, true);
            let start = std::time::Instant::now();
            let differing = queries.iter().zip(&found).filter(|(r, f)| scene.bvh.occluded(r) != **f).count();
            let cpu = start.elapsed().as_secs_f64();
            let rate = |s: f64| queries.len() as f64 / s * 1e-6;
            println!(
                "{name}, {} triangles, runs of {run} to one light: {} {:.2} M rays/s, CPU (one thread) {:.2}; {differing} differ",
                scene.geometry.triangles.len(),
                gpu.name(),
                rate(seconds),
                rate(cpu),
            );
        }
    }
}
