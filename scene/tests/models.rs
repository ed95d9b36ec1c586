//! Checks the scenes that are made for models without a scene file, on small models of each kind.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{ModelOptions, ModelScene, Scene, SceneConfig, SceneError, Sides, config::UpAxis};
use photonstream_shading::LightShape;
use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

type Point = [f32; 3];
type Quad = [Point; 4];

/// The six faces of a box, seen from outside or from within.
fn cuboid(low: Point, high: Point, inwards: bool) -> Vec<Quad> {
    let mut quads = Vec::new();
    for axis in 0..3 {
        for side in 0..2 {
            let corner = |a: usize, b: usize| {
                let mut point = [0.0; 3];
                point[axis] = [low, high][side][axis];
                point[(axis + 1) % 3] = [low, high][a][(axis + 1) % 3];
                point[(axis + 2) % 3] = [low, high][b][(axis + 2) % 3];
                point
            };
            let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if (side == 0) != inwards {
                quad.reverse();
            }
            quads.push(quad);
        }
    }
    quads
}

fn ground(half: f32) -> Quad {
    [[-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half], [-half, 0.0, -half]]
}

fn obj(quads: &[Quad]) -> String {
    let mut text = String::new();
    for quad in quads {
        quad.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
        writeln!(text, "f -4 -3 -2 -1").unwrap();
    }
    text
}

fn ply(quads: &[Quad]) -> String {
    let (vertices, faces) = (4 * quads.len(), quads.len());
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    quads.iter().flatten().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    (0..faces).map(|i| 4 * i).for_each(|i| writeln!(text, "4 {i} {} {} {}", i + 1, i + 2, i + 3).unwrap());
    text
}

/// A GLB file of one mesh, with further members of its JSON: nodes after the first, and others.
fn glb(quads: &[Quad], nodes: &str, others: &str) -> Vec<u8> {
    let corners: Vec<Point> = quads.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]).collect();
    let mut bin: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let length = bin.len();
    let number = 1 + nodes.matches("\"name\"").count();
    let all: Vec<String> = (0..number).map(|i| i.to_string()).collect();
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{{\"mesh\":0}}{nodes}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":{},\"type\":\"VEC3\",\
         \"min\":[-100,-100,-100],\"max\":[100,100,100]}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{length}}}],\"buffers\":[{{\"byteLength\":{length}}}]{others}}}",
        all.join(","),
        corners.len(),
    )
    .into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    let total = 12 + 8 + json.len() + 8 + bin.len();
    for (number, bytes) in
        [(total, &b""[..]), (json.len(), b"JSON"), (0, &json), (bin.len(), b"BIN\0"), (0, &bin)]
    {
        if number > 0 {
            file.extend((number as u32).to_le_bytes());
        }
        file.extend(bytes);
    }
    file
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    fn scene(&self, name: &str, content: impl AsRef<[u8]>) -> Scene {
        Scene::load(&self.write(name, content)).unwrap()
    }
}

fn choice<'s>(scene: &'s Scene, what: &str) -> Option<&'s str> {
    let start = format!("{what}: ");
    scene.choices.iter().find_map(|choice| choice.strip_prefix(&start))
}

/// A box on a plane without light or camera: seen from outside, all corners in the picture, a sun that lights the plane, no
/// second floor, an exposure; and the resolved text is the same scene without the model's own choices being made again.
#[test]
fn a_box_on_a_plane_is_shown_from_outside_in_the_sun() {
    let folder = Folder::new();
    let mut quads = cuboid([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], false);
    quads.push(ground(2.0));
    let scene = folder.scene("box.glb", glb(&quads, "", ""));
    assert_eq!(scene.name, "box");
    assert!(choice(&scene, "camera").unwrap().starts_with("outside"), "{:?}", scene.choices);
    assert_eq!(choice(&scene, "floor"), None);
    assert_eq!(choice(&scene, "up"), None, "glTF is Y up");
    assert_eq!(scene.lights.len(), 1);
    let LightShape::Directional { direction } = scene.lights[0].light.shape else { panic!("no sun") };
    assert!(direction.y < -0.5 && direction.dot(scene.camera.forward) > 0.0, "{direction}");
    for [x, y, z] in quads.into_iter().flatten() {
        let to = glam::Vec3::new(x, y, z) - scene.origin_m.as_vec3() - scene.camera.position;
        let depth = to.dot(scene.camera.forward);
        assert!((to.dot(scene.camera.up) / depth).abs() < scene.camera.tan_half_fov);
        assert!((to.dot(scene.camera.right) / depth).abs() < scene.camera.tan_half_fov * 4.0 / 3.0);
    }
    // Half a middle grey to four times as bright, for what lies in the sun: 10 W m⁻² on albedo 0.5 are 1.6 W m⁻² sr⁻¹.
    let lit = 1.6 * scene.render.exposure_ev.exp2();
    assert!((0.075..0.6).contains(&lit), "{lit}");
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.resolved_text), (scene.hash, &scene.resolved_text));
    assert!(again.choices.is_empty());
}

