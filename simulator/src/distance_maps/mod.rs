//! Turns virtual surface lights into what they see around themselves: octahedral maps of the distances to the first surfaces.
//!
//! A map is traced texel by texel, each a ray; after something has moved only the texels whose rays pass where it was or is.

mod schedule;

pub use schedule::Schedule;

use crate::{cancel::Cancel, disturbance::Obstacle, placement::Placement, vsl::Vsl};
use glam::Vec3;
use photonstream_scene::{Geometry, Scene, bvh::Ray};
use photonstream_shading::{
    distance_map::{self, Axes, TEXELS_PER_WORD},
    surface,
};
use rayon::prelude::*;
use std::{collections::HashSet, sync::Arc};

/// The map of one light: two texels a word, row by row.
pub type Map = Arc<[u32]>;

/// A coarse map has one ray for so many texels in a row, and as many rows.
const COARSE: u32 = 4;

/// The distance maps of all lights, one after the other, on the present rayon pool; empty where the scene asks for none.
pub fn all(scene: &Scene, placement: &Placement) -> Vec<u32> {
    let edge = scene.streaming.distance_map_px;
    if edge == 0 {
        return Vec::new();
    }
    let mut maps = vec![0; placement.vsls.len() * words(edge)];
    maps.par_chunks_exact_mut(words(edge))
        .zip(&placement.vsls)
        .for_each(|(map, vsl)| View::of(&scene.geometry, vsl).trace(scene, edge, map));
    maps
}

/// The maps of the lights of `placement` that are not where one of `before` is, by number, on the present rayon pool; none
/// where the scene asks for none. Nobody needs all of them where it was cancelled.
pub(crate) fn of_new_lights(
    scene: &Scene,
    placement: &Placement,
    before: &Placement,
    cancel: &Cancel,
) -> Vec<(u32, Map)> {
    let edge = scene.streaming.distance_map_px;
    if edge == 0 {
        return Vec::new();
    }
    let there: HashSet<_> = before.vsls.iter().map(Vsl::place).collect();
    let lights: Vec<_> =
        placement.vsls.iter().zip(0..).filter(|(vsl, _)| !there.contains(&vsl.place())).collect();
    let maps = lights.into_par_iter().map(|(vsl, number)| {
        let mut map = vec![0; words(edge)];
        if !cancel.is_cancelled() {
            View::of(&scene.geometry, vsl).trace(scene, edge, &mut map);
        }
        (number, map.into())
    });
    maps.collect()
}

/// Words of a map of `edge`² texels.
pub(crate) fn words(edge: u32) -> usize {
    (edge * edge / TEXELS_PER_WORD) as usize
}

/// Where a light looks from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    origin: Vec3,
    axes: Axes,
}

impl View {
    /// That of a light.
    fn of(geometry: &Geometry, vsl: &Vsl) -> Self {
        let normal = vsl.normal_ws(geometry);
        let vertices = geometry.triangle(vsl.triangle);
        let origin = surface::offset(vertices, vsl.position_ws(geometry), normal);
        Self { origin, axes: Axes::of(normal) }
    }

    /// That of a light of the given place and unit normal, m, which lies on or near a surface.
    pub(crate) fn from(scene: &Scene, position: Vec3, normal: Vec3) -> Self {
        let magnitude = position.abs().max_element() + scene.bounds.radius;
        Self { origin: position + normal * (magnitude * surface::RELATIVE_OFFSET), axes: Axes::of(normal) }
    }

    /// Along the middle of a texel, of 1-norm 1 in the light's axes: so far away as t is what the map holds.
    fn direction(&self, edge: u32, x: u32, y: u32) -> Vec3 {
        self.axes.world(distance_map::centre(edge, x, y))
    }

    fn look(&self, scene: &Scene, direction: Vec3) -> u32 {
        let ray = Ray { origin: self.origin, direction, t_max: f32::INFINITY };
        scene.bvh.closest(&ray).map_or(0, |hit| distance_map::pack(1.0 / hit.t).into())
    }

    pub(crate) fn trace(&self, scene: &Scene, edge: u32, map: &mut [u32]) {
        let mut texels = (0..edge * edge).map(|i| self.look(scene, self.direction(edge, i % edge, i / edge)));
        for word in map {
            // There are two for each word.
            *word = texels.next().unwrap_or(0) | texels.next().unwrap_or(0) << 16;
        }
    }

    /// The map with a quarter of the edge, its texels repeated.
    fn trace_coarsely(&self, scene: &Scene, edge: u32, map: &mut [u32]) {
        let coarse_edge = edge / COARSE;
        for y in 0..coarse_edge {
            for x in 0..coarse_edge {
                let texel = self.look(scene, self.direction(coarse_edge, x, y));
                for row in y * COARSE..(y + 1) * COARSE {
                    let first = ((row * edge + x * COARSE) / TEXELS_PER_WORD) as usize;
                    map[first..first + (COARSE / TEXELS_PER_WORD) as usize].fill(texel | texel << 16);
                }
            }
        }
    }

    /// Traces the texels whose rays may cross one of `obstacles` again. Returns the number of rays.
    fn trace_crossed(&self, scene: &Scene, edge: u32, obstacles: &[Obstacle], map: &mut [u32]) -> u64 {
        let mut rays = 0;
        for i in 0..edge * edge {
            let direction = self.direction(edge, i % edge, i / edge);
            let unit = direction.normalize().into();
            if !obstacles.iter().any(|o| o.is_crossed_by_ray(self.origin.into(), unit)) {
                continue;
            }
            rays += 1;
            let (word, shift) = (&mut map[(i / TEXELS_PER_WORD) as usize], 16 * (i % TEXELS_PER_WORD));
            *word = *word & !(0xffff << shift) | self.look(scene, direction) << shift;
        }
        rays
    }

    /// Whether something of `obstacle` may be on the light's side.
    fn faces(&self, obstacle: &Obstacle) -> bool {
        let (centre, radius) = obstacle.sphere();
        self.axes.normal.dot(Vec3::from_array(centre) - self.origin) + radius > 0.0
    }
}

/// How much of a map is to be traced.
#[derive(Clone, Debug)]
enum Extent {
    Coarse,
    Whole,
    Crossed(Arc<[Obstacle]>),
}

/// A map to be traced.
#[derive(Clone, Debug)]
pub struct MapTask {
    schedule: u64,
    scene: Arc<Scene>,
    vsl: u32,
    view: View,
    extent: Extent,
    before: Map,
}

/// A map that was traced.
#[derive(Clone, Debug)]
pub struct Traced {
    schedule: u64,
    vsl: u32,
    map: Map,
    was_coarse: bool,
    /// Number of rays.
    pub rays: u64,
}

impl MapTask {
    /// Traces it.
    pub fn run(self) -> Traced {
        let edge = self.scene.streaming.distance_map_px;
        let mut map = self.before.to_vec();
        let was_coarse = matches!(self.extent, Extent::Coarse);
        let texels = u64::from(edge * edge);
        let rays = match self.extent {
            Extent::Coarse => {
                self.view.trace_coarsely(&self.scene, edge, &mut map);
                texels / u64::from(COARSE * COARSE)
            }
            Extent::Whole => {
                self.view.trace(&self.scene, edge, &mut map);
                texels
            }
            Extent::Crossed(obstacles) => self.view.trace_crossed(&self.scene, edge, &obstacles, &mut map),
        };
        let map = if map[..] == self.before[..] { self.before } else { map.into() };
        Traced { schedule: self.schedule, vsl: self.vsl, map, was_coarse, rays }
    }
}
