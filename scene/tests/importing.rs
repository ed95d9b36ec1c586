//! Checks meshes, materials and emitters of OBJ files.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError, Side, Sides};
use photonstream_shading::LightShape;
use proptest::prelude::*;
use std::{f32::consts::PI, fs, path::Path};

const MTL: &str = "newmtl white\nKd 0.7 0.6 0.5\nnewmtl lamp\nKd 0.2 0.2 0.2\nKe 17 12 4\n";

/// A floor and a lamp of 0.5 × 0.25 m that looks down, given by a quad; a second lamp of no parallelogram.
const OBJ: &str = "mtllib scene.mtl
g floor
usemtl white
v -1 0 1
v 1 0 1
v 1 0 -1
v -1 0 -1
f -4 -3 -2 -1
g ceiling
usemtl lamp
v 0 2 0
v 0.5 2 0
v 0.5 2 0.25
v 0 2 0.25
f -4 -3 -2 -1
g odd
v 0 1 0
v 0.5 1 0
v 0.4 1 0.5
v 0 1 0.25
f -4 -3 -2 -1
usemtl white
v 3 0 0
f 1 2 5
f 1 1 2
";

struct Files(tempfile::TempDir);

impl Files {
    fn new(obj: &str, mtl: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.obj"), obj).unwrap();
        fs::write(folder.path().join("scene.mtl"), mtl).unwrap();
        Self(folder)
    }

