//! Checks the shading normals that OBJ and PLY files give, and those that smoothing groups make.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig};
use std::{fs, path::Path};

/// A box from (-1, -1, -1) to (1, 1, 1) by quadrilaterals, `s` before the first and the fourth of them.
fn cube([first, fourth]: [&str; 2]) -> String {
    let corners = (0..8).map(|i| format!("v {} {} {}\n", i % 2 * 2 - 1, i / 2 % 2 * 2 - 1, i / 4 * 2 - 1));
    corners.collect::<String>()
        + &format!("{first}\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\n{fourth}\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n")
}

fn load(name: &str, content: &str, object: &str, keys: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), content).unwrap();
    let kind = name.rsplit_once('.').unwrap().1;
    let text = format!(
        "origin_m = [0, 0, 0]\ncamera = {{ position_m = [0, 1, 9], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
         material.grey.albedo = 0.3\n[object.it]\nmaterial = \"grey\"\n{object}\n{kind} = {{ path = {name:?} {keys} }}\n"
    );
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    SceneConfig::from_text(&text, Path::new("x.toml")).unwrap().build_with(&roots).unwrap()
}

/// The place and shading normal of every corner of every triangle; that of the triangle where it is flat.
fn corners(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let of = |t: u32| {
        let normals = scene.corner_normals(t).unwrap_or([scene.geometry.normals[t as usize]; 3]);
        scene.geometry.triangle(t).into_iter().zip(normals)
    };
    (0..scene.geometry.triangles.len() as u32).flat_map(of).collect()
}

/// Three faces of equal angles meet at each corner of a box: their mean leads along the diagonal, whatever the triangles are
/// that they are cut into. To 2e-7: normals are rounded to f32 twice.
#[test]
fn a_smoothing_group_has_the_mean_of_its_faces() {
    let scene = load("a.obj", &cube(["s 1", "s 1"]), "", "");
    assert_eq!(scene.geometry.triangles.len(), 12);
    for (place, normal) in corners(&scene) {
        assert!((normal - place / 3f32.sqrt()).length() < 2e-7, "{place}: {normal}");
    }
    // Between the corners it is their weighted sum.
    let t = (0..12).find(|&t| scene.geometry.normals[t] == Vec3::Z).unwrap() as u32;
    let middle = |[u, v]: [f32; 2]| scene.shading_normal(t, [u, v]);
    let [a, b, c] = scene.corner_normals(t).unwrap();
    assert!((middle([0.25, 0.5]) - (a * 0.25 + b * 0.25 + c * 0.5).normalize()).length() < 2e-7);
}

#[test]
fn faces_without_a_group_and_other_groups_are_apart() {
    for flat in ["", "s off", "s 0"] {
        let scene = load("a.obj", &cube([flat, flat]), "", "");
        assert!(scene.geometry.own_normals.is_empty(), "{flat}");
    }
    let flat = load("a.obj", &cube(["s 1", "s 1"]), "", ", smooth = false");
    assert!(flat.geometry.own_normals.is_empty());
    // The faces -z, +z and -y of one group; +y, -x and +x of another: no two of a group meet at all three axes.
    let scene = load("a.obj", &cube(["s 1", "s 2"]), "", "");
    for t in 0..12 {
        let face = scene.geometry.normals[t as usize];
        let first = face.z != 0.0 || face.y < 0.0;
        for (place, normal) in scene.geometry.triangle(t).into_iter().zip(scene.corner_normals(t).unwrap()) {
            let z = Vec3::new(0.0, 0.0, place.z);
            let x = Vec3::new(place.x, 0.0, 0.0);
            let mean = match (first, place.y < 0.0) {
                (true, true) => z - Vec3::Y,
                (true, false) => z,
                (false, true) => x,
                (false, false) => x + Vec3::Y,
            };
            assert!(
                (normal - mean.normalize()).length() < 2e-7,
                "{face} at {place}: {normal}, expected {mean}"
            );
        }
    }
    // One group and none: the flat half stays flat.
    let scene = load("a.obj", &cube(["s 1", "s off"]), "", "");
    let flat = (0..12).filter(|&t| scene.corner_normals(t).is_none()).count();
    assert_eq!(flat, 6);
}

/// Given normals count before groups; they turn and stretch as planes do, inverse to the scale.
#[test]
fn normals_of_a_file_follow_their_object() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nvn 0 0 3\ns 1\nf 1//1 2//2 3//-1\n";
    let place = "scale = [2, 1, 4]\nrotation_deg = [0, 90, 0]";
    for (up, turned) in [("", Vec3::new(0.6, 0.0, 0.8)), (", up_axis = \"z\"", Vec3::new(0.6, 0.8, 0.0))] {
        let scene = load("a.obj", obj, place, up);
        // A quarter turn about y takes x to -z and z to x.
        let scaled = turned / Vec3::new(2.0, 1.0, 4.0);
        let expected = Vec3::new(scaled.z, scaled.y, -scaled.x).normalize();
        let [a, b, c] = scene.corner_normals(0).unwrap();
        assert!((a - expected).length() < 3e-7, "{up}: {a}, expected {expected}");
        assert!((b - scene.geometry.normals[0]).length() < 3e-7 && b == c, "{up}: {b}");
    }
    // Mirrored, the outside stays outside; moved and resized later as if loaded so.
    let mirrored = load("a.obj", obj, "scale = [-1, 1, 1]", "");
    let [a, ..] = mirrored.corner_normals(0).unwrap();
    assert!(
        (a - Vec3::new(-0.6, 0.0, 0.8)).length() < 3e-7 && mirrored.geometry.normals[0] == Vec3::Z,
        "{a}"
    );
    let mut edit = load("a.obj", obj, "", "").edit();
    let values = toml::from_str(place).unwrap();
    edit.move_object("it", &values).unwrap();
    let edited = edit.finish();
    assert_eq!(edited.corner_normals(0), load("a.obj", obj, place, "").corner_normals(0));
}

/// What is no direction, or leads away from its face, leaves the triangle flat.
#[test]
fn unusable_normals_are_flat() {
    for bad in ["0 0 0", "0 0 -1", "1 0 0.1"] {
        let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn {bad}\nf 1//1 2//1 3//1\n");
        let scene = load("a.obj", &obj, "", "");
        assert_eq!(scene.shading_normal(0, [0.3, 0.3]), Vec3::Z, "{bad}");
    }
}

#[test]
fn ply_files_have_normals_of_their_vertices() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float nx\nproperty float ny\nproperty float nz\n\
                  property float x\nproperty float y\nproperty float z\nelement face 1\n\
                  property list uchar int vertex_indices\nend_header\n";
    let ply = format!("{header}0.6 0 0.8 0 0 0\n0 0 1 1 0 0\n0 0.6 0.8 0 1 0\n3 0 1 2\n");
    let scene = load("a.ply", &ply, "", "");
    assert_eq!(
        scene.corner_normals(0).unwrap(),
        [Vec3::new(0.6, 0.0, 0.8), Vec3::Z, Vec3::new(0.0, 0.6, 0.8)].map(Vec3::normalize)
    );
    assert!(load("a.ply", &ply, "", ", smooth = false").corner_normals(0).is_none());
}
