//! Published scenes become what the simulator has, change by change, and bad ones are named.
#![allow(clippy::unwrap_used)]
use super::*;
use glam::DVec3;

pub(crate) const ROOM: &str = "[camera]\nposition_m = [0, 0, 3]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
     [material.a]\nalbedo = 0.5\n\
     [object.ball]\nmaterial = \"a\"\nsphere = { radius_m = 0.5, segments = 8 }\n\
     [object.floor]\nmaterial = \"a\"\nquad = { corner_m = [-1, -1, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }\n\
     [light.lamp]\npower_w = 3\nrectangle = { corner_m = [0, 1, 0], edge_u_m = [0.5, 0, 0], edge_v_m = [0, 0, 0.5] }\n";

/// A frame of `scene` as a simulator publishes it.
pub(crate) fn frame(scene: &Scene) -> VslFrame {
    let objects = (0u32..).take(scene.objects.len()).map(|id| ObjectRecord {
        id,
        world_from_object: scene.world_from_loaded(ObjectId(id)).to_cols_array(),
        albedo: scene.albedo(ObjectId(id)).to_array(),
        ..ObjectRecord::default()
    });
    let lights = scene.lights.iter().map(|light| {
        let LightShape::Parallelogram { corner, edge_u, edge_v } = light.light.shape else { panic!() };
        LightRecord {
            kind: 3,
            enabled: 1,
            power: light.light.power.to_array(),
            position: corner.to_array(),
            edge_u: edge_u.to_array(),
            edge_v: edge_v.to_array(),
            object: light.object.unwrap().0,
            ..LightRecord::default()
        }
    });
    VslFrame {
        objects: objects.collect(),
        lights: lights.collect(),
        scene_text: Arc::clone(&scene.resolved_text),
        scene_hash: scene.hash,
        ..VslFrame::default()
    }
}

#[test]
fn moved_objects_are_followed_and_nothing_else_is_built_anew() {
    let still = Scene::from_resolved(ROOM).unwrap();
    let mut moved = still.clone();
    for (name, place) in [("ball", DVec3::new(0.3, 0.1, -0.2)), ("lamp", DVec3::new(-0.25, 0.5, 0.125))] {
        let id = still.object(name).unwrap();
        let home = still.objects[id.0 as usize].world_from_rest;
        moved = moved.with_object_placed(id, DAffine3::from_translation(place) * home).unwrap();
    }
    let mut published = PublishedScene::default();
    let first = published.update(&frame(&still)).unwrap().clone();
    assert_eq!((&first.geometry, &first.objects), (&still.geometry, &still.objects));
    let parts = |scene: &Scene| scene.bvh.parts().map(std::ptr::from_ref).collect::<Vec<_>>();
    let unmoved = published.update(&frame(&still)).unwrap();
    assert!(Arc::ptr_eq(&unmoved.geometry, &first.geometry) && parts(unmoved) == parts(&first));
    let followed = published.update(&frame(&moved)).unwrap().clone();
    assert_eq!((&followed.geometry, &followed.objects), (&moved.geometry, &moved.objects));
    assert_eq!((followed.bounds, &followed.lights[0].light), (moved.bounds, &moved.lights[0].light));
    let floor = still.object("floor").unwrap().0 as usize;
    for (index, (a, b)) in parts(&followed).into_iter().zip(parts(&first)).enumerate() {
        assert_eq!(a == b, index == floor, "part {index}");
    }
    assert_eq!(published.update(&frame(&still)).unwrap().geometry, still.geometry);
    // A sheared object is told, and the scene stays.
    let mut bad = frame(&moved);
    bad.objects[0].world_from_object[1] = 2.0;
    let error = published.update(&bad).unwrap_err().to_string();
    assert!(error.starts_with("object.ball.world_from_loaded: found"), "{error}");
    assert_eq!(published.update(&frame(&still)).unwrap().geometry, still.geometry);
}

