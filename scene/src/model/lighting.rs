//! Turns a scene without light, and the view of it, into a sun or lamps that light what is seen.

use super::{enclosure::Surroundings, view::View};
use crate::{bvh::Ray, scene::Scene};
use glam::Vec3;
use photonstream_shading::{sampling, sobol::Sequence, surface};
use std::f32::consts::PI;

/// Irradiance of a surface that faces the sun, or that a lamp stands above, W m⁻².
const IRRADIANCE: f32 = 10.0;
/// Warm white.
const COLOUR: Vec3 = Vec3::new(1.0, 0.9, 0.75);
/// Suns that are tried for a room.
const SUNS: u64 = 64;
/// A room that no sun lights more of than this share gets lamps.
const LEAST_LIT: f32 = 0.04;
/// Most lamps of a room.
const MOST_LAMPS: f32 = 4.0;

/// Light that is added.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Added {
    /// The way its light travels, and its irradiance in W m⁻².
    Sun { direction: Vec3, irradiance: Vec3 },
    /// Where they hang, and the power of each in W.
    Lamps(Vec<(Vec3, Vec3)>),
}

/// A sun from behind the camera, over its left shoulder.
pub(super) fn over_the_shoulder(view: &View) -> Added {
    let forward = (view.target - view.position).normalize();
    let right = forward.cross(Vec3::Y).normalize_or(Vec3::X);
    let level = Vec3::Y.cross(right);
    let direction = (level * 0.55 + right * 0.45 - Vec3::Y * 0.85).normalize();
    Added::Sun { direction, irradiance: COLOUR * IRRADIANCE }
}

/// The sun that lights most of what is seen through the openings of a room, or lamps where it is closed.
pub(super) fn of_room(scene: &Scene, view: &View) -> Added {
    let seen = seen(scene, view);
    let suns = (0..SUNS).map(|index| {
        // Between 25° and 75° above the horizon.
        let [turn, height] = Sequence::new(13, 0).sample(index).next_2d();
        let elevation = (25.0 + 50.0 * height).to_radians();
        let (sin, cos) = sampling::sin_cos_turn(turn);
        let direction = -Vec3::new(cos * elevation.cos(), elevation.sin(), sin * elevation.cos());
        (lit_share(scene, &seen, direction), direction)
    });
    match suns.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((share, direction)) if share > LEAST_LIT => {
            Added::Sun { direction, irradiance: COLOUR * IRRADIANCE }
        }
        _ => lamps(scene, view),
    }
}

/// Points that the camera sees, with the normals of the sides it sees.
fn seen(scene: &Scene, view: &View) -> Vec<(Vec3, Vec3)> {
    let rays = view.directions(32, 24).into_iter();
    rays.filter_map(|direction| {
        let hit = scene.bvh.closest(&Ray { origin: view.position, direction, t_max: f32::INFINITY })?;
        let vertices = scene.geometry.triangle(hit.triangle);
        let normal = scene.geometry.normals[hit.triangle as usize];
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some((surface::offset(vertices, surface::point(vertices, hit.u, hit.v), normal), normal))
    })
    .collect()
}

fn lit_share(scene: &Scene, seen: &[(Vec3, Vec3)], direction: Vec3) -> f32 {
    let lit = seen.iter().filter(|(origin, normal)| {
        let ray = Ray { origin: *origin, direction: -direction, t_max: f32::INFINITY };
        normal.dot(direction) < -0.1 && !scene.bvh.occluded(&ray)
    });
    lit.count() as f32 / seen.len().max(1) as f32
}

/// Lamps along the view, high in the room.
fn lamps(scene: &Scene, view: &View) -> Added {
    let forward = (view.target - view.position).normalize();
    let distance = |origin, direction| {
        let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY });
        hit.map(|hit| hit.t)
    };
    let (low, high) = scene.bvh.bounds();
    let length = distance(view.position, forward).unwrap_or((high - low).length() * 0.5);
    let height_at = |point: Vec3| {
        let above = distance(point, Vec3::Y).unwrap_or(high.y - point.y);
        (above, above + distance(point, Vec3::NEG_Y).unwrap_or(point.y - low.y))
    };
    let (_, height) = height_at(view.position + forward * (0.5 * length));
    let number = (length / (1.5 * height.max(1e-6))).round().clamp(1.0, MOST_LAMPS);
    let lamps = (0..number as u32).map(|i| {
        let below = view.position + forward * (length * (i as f32 + 0.5) / number);
        let (above, height) = height_at(below);
        // Down from the ceiling until there is space around it.
        let places = [0.75, 0.5, 0.25, 0.0].map(|share| below + Vec3::Y * (above * share));
        let is_free = |point: &&Vec3| Surroundings::of(scene, **point).nearest > 0.1 * height;
        let place = *places.iter().find(is_free).unwrap_or(&places[3]);
        (place, COLOUR * (IRRADIANCE * 4.0 * PI * height * height * 0.25))
    });
    Added::Lamps(lamps.collect())
}
