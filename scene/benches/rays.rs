//! Turns photon walks through three scenes into rays per second of this crate's structure against obvhs's CWBVH.
//!
//! Path i: isotropic emission at 75 % of the bounding box's height, survival 0.6 per hit, cosine-weighted bounce, PCG
//! stream seeded by i: the same rays for every tracer. Rounds alternate between the tracers, the best round counts.
//! `PHOTONSTREAM_SCENES` names the folder with `dabrovic_sponza/sponza.obj` and `stanford_dragon/dragon_vrip_res2.ply`, which
//! stands in a closed room as in `configs/dragon.toml`; without it only the box is walked.
//! `PHOTONSTREAM_SOUP=DIR` also writes each scene as a triangle soup (u32 count, 9 f32 per triangle) for other tracers.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::single_range_in_vec_init, missing_docs)]

use glam::{Vec3, Vec3A, vec3};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use photonstream_scene::bvh::{Ray, SceneBvh};
use std::path::Path;
use std::time::{Duration, Instant};

const ROUNDS: usize = 7;

fn main() {
    let (vertices, triangles) = cornell_like_box();
    compare("cornell-like box", &vertices, &triangles, 300_000);
    for (name, file, load) in [
        ("dabrovic sponza", "dabrovic_sponza/sponza.obj", load as fn(&Path) -> Mesh),
        ("stanford dragon", "stanford_dragon/dragon_vrip_res2.ply", dragon_in_a_room),
    ] {
        let path = std::env::var_os("PHOTONSTREAM_SCENES").map(|folder| Path::new(&folder).join(file));
        match path.filter(|path| path.exists()) {
            Some(path) => {
                let (vertices, triangles) = load(&path);
                compare(name, &vertices, &triangles, 150_000);
            }
            None => println!("SKIP {name}: set PHOTONSTREAM_SCENES to the folder that holds {file}"),
        }
    }
}

fn compare(name: &str, vertices: &[Vec3], triangles: &[[u32; 3]], paths: u64) {
    let soup: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
    if let Some(folder) = std::env::var_os("PHOTONSTREAM_SOUP") {
        let mut bytes = (soup.len() as u32).to_le_bytes().to_vec();
        for coordinate in soup.iter().flatten().flat_map(Vec3::to_array) {
            bytes.extend(coordinate.to_le_bytes());
        }
        std::fs::write(Path::new(&folder).join(format!("{name}.bin")), bytes).unwrap();
    }
    let walk = Walk::new(&soup);

    let clock = Instant::now();
    let ours = SceneBvh::build(vertices, triangles, &[0..triangles.len() as u32]);
    let build = clock.elapsed();
    let cwbvh = Cwbvh::new(&soup);

    let (mut best_ours, mut best_cwbvh) = (f64::INFINITY, f64::INFINITY);
    let (mut rays_ours, mut rays_cwbvh) = (0, 0);
    for _ in 0..ROUNDS {
        let clock = Instant::now();
        rays_ours = walk.run(paths, |origin, direction| {
            let hit = ours.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
            Some((hit.t, hit.triangle))
        });
        best_ours = best_ours.min(clock.elapsed().as_secs_f64());
        let clock = Instant::now();
        rays_cwbvh = walk.run(paths, |origin, direction| cwbvh.closest(origin, direction));
        best_cwbvh = best_cwbvh.min(clock.elapsed().as_secs_f64());
    }
    let (ours_rate, cwbvh_rate) =
        (rays_ours as f64 / best_ours * 1e-6, rays_cwbvh as f64 / best_cwbvh * 1e-6);
    println!(
        "{name}: {} triangles, built in {:.0} ms; {} {ours_rate:.2} M rays/s ({rays_ours} rays), \
         CWBVH {cwbvh_rate:.2} M rays/s ({rays_cwbvh} rays), ratio {:.2}",
        triangles.len(),
        build.as_secs_f64() * 1e3,
        ours.instruction_set(),
        ours_rate / cwbvh_rate,
    );
}

/// obvhs's compressed wide tree with its fastest triangle test, triangles in leaf order.
struct Cwbvh {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Cwbvh {
    fn new(soup: &[[Vec3; 3]]) -> Self {
        let triangles: Vec<Triangle> =
            soup.iter().map(|t| t.map(Vec3A::from)).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
        let tree =
            build_cwbvh_from_tris(&triangles, BvhBuildParams::very_slow_build(), &mut Duration::default());
        let triangles =
            tree.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        Self { tree, triangles }
    }

    fn closest(&self, origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let mut hit = RayHit::none();
        let ray = obvhs::ray::Ray::new_inf(origin.into(), direction.into());
        self.tree
            .ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray))
            .then(|| (hit.t, self.tree.primitive_indices[hit.primitive_id as usize]))
    }
}

struct Walk {
    normals: Vec<Vec3>,
    light: Vec3,
    offset: f32,
}