    fn build(&self, object: &str, keys: &str) -> Result<Scene, SceneError> {
        let text = format!(
            "camera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
             material.grey.albedo = 0.3\n[object.it]\n{object}\nobj = {{ path = \"scene.obj\" {keys} }}\n"
        );
        let roots = AssetRoots { folders: vec![self.0.path().to_owned()] };
        SceneConfig::from_text(&text, Path::new("x.toml"))?.build_with(&roots)
    }

    fn scene(&self, object: &str, keys: &str) -> Scene {
        self.build(object, keys).unwrap_or_else(|e| panic!("{e}"))
    }
}

fn names(scene: &Scene) -> Vec<&str> {
    scene.objects.iter().map(|o| o.name.as_str()).collect()
}

#[test]
fn each_group_and_material_is_an_object() {
    let scene = Files::new(OBJ, MTL).scene("", "");
    assert_eq!(names(&scene), ["it/ceiling/lamp", "it/floor/white", "it/odd/lamp", "it/odd/white"]);
    let materials: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(materials, ["grey", "it/lamp", "it/white"]);
    assert_eq!(scene.albedo(scene.object("it/floor/white").unwrap()), Vec3::new(0.7, 0.6, 0.5));
    // An emitter keeps its reflectance.
    assert_eq!(scene.albedo(scene.object("it/ceiling/lamp").unwrap()), Vec3::splat(0.2));
    assert_eq!(scene.notices, ["object \"it/odd/white\": 1 of 2 triangles have no area and were left out"]);
    assert_eq!(scene.geometry.triangles.len(), 7);
}

#[test]
fn a_quad_emitter_is_one_light_of_its_radiance() {
    let scene = Files::new(OBJ, MTL).scene("", "");
    let id = scene.object("it/ceiling/lamp").unwrap();
    let light = scene.light("it/ceiling/lamp").unwrap();
    assert_eq!(scene.objects[id.0 as usize].emitter, Some(light));
    let light = &scene.lights[light.0 as usize];
    assert_eq!(light.object, Some(id));
    assert!(matches!(light.light.shape, LightShape::Parallelogram { .. }));
    // P = π A Ke; f32: 1e-6.
    let expected = Vec3::new(17.0, 12.0, 4.0) * PI * 0.125;
    assert!((light.light.power / expected - 1.0).abs().max_element() < 1e-6, "{}", light.light.power);
    assert!((scene.emitted_radiance(id, Side::Front) - Vec3::new(17.0, 12.0, 4.0)).length() < 1e-5);
    assert_eq!(light.light.shape.emitter_normal(), Vec3::NEG_Y);
}

#[test]
fn other_faces_are_triangle_lights_of_equal_radiance() {
    let scene = Files::new(OBJ, MTL).scene("", "");
    let id = scene.object("it/odd/lamp").unwrap();
    let lights: Vec<_> = scene.lights.iter().filter(|l| l.object == Some(id)).collect();
    assert_eq!(
        lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(),
        ["it/odd/lamp/0", "it/odd/lamp/1"]
    );
    assert_eq!(scene.objects[id.0 as usize].emitter, scene.light("it/odd/lamp/0"));
    let area: f32 = lights.iter().map(|l| l.light.shape.area()).sum();
    // Shoelace: corners (0,0) (0.5,0) (0.4,0.5) (0,0.25).
    assert!((area - 0.175).abs() < 1e-6, "{area}");
    for light in lights {
        assert!(matches!(light.light.shape, LightShape::Triangle { .. }));
        assert!((light.light.emitted_radiance() - Vec3::new(17.0, 12.0, 4.0)).length() < 1e-5);
    }
}

#[test]
fn emitters_follow_scale_mirroring_and_sides() {
    let files = Files::new(OBJ, MTL);
    for (keys, area, normal) in [
        ("scale = 2", 0.5, Vec3::NEG_Y),
        ("scale = [-2, 1, 3]", 0.75, Vec3::NEG_Y),
        ("scale = [1, -1, 1]", 0.125, Vec3::Y),
        ("rotation_deg = [0, 0, 90]", 0.125, Vec3::X),
        ("sides = \"back\"", 0.125, Vec3::Y),
    ] {
        let scene = files.scene(keys, "");
        let object = scene.object("it/ceiling/lamp").unwrap();
        let light = &scene.lights[scene.light("it/ceiling/lamp").unwrap().0 as usize].light;
        assert!((light.shape.area() - area).abs() < 1e-6, "{keys}");
        assert!(
            (light.shape.emitter_normal() - normal).length() < 1e-6,
            "{keys}: {}",
            light.shape.emitter_normal()
        );
        let object = &scene.objects[object.0 as usize];
        assert!((scene.geometry.normals[object.triangles.start as usize] - normal).length() < 1e-6, "{keys}");
        assert_eq!(object.sides, Sides::Front);
        assert!((light.emitted_radiance() - Vec3::new(17.0, 12.0, 4.0)).length() < 1e-5);
    }
}

#[test]
fn a_material_replaces_reflectances_and_parts_can_be_left_out() {
    let files = Files::new(OBJ, MTL);
    let scene = files.scene("material = \"grey\"", "");
    assert!(scene.objects.iter().all(|o| scene.materials[o.material.0 as usize].name == "grey"));
    assert_eq!(scene.lights.len(), 3);
    assert_eq!(names(&files.scene("", ", exclude = [\"odd\"]")), ["it/ceiling/lamp", "it/floor/white"]);
    assert_eq!(names(&files.scene("", ", exclude = [\"lamp\"]")), ["it/floor/white", "it/odd/white"]);
    assert_eq!(
        names(&files.scene("", ", exclude = [\"odd/lamp\", \"floor\"]")),
        ["it/ceiling/lamp", "it/odd/white"]
    );
    let error = files.build("", ", exclude = [\"ceilling\"]").unwrap_err().to_string();
    assert!(
        error.ends_with(
            "exclude: no group or material of the file is called \"ceilling\", did you mean \"ceiling\"?"
        ),
        "{error}"
    );
}

#[test]
fn the_hash_depends_on_content_not_on_place() {
    let (a, b) = (Files::new(OBJ, MTL), Files::new(OBJ, MTL));
    let scene = a.scene("", "");
    assert_eq!(scene.hash, b.scene("", "").hash);
    assert_ne!(scene.resolved_text, b.scene("", "").resolved_text);
    assert!(scene.resolved_text.contains(a.0.path().to_str().unwrap()));
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.geometry), (scene.hash, &scene.geometry));
    assert_eq!((&again.lights, &again.objects), (&scene.lights, &scene.objects));
    assert_ne!(scene.hash, Files::new(&OBJ.replace("0.25", "0.26"), MTL).scene("", "").hash);
    assert_ne!(scene.hash, Files::new(OBJ, &MTL.replace("17", "18")).scene("", "").hash);
}