/// A closed room of 8 × 3 × 5 m: an eye within it that looks along its longest axis, and lamps within it.
#[test]
fn a_closed_room_is_shown_from_within_by_lamps() {
    let folder = Folder::new();
    let (low, high) = ([0.0, 0.0, 0.0], [8.0, 3.0, 5.0]);
    let mut quads = cuboid(low, high, true);
    quads.extend(cuboid([3.0, 0.0, 2.0], [4.0, 0.8, 3.0], false));
    let scene = folder.scene("room.glb", glb(&quads, "", ""));
    assert!(choice(&scene, "camera").unwrap().starts_with("inside"), "{:?}", scene.choices);
    let is_within = |point: glam::Vec3| {
        let point = point + scene.origin_m.as_vec3();
        point.cmpgt(low.into()).all() && point.cmplt(high.into()).all()
    };
    assert!(is_within(scene.camera.position));
    assert!(scene.camera.forward.x.abs() > 0.99, "{}", scene.camera.forward);
    assert!(!scene.lights.is_empty());
    for light in &scene.lights {
        let LightShape::Point { position } = light.light.shape else { panic!("{:?}", light.light) };
        assert!(is_within(position) && position.y + scene.origin_m.y as f32 > 1.5, "{position}");
    }
}

/// The same room without its front wall: seen from there, and lit by a sun that comes in.
#[test]
fn a_room_that_is_open_to_one_side_is_seen_from_there() {
    let folder = Folder::new();
    let mut quads = cuboid([0.0; 3], [2.0; 3], true);
    quads.retain(|quad| quad.iter().any(|[_, _, z]| *z < 1.0));
    assert_eq!(quads.len(), 5);
    let scene = folder.scene("stage.obj", obj(&quads));
    assert!(choice(&scene, "camera").unwrap().starts_with("into the room"), "{:?}", scene.choices);
    assert!(scene.camera.forward.z < -0.99 && scene.camera.position.z > 1.0);
    assert!(
        matches!(scene.lights[0].light.shape, LightShape::Directional { direction } if direction.z < 0.0)
    );
}

/// A scan of a body alone gets a grey material and a floor below it; a torn one reflects on both sides.
#[test]
fn a_scan_gets_a_material_and_a_floor() {
    let folder = Folder::new();
    let body = cuboid([-0.1, 0.2, -0.1], [0.1, 0.4, 0.1], false);
    let scene = folder.scene("scan.ply", ply(&body));
    assert_eq!(scene.object("floor").map(|id| scene.albedo(id).x), Some(0.5));
    let model = scene.object("model").unwrap();
    assert_eq!((scene.albedo(model).x, scene.objects[model.0 as usize].sides), (0.5, Sides::Front));
    let (low, _) = scene.bvh.bounds();
    let ground = f64::from(low.y) + scene.origin_m.y;
    assert!(ground < 0.2 && ground > 0.199, "{ground}");

    let mut torn = body;
    torn.retain(|quad| quad.iter().any(|[_, _, z]| *z < 0.0));
    torn.retain(|quad| quad.iter().any(|[_, y, _]| *y < 0.3));
    let scene = folder.scene("torn.ply", ply(&torn));
    let model = scene.object("model").unwrap();
    assert_eq!(scene.objects[model.0 as usize].sides, Sides::Both, "{:?}", scene.choices);
}

/// Models of 900 units are no 900 m; those of 30 are 30 m. What is asked for is taken as it is, and no choice.
#[test]
fn units_are_chosen_or_taken() {
    let folder = Folder::new();
    let of_size = |size: f32| cuboid([0.0; 3], [size, size * 0.5, size * 0.5], false);
    for (size, expected) in [(900.0, 9.0), (30.0, 30.0), (0.002, 2.0)] {
        let scene = folder.scene("size.obj", obj(&of_size(size)));
        let range = scene.objects.iter().find(|o| o.name.starts_with("model/")).unwrap().triangles.clone();
        let x = range.flat_map(|id| scene.geometry.triangle(id)).map(|v| v.x);
        let (low, high) = x.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
        assert!(((high - low) / expected - 1.0).abs() < 1e-5, "{size}: {}", high - low);
        assert!(choice(&scene, "unit").is_some());
    }
    let path = folder.write("asked.obj", obj(&of_size(900.0)));
    let options = ModelOptions { up_axis: Some(UpAxis::Z), unit_m: Some(0.0434) };
    let ModelScene { text, choices } = ModelScene::of(&path, &options).unwrap();
    assert!(text.contains("up_axis = \"z\", unit_m = 0.0434"), "{text}");
    assert!(!choices.iter().any(|c| c.starts_with("unit") || c.starts_with("up")));
}