impl Walk {
    fn new(soup: &[[Vec3; 3]]) -> Self {
        let points = || soup.iter().flatten().copied();
        let lo = points().fold(Vec3::INFINITY, Vec3::min);
        let size = points().fold(Vec3::NEG_INFINITY, Vec3::max) - lo;
        Self {
            normals: soup.iter().map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero()).collect(),
            light: lo + size * vec3(0.5, 0.75, 0.5),
            offset: size.length() * 1e-5,
        }
    }

    /// Rays traced; `closest` returns distance and triangle.
    #[inline(always)]
    fn run(&self, paths: u64, closest: impl Fn(Vec3, Vec3) -> Option<(f32, u32)>) -> u64 {
        let mut rays = 0;
        for path in 0..paths {
            let mut rng = Pcg::new(path);
            let (u, v) = (rng.unit(), rng.unit());
            let (mut origin, mut direction) = (self.light, sphere(u, v));
            for _ in 0..64 {
                rays += 1;
                let Some((t, triangle)) = closest(origin, direction) else { break };
                let mut normal = self.normals[triangle as usize];
                if normal.dot(direction) > 0.0 {
                    normal = -normal;
                }
                if rng.unit() >= 0.6 {
                    break;
                }
                origin = origin + direction * t + normal * self.offset;
                let (u, v) = (rng.unit(), rng.unit());
                direction = cosine(normal, u, v);
            }
        }
        rays
    }
}

struct Pcg(u64);

impl Pcg {
    fn new(seed: u64) -> Self {
        let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Self((z ^ (z >> 31)) | 1)
    }

    fn unit(&mut self) -> f32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let bits = ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32);
        (bits >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

fn sphere(u: f32, v: f32) -> Vec3 {
    let z = 1.0 - 2.0 * u;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    vec3(r * cos, r * sin, z)
}

fn cosine(n: Vec3, u: f32, v: f32) -> Vec3 {
    let r = u.sqrt();
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    let (t, b) = n.any_orthonormal_pair();
    t * (r * cos) + b * (r * sin) + n * (1.0 - u).max(0.0).sqrt()
}

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

/// A closed room of 8 × 8 quads a wall, a block and a finely tessellated sphere: about 5 000 triangles.
fn cornell_like_box() -> Mesh {
    let mut mesh = (Vec::new(), Vec::new());
    block(&mut mesh, vec3(0.0, 0.0, 0.0), vec3(5.5, 5.5, 5.5), 8);
    block(&mut mesh, vec3(1.0, 0.0, 2.5), vec3(1.6, 3.2, 1.6), 3);
    let (rings, sectors) = (40u32, 50u32);
    let base = mesh.0.len() as u32;
    for ring in 0..=rings {
        for sector in 0..sectors {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * sector as f32 / sectors as f32;
            let unit = vec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.0.push(vec3(3.8, 1.0, 1.6) + unit);
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let at = |r: u32, s: u32| base + r * sectors + s % sectors;
            quad(
                &mut mesh.1,
                [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector + 1), at(ring + 1, sector)],
            );
        }
    }
    mesh
}

fn quad(triangles: &mut Vec<[u32; 3]>, [a, b, c, d]: [u32; 4]) {
    triangles.extend([[a, b, c], [a, c, d]]);
}

fn block(mesh: &mut Mesh, lo: Vec3, size: Vec3, cells: u32) {
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let base = mesh.0.len() as u32;
            for i in 0..=cells {
                for j in 0..=cells {
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = i as f32 / cells as f32;
                    p[(axis + 2) % 3] = j as f32 / cells as f32;
                    mesh.0.push(lo + p * size);
                }
            }
            for i in 0..cells {
                for j in 0..cells {
                    let at = |i: u32, j: u32| base + i * (cells + 1) + j;
                    quad(&mut mesh.1, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
}

fn load(path: &Path) -> Mesh {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let mut mesh = (Vec::new(), Vec::new());
    for model in models {
        let base = mesh.0.len() as u32;
        mesh.0.extend(model.mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        mesh.1.extend(model.mesh.indices.chunks_exact(3).map(|t| [t[0] + base, t[1] + base, t[2] + base]));
    }
    mesh
}

/// The scan as text, 7.3 times its size on the floor of a room of 2 m, 8 × 8 quads a wall.
fn dragon_in_a_room(path: &Path) -> Mesh {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let mut counts = Vec::new();
    for line in lines.by_ref().take_while(|line| *line != "end_header") {
        if let Some(element) = line.strip_prefix("element ") {
            counts.push(element.split(' ').nth(1).unwrap().parse::<usize>().unwrap());
        }
    }
    let mut mesh: Mesh = (Vec::new(), Vec::new());
    for line in lines.by_ref().take(counts[0]) {
        let p: Vec<f32> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        mesh.0.push(vec3(p[0], p[1], p[2]) * 7.3 + vec3(0.04, -0.385, 0.0));
    }
    for line in lines.take(counts[1]) {
        let t: Vec<u32> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        mesh.1.push([t[1], t[2], t[3]]);
    }
    block(&mut mesh, vec3(-1.0, 0.0, -1.0), vec3(2.0, 2.0, 2.0), 8);
    mesh
}
