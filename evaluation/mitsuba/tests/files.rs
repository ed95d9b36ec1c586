//! Checks the files written for Mitsuba: well-formed XML, meshes equal to the scene's, lights in the units of closed forms.
#![allow(clippy::unwrap_used)]

use core::f64::consts::PI;
use glam::Vec3;
use photonstream_mitsuba::{self as mitsuba, DIRECT_MAX_DEPTH, spot};
use photonstream_scene::{Scene, SceneConfig};
use photonstream_shading::LightShape;
use roxmltree::{Document, Node};
use std::{fs, path::Path};
use tempfile::TempDir;

/// Every light shape, every value of `sides`, names that XML would mind, a ball that moves.
const SCENE: &str = include_str!("../all-lights.toml");

fn scene_at(time_s: f64) -> Scene {
    let config = SceneConfig::from_text(SCENE, Path::new("all.toml")).unwrap();
    config.at(time_s).unwrap().build().unwrap()
}

fn exported(scene: &Scene) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    mitsuba::export(scene, folder.path()).unwrap();
    let text = fs::read_to_string(folder.path().join("scene.xml")).unwrap();
    (folder, text)
}

fn of_type<'a>(document: &'a Document<'a>, tag: &str, kind: &str) -> Vec<Node<'a, 'a>> {
    let fits = |n: &Node<'_, '_>| n.has_tag_name(tag) && n.attribute("type") == Some(kind);
    document.descendants().filter(fits).collect()
}

/// The property called `name` directly in `node`.
fn property<'a>(node: Node<'a, 'a>, name: &str) -> &'a str {
    let found = node.children().find(|n| n.attribute("name") == Some(name));
    found.unwrap_or_else(|| panic!("{node:?} has no {name}")).attribute("value").unwrap()
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(',').map(|n| n.trim().parse().unwrap()).collect()
}

fn assert_near(got: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(got.len(), expected.len());
    for (g, e) in got.iter().zip(expected) {
        assert!((g - e).abs() <= relative * e.abs(), "{got:?}, expected {expected:?}");
    }
}

/// Vertices and faces of a mesh as written.
fn read_ply(path: &Path) -> (Vec<Vec3>, Vec<[usize; 3]>) {
    let bytes = fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|l| l.strip_prefix(element)).unwrap();
        line.trim().parse().unwrap()
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    assert_eq!(bytes.len(), end + vertices * 12 + faces * 13);
    let (positions, rest) = bytes[end..].split_at(vertices * 12);
    let float = |b: &[u8]| f32::from_le_bytes(b.try_into().unwrap());
    let vertex = |v: &[u8]| Vec3::new(float(&v[..4]), float(&v[4..8]), float(&v[8..]));
    let face = |f: &[u8]| {
        assert_eq!(f[0], 3);
        [1, 5, 9].map(|at| i32::from_le_bytes(f[at..at + 4].try_into().unwrap()) as usize)
    };
    (positions.chunks(12).map(vertex).collect(), rest.chunks(13).map(face).collect())
}

/// Every mesh has the triangles of its object, coordinates and windings bit for bit; the moved sphere where it is then.
#[test]
fn meshes_are_the_scenes() {
    for time_s in [0.0, 1.0] {
        let scene = scene_at(time_s);
        let (folder, text) = exported(&scene);
        let document = Document::parse(&text).unwrap();
        let shapes = of_type(&document, "shape", "ply");
        assert_eq!(shapes.len(), scene.objects.len());
        for (shape, object) in shapes.into_iter().zip(&scene.objects) {
            let (vertices, faces) = read_ply(&folder.path().join(property(shape, "filename")));
            assert_eq!(faces.len(), object.triangles.len());
            for (face, triangle) in faces.iter().zip(object.triangles.clone()) {
                assert_eq!(face.map(|v| vertices[v]), scene.geometry.triangle(triangle), "{}", object.name);
            }
            let mut used: Vec<_> = faces.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            assert_eq!(used.len(), vertices.len(), "a vertex that no face uses");
            assert_eq!(property(shape, "face_normals"), "true");
        }
        let ball = scene.object("ball & <chain>").unwrap();
        let first = scene.objects[ball.0 as usize].triangles.start;
        let z = scene.geometry.triangle(first).iter().map(|v| v.z).sum::<f32>() / 3.0;
        assert!(
            (f64::from(z) + 0.5 * time_s).abs() < 0.25,
            "the ball's centre is at z = -t/2, its radius 0.25: {z}"
        );
        let own = fs::read_to_string(folder.path().join("scene.toml")).unwrap();
        assert_eq!(Scene::from_resolved(&own).unwrap().geometry.vertices, scene.geometry.vertices);
    }
}

