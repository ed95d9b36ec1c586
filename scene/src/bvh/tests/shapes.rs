//! Turns seeds and sizes into meshes and rays for the tests.

use std::ops::Range;

use glam::{Vec3, vec3};

use crate::bvh::SceneBvh;
use crate::bvh::dispatch::all;

pub(in crate::bvh) type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

/// SplitMix64.
pub(in crate::bvh) struct Random(pub(in crate::bvh) u64);

impl Random {
    pub(in crate::bvh) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub(in crate::bvh) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    pub(in crate::bvh) fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    /// In the cube [−1, 1)³.
    pub(in crate::bvh) fn in_cube(&mut self) -> Vec3 {
        vec3(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// `count` triangles of up to `size` scattered in the cube [−1, 1]³; every eighth repeats an earlier one.
pub(in crate::bvh) fn soup(random: &mut Random, count: usize, size: f32) -> Mesh {
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for i in 0..count {
        if i % 8 == 7 {
            triangles.push(triangles[random.below(i)]);
            continue;
        }
        let base = vertices.len() as u32;
        let centre = random.in_cube();
        vertices.extend([0; 3].map(|_| centre + random.in_cube() * size));
        triangles.push([base, base + 1, base + 2]);
    }
    (vertices, triangles)
}

/// The surface of [−1, 1]³, `cells`² quads a side, outer vertices shared by position.
pub(in crate::bvh) fn cube(cells: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let base = mesh.0.len() as u32;
            for i in 0..=cells {
                for j in 0..=cells {
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = 2.0 * i as f32 / cells as f32 - 1.0;
                    p[(axis + 2) % 3] = 2.0 * j as f32 / cells as f32 - 1.0;
                    mesh.0.push(p);
                }
            }
            for i in 0..cells {
                for j in 0..cells {
                    let at = |i: u32, j: u32| base + i * (cells + 1) + j;
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    mesh.1.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    mesh
}

/// The unit sphere in `rings` × `sectors` quads; the poles' zero-area triangles included.
pub(in crate::bvh) fn sphere(rings: u32, sectors: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for ring in 0..=rings {
        // Exactly one position at each pole.
        let (sin, cos) = match ring {
            0 => (0.0, 1.0),
            ring if ring == rings => (0.0, -1.0),
            ring => (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos(),
        };
        for sector in 0..sectors {
            let (y, x) = (std::f32::consts::TAU * sector as f32 / sectors as f32).sin_cos();
            mesh.0.push(vec3(sin * x, sin * y, cos));
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let at = |r: u32, s: u32| r * sectors + s % sectors;
            let (a, b) = (at(ring, sector), at(ring, sector + 1));
            let (c, d) = (at(ring + 1, sector + 1), at(ring + 1, sector));
            mesh.1.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

pub(in crate::bvh) fn moved((vertices, triangles): &Mesh, scale: f32, offset: Vec3) -> Mesh {
    (vertices.iter().map(|v| *v * scale + offset).collect(), triangles.clone())
}

pub(in crate::bvh) fn everything(mesh: &Mesh) -> [Range<u32>; 1] {
    [0..mesh.1.len() as u32]
}

pub(in crate::bvh) fn build(mesh: &Mesh) -> SceneBvh {
    let scene = SceneBvh::build(&mesh.0, &mesh.1, &everything(mesh));
    scene.validate().unwrap();
    scene
}

/// The same structure walked with every instruction set of this machine.
pub(in crate::bvh) fn on_every_path(scene: &SceneBvh) -> Vec<SceneBvh> {
    all().into_iter().map(|instructions| SceneBvh { instructions, ..scene.clone() }).collect()
}
