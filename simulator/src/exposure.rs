//! Turns virtual surface lights among other objects into the share of each one's patch that is not inside of one.
//!
//! Where a box stands on a floor, the cells of floor lights reach below the box, where no light comes. What leaves such a light
//! leaves the rest of its patch: taken for the light of the whole patch it is too dark beside the box's foot. A point is inside
//! of something if all it sees is sides that reflect nothing, which is what closed bodies are from within.

use crate::{disturbance::Obstacle, placement::Placement, vsl::Vsl};
use glam::Vec3;
use photonstream_scene::{
    Geometry, Scene, Side,
    bvh::{Hit, Ray},
};
use photonstream_shading::{sampling, sobol::Sequence, surface};
use rayon::prelude::*;

/// Points of a patch that are looked at, where anything crosses it.
const POINTS: u64 = 32;
/// Rays from a point of which one has to find something that reflects, or nothing at all.
const RAYS: u64 = 4;
/// Of the points and rays; the same for all lights.
const SEED: u64 = 0x6578_706f_7365;

/// The share of each light's patch, in [0, 1], that is not inside of something, in the order of the lights; the same on any
/// number of threads. 1 where all of it is, or none: such a light has no light to give.
pub fn shares(scene: &Scene, placement: &Placement) -> Vec<f32> {
    let lights = placement.vsls.par_iter().enumerate();
    lights.map(|(index, _)| share(scene, placement, index)).collect()
}

/// [`shares`] of a new version of a scene from those of the old one: lights that nothing moved near keep theirs.
pub(crate) fn followed(
    old: &[f32],
    scene: &Scene,
    placement: &Placement,
    has_moved: &[bool],
    obstacles: &[Obstacle],
) -> Vec<f32> {
    let lights = placement.vsls.par_iter().enumerate();
    lights
        .map(|(index, vsl)| {
            let is_near = has_moved[vsl.surface.object.0 as usize] || {
                let (low, high) = bounds(&scene.geometry, placement, index);
                obstacles.iter().any(|o| {
                    let [o_low, o_high] = o.bounds().map(Vec3::from_array);
                    low.cmple(o_high).all() && high.cmpge(o_low).all()
                })
            };
            if is_near { share(scene, placement, index) } else { old[index] }
        })
        .collect()
}

/// The box around a light and its patch in the scene's space.
fn bounds(geometry: &Geometry, placement: &Placement, index: usize) -> (Vec3, Vec3) {
    let vsl = &placement.vsls[index];
    let position = vsl.position_ws(geometry);
    let corners = placement.patches[index].corners_ws(geometry, vsl).map(|corner| position + corner);
    corners.fold((position, position), |(low, high), corner| (low.min(corner), high.max(corner)))
}

fn share(scene: &Scene, placement: &Placement, index: usize) -> f32 {
    let vsl = &placement.vsls[index];
    let geometry = &scene.geometry;
    let corners: Vec<Vec3> = placement.patches[index].corners_ws(geometry, vsl).collect();
    let at = Spot::of(scene, vsl);
    if corners.len() < 3 || !corners.iter().any(|&corner| at.is_something_before(corner)) {
        return 1.0;
    }
    let areas: Vec<f32> =
        corners[1..].array_windows().map(|[a, b]| (a - corners[0]).cross(b - corners[0]).length()).collect();
    let sum: f32 = areas.iter().sum();
    let sequence = Sequence::new(SEED, 0);
    let is_exposed = |point: u64| {
        let mut sample = sequence.sample(point);
        let mut place = sample.next_1d() * sum;
        let fan = areas.iter().position(|&area| {
            place -= area;
            place < 0.0
        });
        let fan = fan.unwrap_or(areas.len() - 1);
        let [u, v] = sampling::triangle(sample.next_2d());
        let [a, b, c] = [corners[0], corners[fan + 1], corners[fan + 2]];
        !at.is_inside(a + (b - a) * u + (c - a) * v)
    };
    let exposed = (0..POINTS).filter(|&point| is_exposed(point)).count();
    if exposed == 0 { 1.0 } else { exposed as f32 / POINTS as f32 }
}

/// Just above a light.
struct Spot<'a> {
    scene: &'a Scene,
    origin: Vec3,
    normal: Vec3,
}

impl<'a> Spot<'a> {
    fn of(scene: &'a Scene, vsl: &Vsl) -> Self {
        let normal = vsl.normal_ws(&scene.geometry);
        let vertices = scene.geometry.triangle(vsl.triangle);
        let origin = surface::offset(vertices, vsl.position_ws(&scene.geometry), normal);
        Self { scene, origin, normal }
    }

    /// Whether anything is between here and there, along the surface.
    fn is_something_before(&self, way: Vec3) -> bool {
        self.scene.bvh.occluded(&Ray { origin: self.origin, direction: way, t_max: 1.0 })
    }

