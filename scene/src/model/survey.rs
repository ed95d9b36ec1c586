//! Turns the surfaces of a scene into what rays from all over them meet: backs, and openings.

use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;
use photonstream_shading::{
    sampling,
    sobol::{Sample, Sequence},
    surface,
};

/// Points on surfaces, spread by area.
const POINTS: u64 = 2048;
/// Rays from each side of a point, by the cosine to its normal.
const RAYS: usize = 8;

/// What rays from all surfaces meet, spread by area.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Survey {
    /// Share of the rays from fronts that meet backs.
    pub(super) backs_seen: f64,
    /// Mean direction of the rays that leave from within: from points where most rays do not; zero where none leaves.
    pub(super) opening: Vec3,
    /// Share of the rays from both sides that leave from within.
    pub(super) open_share: f64,
    /// Area of all surfaces, m².
    pub(super) area_sq_m: f64,
}

impl Survey {
    /// Rays of `scene`, N = 2048 points × 2 sides × 8: standard errors of shares at most 0.011.
    pub(super) fn of(scene: &Scene) -> Self {
        let geometry = &scene.geometry;
        let mut area_sq_m = 0.0;
        let cumulative: Vec<f64> = (0..geometry.triangles.len() as u32)
            .map(|id| {
                area_sq_m += surface::area(geometry.triangle(id));
                area_sq_m
            })
            .collect();
        let mut counts = Counts::default();
        for index in 0..POINTS {
            let mut sample = Sequence::new(7, 0).sample(index);
            let at = f64::from(sample.next_1d()) * area_sq_m;
            let id = cumulative.partition_point(|&sum| sum <= at).min(cumulative.len() - 1) as u32;
            counts.point(scene, id, &mut sample);
        }
        Self {
            backs_seen: counts.backs / (POINTS as usize * RAYS) as f64,
            open_share: f64::from(counts.left) / (POINTS as usize * RAYS * 2) as f64,
            opening: counts.out_of_within.normalize_or_zero(),
            area_sq_m,
        }
    }
}

#[derive(Default)]
struct Counts {
    backs: f64,
    /// Rays that leave from within.
    left: u32,
    out_of_within: Vec3,
}

impl Counts {
    fn point(&mut self, scene: &Scene, id: u32, sample: &mut Sample) {
        let geometry = &scene.geometry;
        let (vertices, front) = (geometry.triangle(id), geometry.normals[id as usize]);
        let [u, v] = sampling::triangle(sample.next_2d());
        let point = surface::point(vertices, u, v);
        for (normal, is_front) in [(front, true), (-front, false)] {
            let origin = surface::offset(vertices, point, normal);
            let (mut out, mut escaped) = (Vec3::ZERO, 0);
            for _ in 0..RAYS {
                let direction = sampling::cosine_hemisphere(normal, sample.next_2d());
                match scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY }) {
                    None => {
                        escaped += 1;
                        out += direction;
                    }
                    Some(hit) => {
                        let is_back = geometry.normals[hit.triangle as usize].dot(direction) > 0.0;
                        self.backs += f64::from(is_front && is_back);
                    }
                }
            }
            if 2 * escaped < RAYS {
                self.left += escaped as u32;
                self.out_of_within += out;
            }
        }
    }
}