/// The first perspective camera of a glTF file is taken, with its place, turn, angle and shape.
#[test]
fn the_camera_of_a_file_is_taken() {
    let folder = Folder::new();
    let turned = 0.5f64.sqrt();
    let nodes = format!(
        ",{{\"name\":\"flat\",\"camera\":0}},{{\"name\":\"eye\",\"camera\":1,\"translation\":[5,1,0],\"rotation\":[0,{turned},0,{turned}]}}"
    );
    let cameras = ",\"cameras\":[{\"type\":\"orthographic\",\"orthographic\":{\"xmag\":1,\"ymag\":1,\"zfar\":9,\"znear\":0}},\
                   {\"type\":\"perspective\",\"perspective\":{\"yfov\":0.5,\"znear\":0.1,\"aspectRatio\":2.0}}]";
    let scene = folder.scene("seen.glb", glb(&cuboid([-1.0; 3], [1.0; 3], false), &nodes, cameras));
    assert_eq!(choice(&scene, "camera"), Some("\"eye\", the first of the file"));
    let position = scene.camera.position.as_dvec3() + scene.origin_m;
    assert!(position.distance(glam::DVec3::new(5.0, 1.0, 0.0)) < 1e-3, "{position}");
    assert!((scene.camera.forward - glam::Vec3::NEG_X).length() < 1e-3, "{}", scene.camera.forward);
    assert!((scene.camera.tan_half_fov - 0.25f32.tan()).abs() < 1e-5);
    assert_eq!((scene.render.width, scene.render.height), (1200, 600));
}

/// Light of the file is all there is, and exposed for: a lamp of 100 cd is 0.15 W sr⁻¹.
#[test]
fn light_of_a_file_is_exposed_for() {
    let folder = Folder::new();
    let mut quads = cuboid([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], false);
    quads.push(ground(2.0));
    let nodes =
        ",{\"name\":\"lamp\",\"translation\":[0,3,2],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}";
    let lights = ",\"extensionsUsed\":[\"KHR_lights_punctual\"],\
                  \"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"intensity\":100}]}}";
    let scene = folder.scene("lit.glb", glb(&quads, nodes, lights));
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(choice(&scene, "light"), Some("what the file has: 1"));
    // 0.15 W sr⁻¹ at 3 to 4 m on albedo 0.5 is about 0.002 W m⁻² sr⁻¹: 6 stops to a middle grey of 0.15.
    assert!((5.0..9.0).contains(&scene.render.exposure_ev), "{}", scene.render.exposure_ev);
}

/// The same file gives the same text, wherever the working directory is; the text as a scene file gives the same scene.
#[test]
fn the_text_is_an_ordinary_scene_file() {
    let folder = Folder::new();
    let path = folder.write("a \"b\".obj", obj(&cuboid([0.0; 3], [1.0; 3], false)));
    let first = ModelScene::of(&path, &ModelOptions::default()).unwrap();
    assert_eq!(first, ModelScene::of(&path, &ModelOptions::default()).unwrap());
    assert!(first.choices.iter().all(|choice| first.text.contains(&format!("# - {choice}\n"))));
    let config = folder.write("scene.toml", &first.text);
    let scene = Scene::load(&config).unwrap();
    assert_eq!(scene.hash, Scene::load(&path).unwrap().hash);
    // Changed by hand.
    let mut config = SceneConfig::from_file(&config).unwrap();
    config.streaming.vsls = Some(10);
    assert_eq!(config.build().unwrap().streaming.vsls, 10);
}

/// What is no model, or not there, is told with the file and what to do, and without tables that nobody wrote.
#[test]
fn errors_name_the_model() {
    let folder = Folder::new();
    let missing = SceneConfig::from_file(&folder.0.path().join("not-there.glb")).unwrap_err();
    assert!(matches!(missing, SceneError::Read { .. }), "{missing}");
    for (name, content) in
        [("cut.glb", &b"glTF\x02\0"[..]), ("cut.ply", b"ply\nfor"), ("cut.obj", b"v 1 2\n")]
    {
        let path = folder.write(name, content);
        let text = SceneConfig::from_file(&path).unwrap_err().to_string();
        assert!(text.contains(name) && text.contains("; ") && !text.contains("object.model"), "{text}");
    }
    let dark = folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    let text = SceneConfig::from_file(&dark).unwrap_err().to_string();
    assert!(text.contains("flat.obj"), "{text}");
    assert!(!photonstream_scene::is_model(Path::new("scene.toml")));
    assert!(photonstream_scene::is_model(Path::new("A.GLB")));
}