    /// Whether the place at `way` from here is inside of something.
    fn is_inside(&self, way: Vec3) -> bool {
        let sequence = Sequence::new(SEED, 1);
        (0..RAYS).all(|ray| {
            let direction = sampling::cosine_hemisphere(self.normal, sequence.sample(ray).next_2d());
            let ray = Ray { origin: self.origin + way, direction, t_max: f32::INFINITY };
            self.scene.bvh.closest(&ray).is_some_and(|hit| !self.reflects(&hit, direction))
        })
    }

    fn reflects(&self, hit: &Hit, direction: Vec3) -> bool {
        let geometry = &self.scene.geometry;
        let is_front = geometry.normals[hit.triangle as usize].dot(direction) < 0.0;
        let object = geometry.object_of[hit.triangle as usize].0 as usize;
        self.scene.objects[object].sides.contains(if is_front { Side::Front } else { Side::Back })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;
    use photonstream_scene::SceneConfig;
    use serde_json::json;
    use std::{path::Path, sync::Arc};

    fn simulation(more: &str) -> Simulation {
        let text = format!(
            "[camera]\nposition_m = [0, 3, 9]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n[material.m]\nalbedo = 0.5\n\
             [object.floor]\nmaterial = \"m\"\nquad = {{ corner_m = [-2, 0, 2], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -4] }}\n\
             {more}\n[light.l]\npower_w = 1\npoint = {{ position_m = [0, 5, 0] }}\n[streaming]\nvsls = 500\n"
        );
        let scene = SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap();
        Simulation::new(Arc::new(scene))
    }

    const BOX: &str = "[object.box]\nmaterial = \"m\"\nposition_m = [0.3, 0.5, -0.2]\nrotation_deg = [0, 25, 0]\n\
                       box = { size_m = [1.1, 1, 1.7] }\n";

    fn on_floor(simulation: &Simulation) -> impl Iterator<Item = (&Vsl, f32)> {
        let floor = simulation.scene.object("floor").unwrap();
        let lights = simulation.placement.vsls.iter().zip(simulation.exposed.iter().copied());
        lights.filter(move |(vsl, _)| vsl.surface.object == floor)
    }

    /// A box that stands on a floor of 16 m², or into it, covers 1.87 m² of it, turned and moved: the lights that it covers partly make
    /// up for the rest within 4 σ, of 32 points for each of some 50 of them, and those that it covers wholly count for all of theirs.
    #[test]
    fn a_box_covers_what_it_stands_on() {
        for height in ["0.5", "0.3"] {
            let simulation = simulation(&BOX.replace("0.5,", &format!("{height},")));
            let scene = &simulation.scene;
            let to_box = scene.objects[scene.object("box").unwrap().0 as usize].world_from_rest.inverse();
            let is_below = |vsl: &Vsl| {
                let p = to_box.transform_point3(vsl.position_ws(&scene.geometry).as_dvec3());
                p.x.abs() < 0.55 && p.z.abs() < 0.85
            };
            let (mut exposed, mut variance, mut partly, mut below) = (0.0, 0.0, 0, 0.0);
            for (vsl, share) in on_floor(&simulation) {
                let area = f64::from(vsl.area);
                if share < 1.0 {
                    partly += 1;
                    exposed += area * f64::from(share);
                    variance += area * area * f64::from(share * (1.0 - share)) / 32.0;
                } else if is_below(vsl) {
                    below += area;
                } else {
                    exposed += area;
                }
            }
            assert!((20..100).contains(&partly) && below > 0.5, "{partly} partly, {below} m² below");
            let error = exposed - (16.0 - 1.1 * 1.7);
            assert!(error.abs() < 4.0 * variance.sqrt(), "{height}: {error}, σ {}", variance.sqrt());
        }
    }

    /// Nothing is inside of anything where bodies are open or reflect on both sides, and where they only hang above the floor.
    #[test]
    fn what_light_can_reach_is_not_inside() {
        let both = BOX.replace("material", "sides = \"both\"\nmaterial");
        let above = BOX.replace("0.5,", "0.6,");
        for more in ["", &both, &above] {
            let simulation = simulation(more);
            assert!(on_floor(&simulation).all(|(_, share)| share == 1.0), "{more}");
        }
    }

    /// After each of 20 moves of the box, over the floor, off it and onto it, the shares are those of a new look at all of them.
    #[test]
    fn moved_bodies_leave_the_shares_of_a_new_look() {
        let mut simulation = simulation(BOX);
        let mut different = 0;
        for step in 0..20 {
            let (x, y) = (0.1 * f64::from(step) - 1.0, if step % 5 == 4 { 0.8 } else { 0.5 });
            let values = json!({ "position_m": [x, y, 0.4 - x], "rotation_deg": [0, 7 * step, 0] });
            let mut edit = simulation.scene.edit();
            edit.move_object("box", values.as_object().unwrap()).unwrap();
            let next = simulation.with_scene(Arc::new(edit.finish()));
            assert!(next.exposed[..] == shares(&next.scene, &next.placement), "step {step}");
            different += usize::from(next.exposed != simulation.exposed);
            simulation = next;
        }
        assert!(different > 15);
    }
}
