//! Placement and owners: areas, distances, moving objects, and every owner the nearest.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::{Scene, Side};
use photonstream_shading::{sampling, sobol::Sequence, surface};
use photonstream_simulator::{
    owner::OwnerTable,
    placement::Placement,
    simulation::Simulation,
    vsl::{COMPATIBLE_COSINE, Vsl},
};
use std::sync::Arc;

fn objects(transform: &str) -> Scene {
    crate::support::scene(&format!(
        "[material.a]\nalbedo = 0.5\n\
         [object.ball]\nmaterial = \"a\"\n{transform}\nsphere = {{ radius_m = 0.5, segments = 24 }}\n\
         [object.crate]\nmaterial = \"a\"\nposition_m = [2, 0, 0]\nbox = {{ size_m = [1, 0.5, 2] }}\n\
         [object.sheet]\nmaterial = \"a\"\nsides = \"both\"\nquad = {{ corner_m = [-2, -1, 0], edge_u_m = [1, 0, 0], edge_v_m = [0, 3, 1] }}\n\
         [streaming]\nvsls = 400\nseed = 3\n"
    ))
}

/// Per surface: the sum of the lights' areas is the surface's own, to the rounding of f32 areas.
#[test]
fn areas_sum_to_the_surface() {
    for transform in [
        "",
        "scale = [1, 2, 0.5]",
        "scale = [-1, 1, 1]\nrotation_deg = [20, 30, 40]",
        "scale = [-2, -2, -0.1]",
    ] {
        let simulation = Simulation::new(Arc::new(objects(transform)));
        assert_eq!(simulation.placement.vsls.len(), 400);
        for (on, range) in &simulation.placement.surfaces {
            let geometry = &simulation.scene.geometry;
            let triangles = simulation.scene.objects[on.object.0 as usize].triangles.clone();
            let exact: f64 = triangles.map(|t| surface::area(geometry.triangle(t))).sum();
            let lights = &simulation.placement.vsls[range.start as usize..range.end as usize];
            let sum: f64 = lights.iter().map(|v| f64::from(v.area)).sum();
            assert!((sum / exact - 1.0).abs() < 1e-5, "{transform} {on:?}: {sum} of {exact}");
            assert!(!lights.is_empty() && lights.iter().all(|v| v.area > 0.0 && v.surface == *on));
        }
    }
}

/// The heap's answer is that of Algorithm 1 as written, which compares everything with everything.
#[test]
fn thinning_equals_the_naive_algorithm() {
    let scene = objects("scale = [1, 2, 1]");
    let keep = Placement::with(&scene, 150, 7, 1.0, 1.4);
    assert_eq!(keep.vsls.len(), 150);
    for (surface, range) in &keep.surfaces {
        let kept = &keep.vsls[range.start as usize..range.end as usize];
        let wanted = kept.len();
        // The points before thinning are those that a larger share would draw first, at the same scale.
        let all = Placement::with(&scene, 4000, 7, 1.0, 1.0);
        let (_, all_range) = all.surfaces.iter().find(|(s, _)| s == surface).unwrap();
        let count = (wanted as f64 * 1.4).ceil() as usize;
        let mut points: Vec<Vsl> = all.vsls[all_range.start as usize..][..count].to_vec();
        let geometry = &scene.geometry;
        while points.len() > wanted {
            let entry = |i: usize| {
                let at = points[i].position_rest(geometry);
                let normal = geometry.normals[points[i].triangle as usize];
                let mut distances: Vec<u32> = (0..points.len())
                    .filter(|&j| {
                        j != i
                            && normal.dot(geometry.normals[points[j].triangle as usize]) >= COMPATIBLE_COSINE
                    })
                    .map(|j| at.distance_squared(points[j].position_rest(geometry)).to_bits())
                    .collect();
                distances.sort_unstable();
                distances.resize(2, f32::INFINITY.to_bits());
                ([distances[0], distances[1]], i)
            };
            let worst = (0..points.len()).map(entry).min().unwrap().1;
            points.remove(worst);
        }
        let positions = |vsls: &[Vsl]| vsls.iter().map(|v| v.position_rest(geometry)).collect::<Vec<Vec3>>();
        assert_eq!(positions(kept), positions(&points), "{surface:?}");
    }
}