/// The ball and its material are edited over and over; after each step the scene is that of the config with the same
/// numbers: reflectances and winding exactly, vertices and normals to 1e-6, for a map gives them to the rounding of
/// f64, which may decide the last bit of f32 (1.2e-7 at 2 m).
#[test]
fn paint_and_size_are_followed() {
    let config = |paint: &str, place: &str| {
        let room = ROOM.replace("albedo = 0.5", &format!("albedo = {paint}"));
        let room = room.replace("[object.ball]\n", &format!("[object.ball]\n{place}\n"));
        Scene::from_resolved(&format!("origin_m = [0, 0, 0]\n{room}")).unwrap()
    };
    let mut simulated = config("0.5", "scale = [1, 1, -0.5]");
    let first = simulated.clone();
    let mut published = PublishedScene::default();
    let mut last = published.update(&frame(&simulated)).unwrap().clone();
    let floor = simulated.object("floor").unwrap().0 as usize;
    let part = |scene: &Scene, id: usize| scene.bvh.parts().nth(id).map(std::ptr::from_ref);
    let (wide, mirrored) = ("[1.3, 0.7, 2.1]", "[1.3, -0.7, 2.1]");
    for (paint, scale, turn, resized) in [
        ("[0.9, 0.1, 0.3]", "[1, 1, -0.5]", "[0, 0, 0]", false),
        ("[0.9, 0.1, 0.3]", wide, "[10, 20, 30]", true),
        ("0.2", wide, "[40, -20, 30]", false),
        ("0.2", mirrored, "[40, -20, 30]", true),
        ("0.2", mirrored, "[-5, -20, 30]", false),
        ("0.5", "[-0.4, -0.4, -0.4]", "[-5, -20, 30]", true),
        ("0.5", "[1, 1, -0.5]", "[0, 0, 0]", true),
    ] {
        let step = format!("{paint}, {scale}, {turn}");
        let values = |text: String| serde_json::from_str(&text).unwrap();
        let mut edit = simulated.edit();
        edit.set_material("a", &values(format!("{{ \"albedo\": {paint} }}"))).unwrap();
        let keys = format!("{{ \"scale\": {scale}, \"rotation_deg\": {turn} }}");
        edit.move_object("ball", &values(keys)).unwrap();
        simulated = edit.finish();
        let expected = config(paint, &format!("scale = {scale}\nrotation_deg = {turn}"));
        let found = published.update(&frame(&simulated)).unwrap().clone();
        assert_eq!(found.materials, expected.materials, "{step}");
        let (a, b) = (&found.geometry, &expected.geometry);
        assert_eq!(a.triangles, b.triangles, "{step}");
        let pairs = a.vertices.iter().zip(&b.vertices).chain(a.normals.iter().zip(&b.normals));
        let away = pairs.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
        assert!(away <= 1e-6, "{step}: {away:e}");
        found.bvh.validate().unwrap();
        // What did not change is shared: the floor always, the mesh at rest while the size stays.
        assert_eq!(part(&found, floor), part(&last, floor), "{step}");
        let same_size = Arc::ptr_eq(&found.geometry.rest_vertices, &last.geometry.rest_vertices);
        assert_eq!(same_size, !resized, "{step}");
        let again = published.update(&frame(&simulated)).unwrap();
        assert!(Arc::ptr_eq(&again.geometry, &found.geometry), "{step}");
        last = found;
    }
    assert_eq!((&last.geometry, &last.objects), (&first.geometry, &first.objects));
}

/// An OBJ is edited, cut short and made whole again under one text: each time with another hash its content is
/// loaded, where that cannot be the last good scene stays, and what is loaded is not looked for on disk again.
#[test]
fn edited_assets_are_loaded_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roof.obj");
    let write = |height: u32, end: &str| {
        std::fs::write(&path, format!("v 0 {height} 0\nv 1 {height} 0\nv 0 {height} 1\n{end}")).unwrap();
    };
    let text =
        format!("origin_m = [0, 0, 0]\n{ROOM}[object.roof]\nmaterial = \"a\"\nobj = {{ path = {path:?} }}\n");
    write(1, "f 1 2 3\n");
    let low = Scene::from_resolved(&text).unwrap();
    write(2, "f 1 2 3\n");
    let high = Scene::from_resolved(&text).unwrap();
    assert!(low.resolved_text == high.resolved_text && low.hash != high.hash);
    write(1, "f 1 2 3\n");
    let mut published = PublishedScene::default();
    assert_eq!(published.update(&frame(&low)).unwrap().geometry, low.geometry);
    for (end, part) in [("f 1 2 4\n", "roof.obj"), ("f 1 2 3\ng b\nf 3 2 1\n", "objects are published")] {
        write(2, end);
        let error = published.update(&frame(&high)).unwrap_err().to_string();
        assert!(error.starts_with("the published scene cannot be loaded") && error.contains(part), "{error}");
        assert_eq!(published.update(&frame(&low)).unwrap().geometry, low.geometry);
    }
    write(2, "f 1 2 3\n");
    assert_eq!(published.update(&frame(&high)).unwrap().geometry, high.geometry);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(published.update(&frame(&high)).unwrap().geometry, high.geometry);
}

