//! Gathers the camera samples of one tile, one array per component, so that pixels fill SIMD lanes.

use crate::surface::Surface;
use glam::Vec3;

/// Edge of a tile in pixels.
pub(crate) const TILE_EDGE: u32 = 32;

/// Samples in a tile: a multiple of every lane count.
pub(crate) const TILE_SAMPLES: usize = (TILE_EDGE * TILE_EDGE) as usize;

/// A vector for each sample of a tile.
#[derive(Clone, Debug)]
pub(crate) struct Vectors {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
}

impl Vectors {
    pub(crate) fn zero() -> Self {
        let zeros = || vec![0.0; TILE_SAMPLES];
        Self { x: zeros(), y: zeros(), z: zeros() }
    }

    pub(crate) fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    pub(crate) fn set(&mut self, i: usize, v: Vec3) {
        (self.x[i], self.y[i], self.z[i]) = (v.x, v.y, v.z);
    }

    pub(crate) fn clear(&mut self) {
        for component in [&mut self.x, &mut self.y, &mut self.z] {
            component.fill(0.0);
        }
    }
}

/// The surfaces seen through the samples of one tile.
pub(crate) struct Tile {
    /// What each sample sees; `None` where nothing was hit and beyond the picture's edge.
    pub(crate) surfaces: Vec<Option<Surface>>,
    /// Positions of samples that can receive light, others at `lo`.
    pub(crate) position: Vectors,
    /// Their normals; zero for samples that receive nothing.
    pub(crate) normal: Vectors,
    /// Irradiance from virtual surface lights, in W m⁻².
    pub(crate) irradiance: Vectors,
    /// Lower corner of the receiving positions.
    pub(crate) lo: Vec3,
    /// Upper corner of the receiving positions.
    pub(crate) hi: Vec3,
    /// Number of samples that can receive light.
    pub(crate) receivers: usize,
    /// Samples in use: up to the last one inside the picture, rounded up to whole lanes.
    pub(crate) used: usize,
}

impl Tile {
    pub(crate) fn new() -> Self {
        Self {
            surfaces: vec![None; TILE_SAMPLES],
            position: Vectors::zero(),
            normal: Vectors::zero(),
            irradiance: Vectors::zero(),
            lo: Vec3::ZERO,
            hi: Vec3::ZERO,
            receivers: 0,
            used: 0,
        }
    }

    /// Takes `surfaces` of `count` samples from `see` and prepares them to receive light.
    pub(crate) fn fill(&mut self, count: usize, mut see: impl FnMut(usize) -> Option<Surface>) {
        self.used = count.next_multiple_of(MAX_LANES);
        (self.lo, self.hi, self.receivers) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0);
        for i in 0..self.used {
            let surface = if i < count { see(i) } else { None };
            if let Some(s) = surface.filter(|s| s.albedo != Vec3::ZERO) {
                self.lo = self.lo.min(s.position);
                self.hi = self.hi.max(s.position);
                self.receivers += 1;
            }
            self.surfaces[i] = surface;
        }
        for i in 0..self.used {
            match self.surfaces[i].filter(|s| s.albedo != Vec3::ZERO) {
                Some(s) => {
                    self.position.set(i, s.position);
                    self.normal.set(i, s.normal);
                }
                None => {
                    self.position.set(i, if self.receivers > 0 { self.lo } else { Vec3::ZERO });
                    self.normal.set(i, Vec3::ZERO);
                }
            }
        }
        self.irradiance.clear();
    }
}

/// Lanes of the widest instruction set.
pub(crate) const MAX_LANES: usize = 16;

#[cfg(test)]
pub(crate) mod random {
    use super::*;
    use photonstream_shading::{sampling, sobol::Sequence};

    /// As many places in the unit ball with unit normals as a tile has samples.
    pub(crate) fn points(seed: u64) -> Vec<(Vec3, Vec3)> {
        let point = |i: u64| {
            let mut s = Sequence::new(seed, 0).sample(i);
            (sampling::sphere(s.next_2d()) * s.next_1d(), sampling::sphere(s.next_2d()).normalize())
        };
        (0..TILE_SAMPLES as u64).map(point).collect()
    }

    /// A tile whose first `count` samples see white surfaces at the points, but for every tenth from the seventh on, which see nothing.
    pub(crate) fn tile(points: &[(Vec3, Vec3)], count: usize) -> Tile {
        let mut tile = Tile::new();
        tile.fill(count, |i| {
            let (position, normal) = points[i];
            let (albedo, emitted) = (Vec3::ONE, Vec3::ZERO);
            let surface = Surface {
                position,
                ray_origin: position,
                normal,
                flat: normal,
                albedo,
                emitted,
                object: 0,
                distance: 1.0,
            };
            is_there(i).then_some(surface)
        });
        tile
    }

    /// Whether sample `i` of such a tile sees anything.
    pub(crate) fn is_there(i: usize) -> bool {
        i % 10 != 7
    }
}