#[test]
fn bad_files_are_explained() {
    for (obj, mtl, object, expected) in [
        ("f 1 2 3\n", MTL, "", "scene.obj: not a valid OBJ file: "),
        ("v 1 2 x\n", MTL, "", "scene.obj: not a valid OBJ file: line 1: found \"x\", expected a number"),
        ("v 0 0 0\n", MTL, "", "scene.obj: no faces are left of it; check the file and `exclude`"),
        (OBJ, "newmtl white\nKd 1 x 1\n", "", "scene.mtl: material parse error"),
        (
            OBJ,
            "newmtl white\nKd 1 2\n",
            "",
            "scene.mtl: line 2: found `Kd 1 2`, expected one or three numbers",
        ),
        (OBJ, &MTL.replace("0.7", "-1"), "", "material \"white\": found Kd [-1, 0.6"),
        (
            OBJ,
            &MTL.replace("17", "inf"),
            "",
            "material \"lamp\": found Ke [inf, 12, 4], expected numbers from 0 to 1e12",
        ),
        (&OBJ.replace("scene.mtl", "other.mtl"), MTL, "", "other.mtl cannot be read ("),
        (
            &OBJ.replace("v 1 0 1", "v nan 0 1"),
            MTL,
            "",
            "not a valid OBJ file: line 5: found \"nan\", expected a number",
        ),
    ] {
        let error = Files::new(obj, mtl).build(object, "").unwrap_err().to_string();
        assert!(error.starts_with("x.toml:") && error.contains(expected), "{error}\n{expected}");
    }
    // With a material of its own an object needs no material file.
    let scene = Files::new(&OBJ.replace("scene.mtl", "other.mtl"), MTL).scene("material = \"grey\"", "");
    assert!(scene.notices.iter().any(|n| n.contains("other.mtl cannot be read")), "{:?}", scene.notices);
}