#[test]
fn bad_reflectances_are_named_and_change_nothing() {
    let scene = Scene::from_resolved(ROOM).unwrap();
    let mut published = PublishedScene::default();
    published.update(&frame(&scene)).unwrap();
    let (ball, floor) = (scene.object("ball").unwrap().0 as usize, scene.object("floor").unwrap().0 as usize);
    for (albedo, object, expected) in [
        (
            [1.5, 0.0, 0.0],
            ball,
            "object.ball.albedo: found [1.5, 0, 0], expected three numbers within [0, 1]",
        ),
        ([0.0, f32::NAN, 0.0], ball, "object.ball.albedo: found [0, NaN, 0], expected three"),
        (
            [0.25; 3],
            floor,
            "object.floor.albedo: found [0.25, 0.25, 0.25], expected [0.5, 0.5, 0.5], as for other",
        ),
    ] {
        let mut bad = frame(&scene);
        bad.objects[object].albedo = albedo;
        let error = published.update(&bad).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
        assert_eq!(published.update(&frame(&scene)).unwrap().materials, scene.materials);
    }
}

const LOADED: LightShape = LightShape::Point { position: Vec3::ZERO };

/// A record brings a sky's strength, the text its radiances; where the text has none the record is refused.
#[test]
fn a_sky_keeps_its_radiances_and_takes_its_strength() {
    let sky = Arc::new(photonstream_shading::Sky::gradient(DVec3::ONE, DVec3::ZERO, DVec3::X));
    let loaded = LightShape::Sky { sky };
    let record = LightRecord { kind: 5, enabled: 1, power: [1.0, 2.0, 3.0], ..LightRecord::default() };
    let made = light(3, &record, &loaded).unwrap();
    assert_eq!((&made.shape, made.power), (&loaded, Vec3::new(1.0, 2.0, 3.0)));
    let error = light(3, &record, &LOADED).unwrap_err().to_string();
    assert!(error.starts_with("light 3: kind: found 5, a sky"), "{error}");
}

#[test]
fn lights_become_their_shapes_and_bad_ones_are_named() {
    let spot = LightRecord {
        kind: 1,
        enabled: 1,
        power: [1.0, 2.0, 3.0],
        direction: [0.0, -1.0, 0.0],
        versine_inner: 0.1,
        versine_outer: 0.2,
        ..LightRecord::default()
    };
    let made = light(0, &spot, &LOADED).unwrap();
    assert_eq!(made.power, Vec3::new(1.0, 2.0, 3.0));
    assert!(matches!(made.shape, LightShape::Spot { versine_outer: 0.2, .. }));
    assert_eq!(light(0, &LightRecord { enabled: 0, ..spot }, &LOADED).unwrap().power, Vec3::ZERO);
    for (bad, field) in [
        (LightRecord { kind: 9, ..spot }, "kind"),
        (LightRecord { kind: 5, ..spot }, "kind"),
        (LightRecord { direction: [0.0; 3], ..spot }, "direction"),
        (LightRecord { versine_outer: 0.05, ..spot }, "versine_inner, versine_outer"),
        (LightRecord { power: [-1.0, 0.0, 0.0], ..spot }, "power"),
        (LightRecord { position: [f32::NAN; 3], ..spot }, "position"),
    ] {
        let error = light(7, &bad, &LOADED).unwrap_err().to_string();
        assert!(error.starts_with(&format!("light 7: {field}: found")), "{error}");
    }
}
