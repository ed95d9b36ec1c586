//! Turns parts that move rigidly, stretch and fold into the hits of parts built anew.

use glam::{Mat3, Quat, Vec3};

use super::shapes::{Mesh, Random, cube, everything, soup, sphere};
use crate::bvh::{Ray, SceneBvh, refit::REFIT_FROM};

fn scene(mesh: &Mesh) -> SceneBvh {
    SceneBvh::build(&mesh.0, &mesh.1, &everything(mesh))
}

/// 100 000 rays, seed 71, from around and within a mesh of size 1 near `centre`: hits equal bit for bit.
fn assert_same_hits(a: &SceneBvh, b: &SceneBvh, centre: Vec3) {
    let mut random = Random(71);
    let mut hits = 0;
    for _ in 0..100_000 {
        let origin = centre + random.in_cube() * 2.0;
        let ray = Ray { origin, direction: centre + random.in_cube() - origin, t_max: f32::INFINITY };
        let hit = a.closest(&ray);
        assert_eq!(hit, b.closest(&ray));
        assert_eq!(a.occluded(&ray), hit.is_some());
        hits += u32::from(hit.is_some());
    }
    assert!(hits > 10_000, "only {hits} rays hit");
}

fn refits(scene: &SceneBvh, mesh: &Mesh) -> bool {
    scene.parts[0].bvh.refitted(&mesh.0, &mesh.1).is_some()
}

#[test]
fn a_refitted_part_has_the_hits_of_one_built_anew() {
    let mut random = Random(70);
    // None of them has a triangle without area.
    for mesh in [cube(20), soup(&mut random, 3000, 0.1)] {
        let built = scene(&mesh);
        for step in 1..=3 {
            let turn =
                Mat3::from_quat(Quat::from_axis_angle(random.in_cube().normalize(), step as f32 * 0.2));
            let offset = random.in_cube() * 5.0;
            let moved: Mesh = (mesh.0.iter().map(|v| turn * *v + offset).collect(), mesh.1.clone());
            let mut refitted = built.clone();
            refitted.rebuild_part(0, &moved.0, &moved.1);
            refitted.validate().unwrap();
            if refits(&built, &moved) {
                assert_eq!(refitted.parts[0].bvh.packets.len(), built.parts[0].bvh.packets.len());
            }
            let anew = scene(&moved);
            assert_eq!(refitted.bounds(), anew.bounds());
            assert_same_hits(&refitted, &anew, offset);
        }
    }
}

#[test]
fn good_trees_are_refitted_and_bad_ones_built_anew() {
    let mesh = soup(&mut Random(72), 3000, 0.1);
    let built = scene(&mesh);
    let with = |change: &dyn Fn(Vec3) -> Vec3| (mesh.0.iter().map(|v| change(*v)).collect(), mesh.1.clone());
    assert!(refits(&built, &mesh));
    assert!(refits(&built, &with(&|v| v + Vec3::splat(3.0))));
    assert!(refits(&built, &with(&|v| v * Vec3::new(2.0, -3.0, 2.5))));
    // Points that were neighbours are far apart.
    let scattered = with(&|v| (v * 40.0).map(f32::sin));
    assert!(!refits(&built, &scattered));
    let mut rebuilt = built.clone();
    rebuilt.rebuild_part(0, &scattered.0, &scattered.1);
    rebuilt.validate().unwrap();
    assert_same_hits(&rebuilt, &scene(&scattered), Vec3::ZERO);
    // A triangle that loses its area, and one that gains it.
    let mut flat = mesh.clone();
    let [a, b, _] = flat.1[5];
    flat.0[b as usize] = flat.0[a as usize];
    assert!(!refits(&built, &flat));
    assert!(!refits(&scene(&flat), &mesh));
    assert!(!refits(&built, &with(&|_| Vec3::NAN)));
    assert!(!refits(&built, &(Vec::new(), mesh.1.clone())));
    let few = soup(&mut Random(73), REFIT_FROM as usize - 1, 0.1);
    assert!(!refits(&scene(&few), &few));
    let round = sphere(40, 40);
    assert!(!refits(&scene(&round), &round), "its poles have triangles without area");
}

/// The cost is measured against the tree as it was built: small steps do not wear it down unseen.
#[test]
fn a_tree_that_wears_down_in_small_steps_is_built_anew() {
    let mesh = soup(&mut Random(74), 2000, 0.1);
    let mut now = mesh.clone();
    let mut scene = scene(&mesh);
    let cost = scene.parts[0].bvh.built_cost;
    let mut built_anew = 0;
    for step in 0..40 {
        now.0
            .iter_mut()
            .zip(&mesh.0)
            .for_each(|(now, v)| *now = *v + (*v * 40.0).map(f32::sin) * (step as f32 * 0.05));
        let nodes = scene.parts[0].bvh.nodes.len();
        let anew = scene.parts[0].bvh.refitted(&now.0, &now.1).is_none();
        scene.rebuild_part(0, &now.0, &now.1);
        scene.validate().unwrap();
        built_anew += u32::from(anew);
        assert!(anew || scene.parts[0].bvh.nodes.len() == nodes);
    }
    assert!((1..20).contains(&built_anew), "{built_anew} times");
    assert!(scene.parts[0].bvh.built_cost != cost);
}