#[test]
fn odd_materials_are_noticed() {
    let scene = Files::new(OBJ, &MTL.replace("0.7 0.6 0.5", "1.2 0.6 0.5\nmap_Kd a.png")).scene("", "");
    assert_eq!(scene.albedo(scene.object("it/floor/white").unwrap()), Vec3::new(1.0, 0.6, 0.5));
    assert!(
        scene.notices.iter().any(|n| n.contains("Kd [1.2") && n.contains("at most 1")),
        "{:?}",
        scene.notices
    );
    // The texture is not there.
    assert!(
        scene
            .notices
            .iter()
            .any(|n| n.contains("a.png cannot be read (") && n.ends_with("; Kd is used alone")),
        "{:?}",
        scene.notices
    );
    let scene = Files::new(OBJ, &MTL.replace("0.7 0.6 0.5", "0.4 # grey")).scene("", "");
    assert_eq!(scene.albedo(scene.object("it/floor/white").unwrap()), Vec3::splat(0.4));
    let scene = Files::new("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "").scene("", "");
    assert_eq!(names(&scene), ["it/unnamed_object/none"]);
    assert!(scene.notices[0].contains("faces without a known material have albedo 0.5"));
}

/// Without a texture nothing is kept of texture coordinates, nor of normals where the triangles are shown; those that are not there are an error all the same.
#[test]
fn texture_coordinates_and_normals_change_no_mesh_without_a_texture() {
    let plain = Files::new("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "").scene("", "");
    let full = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/-1/1 \\\n 3//1\ns 1\n";
    assert_eq!(Files::new(full, "").scene("", ", smooth = false").geometry, plain.geometry);
    for (bad, expected) in [
        (
            "-9223372036854775808",
            "line 6: it names texture coordinate -9223372036854775808, but there are 2 so far",
        ),
        ("3", "line 6: it names texture coordinate 3"),
        ("0", "line 6: it names texture coordinate 0"),
        ("x", "line 6: found \"x\", expected the number of a texture coordinate"),
    ] {
        let text = full.replace("vn 0 0 1\n", "").replace("1/1/1", "1/1").replace("3//1", "3");
        let text = text.replace("2/-1/1 \\\n", &format!("2/{bad} "));
        let error = Files::new(&text, "").build("", "").unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// A pair counts before a material, that before a group; what is not there is an error.
#[test]
fn materials_are_replaced_by_name() {
    let files = Files::new(OBJ, MTL);
    let scene = files.scene("", ", materials = { white = \"grey\" }");
    let albedo = |scene: &Scene, name: &str| scene.albedo(scene.object(name).unwrap());
    assert_eq!(albedo(&scene, "it/floor/white"), Vec3::splat(0.3));
    assert_eq!(albedo(&scene, "it/odd/white"), Vec3::splat(0.3));
    assert_eq!(albedo(&scene, "it/odd/lamp"), Vec3::splat(0.2));
    // An emitter stays one.
    let scene = files.scene("", ", materials = { odd = \"grey\", \"floor/white\" = \"grey\" }");
    assert_eq!(albedo(&scene, "it/odd/lamp"), Vec3::splat(0.3));
    assert!(scene.light("it/odd/lamp/0").is_some());
    assert_eq!(albedo(&scene, "it/ceiling/lamp"), Vec3::splat(0.2));
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((&again.materials, again.hash), (&scene.materials, scene.hash));
    for (keys, expected) in [("wihte = \"grey\"", "white"), ("white = \"gray\"", "grey")] {
        let error = files.build("", &format!(", materials = {{ {keys} }}")).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("materials"), "{error}");
    }
}

/// Groups are renamed too, and a lamp shines from behind.
#[test]
fn single_objects_are_otherwise() {
    let files = Files::new(OBJ, MTL);
    let scene = files.scene(
        "",
        ", parts = { ceiling = { rename = \"a\", sides = \"back\" }, floor = { sides = \"both\" } }",
    );
    assert_eq!(names(&scene), ["it/a", "it/floor/white", "it/odd/lamp", "it/odd/white"]);
    assert_eq!(scene.lights[scene.light("it/a").unwrap().0 as usize].light.shape.emitter_normal(), Vec3::Y);
    assert_eq!(scene.objects.iter().filter(|o| o.sides == Sides::Both).count(), 1);
    let error = files.build("", ", parts = { odd = { rename = \"a\" } }").unwrap_err().to_string();
    assert!(error.contains("2 objects called \"odd\": \"it/odd/lamp\", \"it/odd/white\""), "{error}");
}

/// Clear panes are not there for light, nor for the eye.
#[test]
fn light_passes_what_transmits() {
    let scene = Files::new(OBJ, MTL).scene("", ", transmit = [\"lamp\"]");
    assert_eq!(names(&scene), ["it/floor/white", "it/odd/white"]);
    assert!(scene.lights.is_empty());
    let error = Files::new(OBJ, MTL).build("", ", transmit = [\"lmap\"]").unwrap_err().to_string();
    assert!(error.contains("transmit") && error.contains("lamp"), "{error}");
}

/// A quad with a corner pushed in is cut along the diagonal that stays inside.
#[test]
fn concave_quads_keep_their_area() {
    let obj = "v 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nf 1 2 3 4\nf 2 3 4 1\n";
    let scene = Files::new(obj, "").scene("", "");
    let area: f64 = (0..4).map(|id| photonstream_shading::surface::area(scene.geometry.triangle(id))).sum();
    assert!((area - 2.0).abs() < 1e-6, "{area}");
    assert!(scene.geometry.normals.iter().all(|n| *n == Vec3::Z));
}

proptest! {
    // 256 cases, seed 1, so that a run repeats; PROPTEST_CASES asks for more.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_assets_never_panic(
        edits in proptest::collection::vec((any::<bool>(), 0usize..1000, "[-0-9.e/ \na-z]{0,3}"), 1..5)
    ) {
        let (mut obj, mut mtl) = (OBJ.to_owned(), MTL.to_owned());
        for (in_obj, at, with) in edits {
            let text = if in_obj { &mut obj } else { &mut mtl };
            let at = at % (text.len() - 1);
            text.replace_range(at..=at, &with);
        }
        _ = Files::new(&obj, &mtl).build("", "");
    }
}
