//! Turns reached surfaces into the area that each virtual point light stands for.

use super::{
    cluster::COS_TOGETHER,
    grid::Grid,
    trace::{Kind, Kinds, Reflection},
};
use crate::{
    bvh::Ray,
    scene::{ObjectId, Scene, Side},
};
use glam::Vec3;
use photonstream_shading::{
    sampling,
    sobol::{Sample, Sequence},
    surface,
};
use rayon::prelude::*;

/// A virtual point light among which the surface is shared out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// What its surface is, where that is known.
    pub(super) kind: Option<Kind>,
}

/// Points on the surface for each of the lights, and limits of their number.
const POINTS_EACH: usize = 128;
const POINTS: std::ops::RangeInclusive<usize> = 1 << 14..=1 << 17;

/// Points for each of so many lights that the limit would leave them fewer.
const POINTS_AT_LEAST: usize = 16;

/// How far from a light surface may lie that it stands for, in multiples of the reach.
const BEYOND: f32 = 2.0;

/// How much finer the first grid is in which a reflection is looked for.
const FINER: f32 = 6.0;

/// Surfaces of other material are shared out as if so much farther away, squared: to a light of their own where there is one.
const UNLIKE: f32 = 4.0;

/// The area in m² that each light stands for: of all reflecting sides, what has a reflection within `reach_m` and open towards
/// it goes to the nearest light within 45°, moving objects to lights of their own. Points are spread evenly over the surface.
pub(super) fn areas(
    scene: &Scene,
    kinds: &Kinds,
    (reflections, reach_m): (&[Reflection], f32),
    shares: &[Share],
    sequence: Sequence,
) -> Vec<f32> {
    let surface = Surface::of(scene);
    let count = (POINTS_EACH * shares.len()).clamp(*POINTS.start(), *POINTS.end());
    let count = count.max(POINTS_AT_LEAST * shares.len());
    let mut lights = Grid::new(BEYOND * reach_m);
    (0u32..).zip(shares).for_each(|(number, share)| lights.insert(share.position, number));
    // Most points have a reflection close by; the others look as far as the reach.
    let grids = [reach_m / FINER, reach_m].map(|edge_m| {
        let mut grid = Grid::new(edge_m);
        (0u32..).zip(reflections).for_each(|(number, at)| grid.insert(at.position, number));
        grid
    });
    let nearest_in = |grid: &Grid, point: &Place| {
        grid.near(point.position)
            .map(|number| &reflections[number as usize])
            .filter(|at| at.normal.dot(point.normal) >= COS_TOGETHER && at.kind.moving == point.kind.moving)
            .map(|at| (at.position.distance_squared(point.position), at.position))
            .min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let owner = |index: usize| {
        let point = surface.point(scene, kinds, index, count, sequence.sample(index as u64))?;
        let (_, nearest) = grids.iter().find_map(|grid| nearest_in(grid, &point))?;
        let to = nearest - point.position;
        let is_reached = to.length_squared() < reach_m * reach_m
            && !scene.bvh.occluded(&Ray { origin: point.position, direction: to, t_max: 1.0 });
        is_reached.then(|| owner_of(&point, shares, &lights, BEYOND * reach_m)).flatten()
    };
    let owners: Vec<Option<usize>> = (0..count).into_par_iter().map(owner).collect();
    let mut points = vec![0u32; shares.len()];
    owners.into_iter().flatten().for_each(|owner| points[owner] += 1);
    let area_of_point = surface.total_m2() / count as f64;
    points.into_iter().map(|points| (f64::from(points) * area_of_point) as f32).collect()
}

/// The light that stands for a place, of those within `within_m`, the edge of the grid of their numbers.
fn owner_of(point: &Place, shares: &[Share], lights: &Grid, within_m: f32) -> Option<usize> {
    let distance_sq = |share: &Share| {
        let own = share.kind.is_none_or(|kind| kind.moving == point.kind.moving);
        let distance_sq = share.position.distance_squared(point.position);
        let fits = own && share.normal.dot(point.normal) >= COS_TOGETHER && distance_sq < within_m * within_m;
        let is_alike = share.kind.is_none_or(|kind| kind.is_alike(&point.kind));
        fits.then_some(if is_alike { distance_sq } else { UNLIKE * distance_sq })
    };
    let near = lights.near(point.position).map(|number| number as usize);
    let distances = near.filter_map(|i| Some((i, distance_sq(&shares[i])?)));
    distances.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map(|(i, _)| i)
}

/// A place on a reflecting side.
struct Place {
    /// Just off the surface.
    position: Vec3,
    normal: Vec3,
    kind: Kind,
}

/// All reflecting sides, by area.
struct Surface {
    sides: Vec<(u32, Side)>,
    /// Sum of the areas up to and with each side, m².
    sums_m2: Vec<f64>,
}

impl Surface {
    fn of(scene: &Scene) -> Self {
        let mut sum = 0.0;
        let (mut sides, mut sums_m2) = (Vec::new(), Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            if scene.albedo(ObjectId(index as u32)).max_element() == 0.0 {
                continue;
            }
            for triangle in object.triangles.clone() {
                let area = surface::area(scene.geometry.triangle(triangle));
                for side in object.sides.iter() {
                    sum += area;
                    sides.push((triangle, side));
                    sums_m2.push(sum);
                }
            }
        }
        Self { sides, sums_m2 }
    }

    fn total_m2(&self) -> f64 {
        self.sums_m2.last().copied().unwrap_or(0.0)
    }

    /// Point `index` of `count`: each has an equal part of the area for itself.
    fn point(
        &self,
        scene: &Scene,
        kinds: &Kinds,
        index: usize,
        count: usize,
        mut sample: Sample,
    ) -> Option<Place> {
        let along = (index as f64 + f64::from(sample.next_1d())) / count as f64 * self.total_m2();
        let number = self.sums_m2.partition_point(|sum| *sum <= along);
        let &(triangle, side) = self.sides.get(number)?;
        let [u, v] = sampling::triangle(sample.next_2d());
        let vertices = scene.geometry.triangle(triangle);
        let normal = scene.geometry.normals[triangle as usize] * side.sign();
        let position = surface::offset(vertices, surface::point(vertices, u, v), normal);
        let object = scene.geometry.object_of[triangle as usize];
        Some(Place { position, normal, kind: kinds.get(object) })
    }
}