/// A side that does not reflect is black: `diffuse` is one-sided, `twosided` has front and back.
#[test]
fn sides_reflect_as_the_scene_says() {
    let scene = scene_at(0.0);
    let (_folder, text) = exported(&scene);
    let document = Document::parse(&text).unwrap();
    for (name, kind, colours) in [
        ("floor", "diffuse", vec!["0.5, 0.25, 0.125"]),
        ("ball & <chain>", "twosided", vec!["0, 0, 0", "0.8, 0.8, 0.8"]),
        ("paper", "twosided", vec!["0.8, 0.8, 0.8"]),
        ("panel", "diffuse", vec!["0.5, 0.5, 0.5"]),
    ] {
        let index = scene.object(name).unwrap().0 as usize;
        let shape = of_type(&document, "shape", "ply")[index];
        let bsdf = shape.children().find(|n| n.has_tag_name("bsdf")).unwrap();
        assert_eq!(bsdf.attribute("type"), Some(kind), "{name}");
        let found: Vec<_> = bsdf
            .descendants()
            .filter(|n| n.attribute("name") == Some("reflectance"))
            .map(|n| n.attribute("value").unwrap())
            .collect();
        assert_eq!(found, colours, "{name}");
    }
}

/// Point: I = P/4π. Directional: E. Area: L = P/(π A). Values are rounded to f32 once or twice: 1e-6.
#[test]
fn lights_have_the_units_of_closed_forms() {
    let (_folder, text) = exported(&scene_at(0.0));
    let document = Document::parse(&text).unwrap();
    let point = of_type(&document, "emitter", "point");
    assert_eq!(point.len(), 1, "a light without power is left out");
    assert_near(&numbers(property(point[0], "intensity")), &[40.0, 20.0, 10.0].map(|p| p / (4.0 * PI)), 1e-6);
    let position = point[0].children().find(|n| n.has_tag_name("point")).unwrap();
    assert_eq!(["x", "y", "z"].map(|a| position.attribute(a).unwrap()), ["0.5", "1", "0.25"]);
    let sun = of_type(&document, "emitter", "directional");
    assert_near(&numbers(property(sun[0], "irradiance")), &[3.0, 2.0, 1.0], 1e-6);
    let area = of_type(&document, "emitter", "area");
    assert_eq!(area.len(), 1);
    assert_near(&numbers(property(area[0], "radiance")), &[12.0, 6.0, 3.0].map(|p| p / (PI * 0.5)), 1e-6);
}

/// The power of a cone that falls linearly from `beam` to `cutoff` (rad) with intensity 1 on its axis.
fn watts_of_cone(beam: f64, cutoff: f64) -> f64 {
    if beam == cutoff {
        return 2.0 * PI * (1.0 - beam.cos());
    }
    2.0 * PI * (1.0 - (cutoff.sin() - beam.sin()) / (cutoff - beam))
}

/// The cones of each spot emit its power together: 2π Σ I (1 − (sin b − sin a)/(b − a)) = P. The soft edge consists of
/// straight lines, whose error of at most 0.04 % of the axis' intensity cancels almost: 0.01 %.
#[test]
fn spots_emit_their_power() {
    let (_folder, text) = exported(&scene_at(0.0));
    let document = Document::parse(&text).unwrap();
    let cones = of_type(&document, "emitter", "spot");
    let (mut soft, mut hard) = (vec![0.0; 3], vec![0.0; 3]);
    for &cone in &cones {
        let angle = |name| property(cone, name).parse::<f64>().unwrap().to_radians();
        let watts = watts_of_cone(angle("beam_width"), angle("cutoff_angle"));
        let sum = if angle("beam_width") == angle("cutoff_angle") { &mut hard } else { &mut soft };
        for (sum, intensity) in sum.iter_mut().zip(numbers(property(cone, "intensity"))) {
            *sum += intensity * watts;
        }
    }
    assert_eq!(cones.len(), spot::PIECES as usize + 1);
    assert_near(&soft, &[9.0, 6.0, 3.0], 1e-4);
    assert_near(&hard, &[7.0; 3], 1e-6);
}

/// The cones have the intensity of our spot at every angle: 1 000 angles, to 0.04 % of that on the axis (what the
/// interpolation takes, see `PIECES`), from narrow spots to those that shine backwards.
#[test]
fn cones_follow_the_smooth_edge() {
    let versine = |deg: f64| (2.0 * (deg.to_radians() / 2.0).sin().powi(2)) as f32;
    for (inner, outer) in [(1.0, 2.0), (0.0, 30.0), (30.0, 55.0), (80.0, 100.0), (90.0, 180.0)] {
        let shape = LightShape::Spot {
            position: Vec3::ZERO,
            direction: Vec3::Z,
            versine_inner: versine(inner),
            versine_outer: versine(outer),
        };
        let cones = spot::cones(versine(inner), versine(outer));
        assert!((cones.iter().map(|c| c.share).sum::<f64>() - 1.0).abs() < 1e-6);
        assert!(cones.iter().all(|c| c.share > 0.0 && c.beam_width_deg <= c.cutoff_angle_deg));
        let on_axis = 1.0 / (PI * f64::from(versine(inner) + versine(outer)));
        for step in 0..1000 {
            let angle = (outer * 1.1).min(180.0) * (f64::from(step) + 0.5) / 1000.0;
            let theirs: f64 = cones
                .iter()
                .map(|c| {
                    let width = c.cutoff_angle_deg - c.beam_width_deg;
                    c.share * ((c.cutoff_angle_deg - angle) / width).clamp(0.0, 1.0)
                })
                .sum();
            let (sin, cos) = angle.to_radians().sin_cos();
            let ours = shape.illuminate(Vec3::new(sin as f32, 0.0, cos as f32), [0.5; 2]);
            let ours = ours.map_or(0.0, |i| f64::from(i.irradiance.x)) / on_axis;
            assert!((ours - theirs).abs() < 4e-4, "{inner}–{outer}° at {angle}°: {ours} and {theirs}");
        }
    }
}