/// Thinning spreads: the closest pair of the kept is farther apart than that of as many points not thinned.
#[test]
fn no_pair_is_closer_than_removal_allows() {
    let scene = objects("");
    let closest = |placement: &Placement| {
        let mut least = f32::INFINITY;
        for (_, range) in &placement.surfaces {
            let lights = &placement.vsls[range.start as usize..range.end as usize];
            for (i, a) in lights.iter().enumerate() {
                for b in &lights[..i] {
                    let normals = [a, b].map(|v| scene.geometry.normals[v.triangle as usize]);
                    if normals[0].dot(normals[1]) >= COMPATIBLE_COSINE {
                        least = least
                            .min(a.position_rest(&scene.geometry).distance(b.position_rest(&scene.geometry)));
                    }
                }
            }
        }
        least
    };
    let thinned = closest(&Placement::with(&scene, 400, 3, 0.9, 1.1));
    let random = closest(&Placement::with(&scene, 400, 3, 0.9, 1.0));
    assert!(thinned > 2.0 * random, "{thinned} m against {random} m");
}

/// Moving, turning or mirroring an object moves its lights with it and changes no owner.
#[test]
fn lights_move_with_their_object() {
    let still = Simulation::new(Arc::new(objects("")));
    let moved = Simulation::new(Arc::new(objects("position_m = [0.5, 3, 1]\nrotation_deg = [10, 50, 90]")));
    assert_eq!(still.placement, moved.placement);
    assert_eq!(still.owners, moved.owners);
    for scene in
        [objects("position_m = [0.5, 3, 1]\nrotation_deg = [10, 50, 90]"), objects("scale = [-1, 1, 1]")]
    {
        let simulation = Simulation::new(Arc::new(scene));
        let geometry = &simulation.scene.geometry;
        let ball = simulation.scene.object("ball").unwrap();
        let triangles = simulation.scene.objects[ball.0 as usize].triangles.clone();
        let centre = triangles
            .clone()
            .map(|t| surface::point(geometry.triangle(t), 1.0 / 3.0, 1.0 / 3.0))
            .sum::<Vec3>()
            / triangles.len() as f32;
        for vsl in simulation.placement.vsls.iter().filter(|v| v.surface.object == ball) {
            let from_centre = vsl.position_ws(geometry) - centre;
            assert!((from_centre.length() - 0.5).abs() < 0.01, "off the sphere: {from_centre}");
            assert!(vsl.normal_ws(geometry).dot(from_centre.normalize()) > 0.98, "not outwards");
        }
    }
}

/// N = 100 000 random points on all sides: the owner is the nearest compatible light of the surface. Lights equally near
/// to 1e-4 of the distance count as ties: the table compares squares of distances up to a cell's size in f32.
#[test]
fn owners_are_the_nearest_lights() {
    for (vsls, scene) in
        [(400, objects("scale = [1, 2, 0.5]")), (5, objects("")), (3000, objects("scale = [-1, 1, 1]"))]
    {
        let placement = Placement::with(&scene, vsls, 1, 0.9, 1.1);
        let owners = OwnerTable::new(&scene, &placement);
        let geometry = &scene.geometry;
        for i in 0..100_000u64 {
            let mut sample = Sequence::new(4, 4).sample(i);
            let triangle = (sample.next_1d() * geometry.triangles.len() as f32) as u32;
            let [u, v] = sampling::triangle(sample.next_2d());
            let object = geometry.object_of[triangle as usize];
            for side in [Side::Front, Side::Back] {
                let owner = owners.owner(triangle, side, u, v);
                if !scene.objects[object.0 as usize].sides.contains(side) {
                    assert_eq!(owner, None);
                    continue;
                }
                let [a, b, c] = geometry.rest_triangle(triangle);
                let at = a * (1.0 - u - v) + b * u + c * v;
                let normal = geometry.normals[triangle as usize];
                let (surface, range) =
                    placement.surfaces.iter().find(|(s, _)| s.object == object && s.side == side).unwrap();
                let distance = |id: u32| at.distance(placement.vsls[id as usize].position_rest(geometry));
                let compatible = |id: &u32| {
                    normal.dot(geometry.normals[placement.vsls[*id as usize].triangle as usize])
                        >= COMPATIBLE_COSINE
                };
                let nearest = |ids: &mut dyn Iterator<Item = u32>| ids.map(distance).min_by(f32::total_cmp);
                let best = nearest(&mut range.clone().filter(compatible))
                    .or_else(|| nearest(&mut range.clone()))
                    .unwrap();
                let owner = owner.unwrap();
                assert!(range.contains(&owner.0));
                assert!(
                    distance(owner.0) <= best * 1.0001 + 1e-5,
                    "{surface:?} {at}: {} m, nearest {best}",
                    distance(owner.0)
                );
            }
        }
    }
}
