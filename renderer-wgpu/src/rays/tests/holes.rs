//! Turns plates full of holes into the claim that rays pass through them on the device where they do on the CPU.

use super::{answers::device, *};
use crate::{fence, rays::holes::check_buffers};

fn plates(holes: bool) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(&fence::scene_text(folder.path(), holes));
    assert_eq!(scene.bvh.has_holes(), holes);
    scene
}

/// Segments from all over the floor to all over the region of the lamp. N = 2¹⁸: 2 may differ, for
/// roundings move a place on a plate by 10⁻⁵ of a texel at most, and an outline of holes is that near to one ray in 10⁵ or
/// so (measured: none).
#[test]
fn rays_pass_where_they_do_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let (scene, solid) = (plates(true), plates(false));
    let sequence = Sequence::new(3, 0);
    let origin = scene.origin_m.as_vec3();
    let queries: Vec<Ray> = (0..1 << 18)
        .map(|i| {
            let mut sample = sequence.sample(i);
            let [x, z] = sample.next_2d();
            let [u, v] = sample.next_2d();
            let from = Vec3::new(5.0 * x - 2.5, 1e-3, 3.0 * z - 1.5);
            let to = Vec3::new(2.0 * u - 1.0, 2.3, 2.0 * v - 1.0);
            Ray { origin: from - origin, direction: to - from, t_max: SHADOW_REACH }
        })
        .collect();
    let (found, _) = device(&gpu, &scene, &queries, false);
    let differing = queries.iter().zip(&found).filter(|(r, f)| scene.bvh.occluded(r) != **f).count();
    assert!(differing <= 2, "{differing} of {} rays", queries.len());
    let through = queries.iter().zip(&found).filter(|(r, f)| !**f && solid.bvh.occluded(r)).count();
    let stopped = found.iter().filter(|f| **f).count();
    println!("{differing} differ, {through} pass through holes, {stopped} are stopped");
    assert!(through > queries.len() / 10 && stopped > queries.len() / 10, "{through}, {stopped}");
}

/// The same scene moved keeps its masks and takes new links; one with fewer triangles takes new masks; one without holes
/// has other shaders; and each gives the bits that rays made for it give. N = 40 × 30 pixels.
#[test]
fn rays_follow_what_moves_and_what_has_holes() {
    let Some(gpu) = gpu() else { return };
    let moved = |scene: &Scene, by: Vec3| {
        let mut scene = scene.clone();
        let mut geometry = (*scene.geometry).clone();
        let plate = scene.objects.iter().find(|o| scene.materials[o.material.0 as usize].texture.is_some());
        for t in plate.unwrap().triangles.clone() {
            for v in geometry.triangles[t as usize] {
                geometry.vertices[v as usize] += by * if t % 2 == 0 { 1.0 } else { 0.5 };
            }
        }
        scene.geometry = Arc::new(geometry);
        scene
    };
    let (holes, solid) = (plates(true), plates(false));
    let far = moved(&holes, Vec3::new(0.4, 0.3, 0.9));
    // A triangle that has lost its area is not in the tree.
    let mut fewer = holes.clone();
    let mut geometry = (*fewer.geometry).clone();
    let mut triangles = geometry.triangles.to_vec();
    triangles[0] = [triangles[0][0]; 3];
    geometry.triangles = triangles.into();
    fewer.geometry = Arc::new(geometry);
    let source = Arc::new(Source::of(&holes));
    let mut picture = Picture::new(&gpu, &holes, [40, 30]);
    let mut pictures = Vec::new();
    for (scene, source) in [
        (&holes, Some(&source)),
        (&far, Some(&source)),
        (&solid, None),
        (&fewer, Some(&source)),
        (&holes, Some(&source)),
    ] {
        picture.rays.set_geometry(&gpu, &scene.geometry, source).unwrap();
        let (found, _) = picture.direct(&holes, 1);
        picture.rays = Rays::new(&gpu, &scene.geometry, source).unwrap();
        let (fresh, _) = picture.direct(&holes, 1);
        assert!(found == fresh, "picture {}", pictures.len());
        pictures.push(found);
    }
    assert!(pictures[0] == pictures[4]);
    for other in 1..4 {
        assert!(pictures[0] != pictures[other], "picture {other} is another one");
    }
}

/// Buffers of shaders are counted before any is made.
#[test]
fn too_few_buffers_are_named() {
    assert!(check_buffers(8, "adapter").is_ok());
    let error = check_buffers(7, "adapter").unwrap_err().to_string();
    for part in ["adapter", "7", "8", "holes", "--shadows maps", "--renderer cpu"] {
        assert!(error.contains(part), "{part}: {error}");
    }
}
