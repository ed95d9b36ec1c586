//! Checks that placed meshes keep areas, outward normals and shared corners, wherever the scene stands.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use photonstream_scene::{AssetRoots, Geometry, Scene, SceneConfig};
use photonstream_shading::surface;
use std::path::Path;

const HEAD: &str = r#"
camera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }
material.white.albedo = 0.7
"#;

fn build(text: &str) -> Scene {
    let config = SceneConfig::from_text(text, Path::new("test.toml")).unwrap_or_else(|e| panic!("{e}"));
    config.build_with(&AssetRoots::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn object(placed: &str) -> Scene {
    build(&format!("{HEAD}\n[object.thing]\nmaterial = \"white\"\n{placed}"))
}

/// Surface area, and volume by Gauss's theorem about the middle of the bounds: positive where normals point outwards.
fn area_and_volume(scene: &Scene) -> (f64, f64) {
    let g = &scene.geometry;
    (0..g.triangles.len() as u32).fold((0.0, 0.0), |(area, volume), id| {
        let t = g.triangle(id);
        let [a, b, c] = t.map(|v| (v - scene.bounds.centre).as_dvec3());
        (area + surface::area(t), volume + a.dot(b.cross(c)) / 6.0)
    })
}

/// Size, mirroring and pose of a 1 × 2 × 3 m box; f32 corners: relative error below 1e-5.
#[test]
fn mirrored_and_stretched_boxes_keep_area_volume_and_outward_normals() {
    for signs in 0..8 {
        let sign = |bit: i32| if signs >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let scale = [2.0 * sign(0), sign(1), 0.5 * sign(2)];
        for (rotation, position) in [([0.0; 3], [0.0; 3]), ([30.0, -70.0, 110.0], [5.0, -3.0, 12.0])] {
            let scene = object(&format!(
                "box = {{ size_m = [1, 2, 3] }}\nscale = {scale:?}\nrotation_deg = {rotation:?}\nposition_m = {position:?}"
            ));
            let (area, volume) = area_and_volume(&scene);
            // Edges 2, 2 and 1.5.
            assert!((area / 20.0 - 1.0).abs() < 1e-5, "{scale:?}: area {area}");
            assert!((volume / 6.0 - 1.0).abs() < 1e-5, "{scale:?}: volume {volume}");
            assert!(scene.features.is_closed());
            check_normals(&scene.geometry);
            check_rest_space(&scene);
            // The object at its final size, not turned.
            let (low, high) = extent(&scene.geometry.rest_vertices);
            assert_eq!(high - low, Vec3::new(2.0, 2.0, 1.5));
        }
    }
}

fn extent(vertices: &[Vec3]) -> (Vec3, Vec3) {
    vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)))
}

fn check_normals(geometry: &Geometry) {
    for (id, normal) in geometry.normals.iter().enumerate() {
        assert_eq!(Some(*normal), surface::normal(geometry.triangle(id as u32)));
    }
}

/// The rigid motion maps rest vertices onto world vertices, to the rounding of both.
fn check_rest_space(scene: &Scene) {
    let g = &scene.geometry;
    for object in &scene.objects {
        let m = object.world_from_rest.matrix3;
        assert!((m.transpose() * m - glam::DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-14));
        assert!((m.determinant() - 1.0).abs() < 1e-14);
        for id in object.triangles.clone() {
            assert_eq!(g.object_of[id as usize], scene.object(&object.name).unwrap());
            for (world, rest) in g.triangle(id).into_iter().zip(g.rest_triangle(id)) {
                let moved = object.world_from_rest.transform_point3(rest.as_dvec3());
                let size = world.abs().max_element().max(rest.abs().max_element());
                assert!((moved - world.as_dvec3()).length() <= 2.0 * f64::from(size * f32::EPSILON));
            }
        }
    }
}

/// A closed room of quads whose corners are no round numbers, with the corners of neighbours given alike or as sums.
fn room(shift: DVec3) -> String {
    let p = |x: f64, y: f64, z: f64| format!("{:?}", (DVec3::new(x, y, z) + shift).to_array());
    let quad = |name: &str, corner: String, u: &str, v: &str| {
        format!(
            "[object.{name}]\nmaterial = \"white\"\nquad = {{ corner_m = {corner}, edge_u_m = {u}, edge_v_m = {v} }}\n"
        )
    };
    // x from -1.1 to 0.7, y from 0.3 to 2.4, z from -0.9 to 1.3.
    let (x, y, z) = ("[1.8, 0, 0]", "[0, 2.1, 0]", "[0, 0, 2.2]");
    let (mx, mz) = ("[-1.8, 0, 0]", "[0, 0, -2.2]");
    [
        format!(
            "camera = {{ position_m = {}, target_m = {}, vertical_fov_deg = 40 }}\nmaterial.white.albedo = 0.7\n",
            p(0.1, 1.1, 1.1),
            p(0.0, 1.0, 0.0)
        ),
        quad("floor", p(-1.1, 0.3, 1.3), x, mz),
        quad("ceiling", p(-1.1, 2.4, -0.9), x, z),
        quad("back", p(-1.1, 0.3, -0.9), x, y),
        quad("front", p(0.7, 0.3, 1.3), mx, y),
        quad("left", p(-1.1, 0.3, 1.3), mz, y),
        quad("right", p(0.7, 0.3, -0.9), z, y),
        format!(
            "[object.ball]\nmaterial = \"white\"\nposition_m = {}\nrotation_deg = [10, 20, 30]\n\
             scale = [0.2, 0.3, -0.4]\nsphere = {{ radius_m = 1, segments = 12 }}\n",
            p(-0.2, 0.9, 0.1)
        ),
        format!(
            "[light.cone]\npower_w = 5\nspot = {{ position_m = {}, target_m = {}, outer_half_angle_deg = 40 }}\n",
            p(0.1, 2.3, 0.2),
            p(0.0, 0.3, 0.1)
        ),
        format!(
            "[light.lamp]\npower_w = 5\nrectangle = {{ corner_m = {}, edge_u_m = [0.3, 0, 0], edge_v_m = [0, 0, 0.2] }}\n",
            p(-0.1, 2.3, -0.1)
        ),
    ]
    .concat()
}