/// Camera and film: position in the scene's space, field of view from bottom to top, size as parameters, box filter;
/// both variants include the scene.
#[test]
fn the_camera_is_the_scenes() {
    let (folder, text) = exported(&scene_at(0.0));
    let document = Document::parse(&text).unwrap();
    let sensor = of_type(&document, "sensor", "perspective")[0];
    assert_eq!(property(sensor, "fov_axis"), "y");
    assert_near(&numbers(property(sensor, "fov")), &[40.0], 1e-6);
    let look = sensor.descendants().find(|n| n.has_tag_name("lookat")).unwrap();
    assert_eq!(look.attribute("origin"), Some("0, 1, 4"));
    let along: Vec<_> =
        numbers(look.attribute("target").unwrap()).iter().zip([0.0, 1.0, 4.0]).map(|(t, o)| t - o).collect();
    let length = (0.0625f64 + 16.0).sqrt();
    // The target is rounded to f32 at 4 m.
    assert!((along[1] + 0.25 / length).abs() < 1e-6 && (along[2] + 4.0 / length).abs() < 1e-6, "{along:?}");
    assert_eq!(document.descendants().filter(|n| n.attribute("type") == Some("box")).count(), 1);
    let default = |document: &Document<'_>, name: &str| {
        let mut nodes = document.descendants().filter(|n| n.has_tag_name("default"));
        let node = nodes.find(|n| n.attribute("name") == Some(name)).unwrap();
        node.attribute("value").unwrap().to_owned()
    };
    assert_eq!([default(&document, "width"), default(&document, "height")], ["64", "56"]);
    for (file, depth) in [("direct.xml", DIRECT_MAX_DEPTH), ("full.xml", -1)] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        let document = Document::parse(&text).unwrap();
        assert_eq!(default(&document, "max_depth"), depth.to_string());
        let include = document.descendants().find(|n| n.has_tag_name("include")).unwrap();
        assert_eq!(include.attribute("filename"), Some("scene.xml"));
    }
}

/// A constant sky is Mitsuba's `constant`, another an `envmap` of the same radiances: the texel at a quarter of the width looks
/// at +X, the left edge at −Z.
#[test]
fn skies_are_written_as_constant_or_map() {
    let scene = |sky: &str| {
        let text =
            format!("{}\n[light.sky]\nsky = {{ {sky} }}\n", SCENE.replace("origin_m = [3000, 0, 0]", ""));
        SceneConfig::from_text(&text, Path::new("sky.toml")).unwrap().build().unwrap()
    };
    let (folder, text) = exported(&scene("radiance_w_m2_sr = [1, 2, 3], scale = 2"));
    let document = Document::parse(&text).unwrap();
    let [constant] = of_type(&document, "emitter", "constant")[..] else { panic!("one constant emitter") };
    assert_near(&numbers(property(constant, "radiance")), &[2.0, 4.0, 6.0], 1e-6);
    assert!(!folder.path().join("sky.exr").exists());

    let scene = scene("zenith_w_m2_sr = [1, 2, 3], horizon_w_m2_sr = 1, ground_w_m2_sr = 0.5, scale = 2");
    let (folder, text) = exported(&scene);
    let document = Document::parse(&text).unwrap();
    let [map] = of_type(&document, "emitter", "envmap")[..] else { panic!("one map") };
    assert_eq!(property(map, "filename"), "sky.exr");
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.0, vec![[0f32; 3]; size.area()]),
            |(width, texels), at, (r, g, b): (f32, f32, f32)| texels[at.1 * *width + at.0] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(folder.path().join("sky.exr"))
        .unwrap();
    let (width, texels) = &image.layer_data.channel_data.pixels;
    // Half a texel below the zenith, and below the horizon.
    assert!((Vec3::from(texels[0]) - Vec3::new(2.0, 4.0, 6.0)).abs().max_element() < 1e-4);
    assert_eq!(texels[texels.len() - width], [1.0; 3]);
}