#[test]
fn neighbouring_quads_share_their_corners_bit_for_bit() {
    let scene = build(&room(DVec3::ZERO));
    // The lamp's four edges are the only open ones.
    assert_eq!(scene.features.open_edges, 4);
    assert_eq!((scene.features.objects, scene.features.emitters), (8, 1));
    check_rest_space(&scene);
}

/// Far from the config's origin the scene is the same in its own coordinates. Coordinates such as 3000.7 are rounded
/// at 2⁻⁴² m, which shifts a vertex to the next f32 only if it lies that close to the middle between two: none here.
#[test]
fn a_scene_moved_by_3000_m_has_the_same_local_geometry() {
    let here = build(&room(DVec3::ZERO));
    for shift in [DVec3::splat(3000.0), DVec3::new(-3000.0, 3000.0, 0.0), DVec3::X * 3000.0] {
        let there = build(&room(shift));
        assert_eq!(there.origin_m, here.origin_m + shift);
        assert_eq!(there.geometry.vertices, here.geometry.vertices);
        assert_eq!(there.geometry, here.geometry);
        assert_eq!((there.bounds, there.camera.position), (here.bounds, here.camera.position));
        assert_eq!(there.lights.len(), here.lights.len());
        for (a, b) in there.lights.iter().zip(&here.lights) {
            let (a, b) = (format!("{:?}", a.light), format!("{:?}", b.light));
            // A direction through far points may differ in its last bit.
            assert!(a == b || a.starts_with("Light { shape: Spot"), "{a} {b}");
        }
        assert!((there.camera.forward - here.camera.forward).length() < 1e-6);
    }
}

#[test]
fn an_origin_can_be_set() {
    let scene = build(&format!("origin_m = [1, 2, 3]\n{}", room(DVec3::ZERO)));
    assert_eq!(scene.origin_m, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(scene.camera.position, Vec3::new(-0.9, -0.9, -1.9));
}

#[test]
fn rectangles_are_lights_and_the_objects_that_show_them() {
    let scene = build(&room(DVec3::ZERO));
    let light = scene.light("lamp").unwrap();
    let object = scene.object("lamp").unwrap();
    assert_eq!(scene.lights[light.0 as usize].object, Some(object));
    assert_eq!(scene.objects[object.0 as usize].emitter, Some(light));
    assert_eq!(scene.albedo(object), Vec3::ZERO);
    // u × v = x × z looks down: 5 W over 0.06 m² give 5/(0.06 π) W m⁻² sr⁻¹; f32: 1e-6.
    use photonstream_scene::Side;
    let radiance = scene.emitted_radiance(object, Side::Front).x;
    assert!((radiance / (5.0 / (0.06 * std::f32::consts::PI)) - 1.0).abs() < 1e-6);
    assert_eq!(scene.emitted_radiance(object, Side::Back), Vec3::ZERO);
    assert_eq!(scene.lights[light.0 as usize].light.shape.emitter_normal(), Vec3::NEG_Y);
    assert_eq!(
        scene.geometry.normals[scene.objects[object.0 as usize].triangles.start as usize],
        Vec3::NEG_Y
    );
}

#[test]
fn a_sphere_seen_from_within_is_closed() {
    let scene = object("sides = \"back\"\nsphere = { radius_m = 2 }");
    assert!(scene.features.is_closed());
    assert_eq!(scene.geometry.triangles.len(), 2 * 32 * 31);
    let (area, volume) = area_and_volume(&scene);
    // The normal still points outwards; inscribed, 32 divisions: 1 % below the sphere's.
    assert!(volume > 0.98 * 33.51 && area > 0.98 * 50.27 && area < 50.27);
}

#[test]
fn decisions_give_their_reasons() {
    let scene = build(&room(DVec3::ZERO));
    let decisions = scene.features.decisions();
    let find = |what: &str| decisions.iter().find(|d| d.what == what).unwrap();
    assert!(find("spot lights").modelled && !find("point lights").modelled);
    assert_eq!(find("escaping light").reason, "4 edges have a triangle on one side only");
    assert_eq!(find("flux per light").reason, "the scene has 2 lights, in 2 columns");
    assert_eq!(find("visible emitters").reason, "1 of 8 objects emit light");
    assert!(!find("motion").modelled && !find("textures").modelled && !find("back sides").modelled);
}
