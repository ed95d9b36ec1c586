//! Turns a published frame into the scene it was computed for: its text, with objects and lights as that frame has them.

use crate::RenderError;
use glam::{DAffine3, Vec3};
use photonstream_protocol::{LightRecord, ObjectRecord, VslFrame};
use photonstream_scene::{MaterialId, ObjectId, Scene};
use photonstream_shading::{Light, LightShape};
use std::{collections::BTreeMap, sync::Arc};

/// The scene of the last frame that could be shown; it is loaded again only when its text or its assets change.
#[derive(Debug, Default)]
pub struct PublishedScene {
    loaded: Option<Loaded>,
}

/// A scene, and what it was loaded for.
#[derive(Debug)]
struct Loaded {
    text: Arc<str>,
    /// Of the text and of what the assets held when the simulator read them.
    hash: u64,
    scene: Scene,
}

impl PublishedScene {
    /// The scene of `frame`: its text, with objects where and as large as the frame has them, with its reflectances, and
    /// with its lights, which may have been switched, dimmed or moved. Only what moved or grew since the last frame is
    /// built anew; what did not stays shared.
    ///
    /// # Errors
    /// [`RenderError::Scene`] for a text that cannot be loaded or does not fit the records, as while an asset is being
    /// written; [`RenderError::Light`], [`RenderError::Object`] for a place or a reflectance that cannot be. The scene
    /// stays that of the last good frame; a later call looks at the files again.
    pub fn update(&mut self, frame: &VslFrame) -> Result<&Scene, RenderError> {
        let is_of = |loaded: &&mut Loaded| {
            let is_same_text =
                Arc::ptr_eq(&loaded.text, &frame.scene_text) || loaded.text == frame.scene_text;
            is_same_text && loaded.hash == frame.scene_hash
        };
        let mut new = None;
        let scene = match self.loaded.as_mut().filter(is_of) {
            Some(loaded) => &mut loaded.scene,
            None => {
                let scene = Scene::from_resolved(&frame.scene_text)
                    .map_err(|e| RenderError::Scene { reason: e.to_string() })?;
                let (text, hash) = (Arc::clone(&frame.scene_text), frame.scene_hash);
                &mut new.insert(Loaded { text, hash, scene }).scene
            }
        };
        let lights = lights(scene, &frame.lights)?;
        let albedos = albedos(scene, &frame.objects)?;
        place_objects(scene, &frame.objects)?;
        for (MaterialId(id), albedo) in albedos {
            scene.materials[id as usize].albedo = albedo;
        }
        put_lights(scene, lights);
        if new.is_some() {
            self.loaded = new;
        }
        Ok(&self.loaded.as_ref().expect("invariant: found or set above").scene)
    }
}

/// The reflectances that the records have for their objects' materials, each material once.
fn albedos(scene: &Scene, records: &[ObjectRecord]) -> Result<BTreeMap<MaterialId, Vec3>, RenderError> {
    let mut found: BTreeMap<MaterialId, Vec3> = BTreeMap::new();
    // Without records all is as the text says.
    if !records.is_empty() && records.len() != scene.objects.len() {
        let reason =
            format!("{} objects are published, text and assets have {}", records.len(), scene.objects.len());
        return Err(RenderError::Scene { reason });
    }
    for record in records {
        let Some(object) = scene.objects.get(record.id as usize) else {
            let count = scene.objects.len();
            let reason = format!("object {} is published, the text has {count} objects", record.id);
            return Err(RenderError::Scene { reason });
        };
        let wrong = |expected: String| {
            let found = Vec3::from(record.albedo);
            let reason = format!("object.{}.albedo: found {found}, expected {expected}", object.name);
            RenderError::Object { reason }
        };
        if !record.albedo.iter().all(|x| (0.0..=1.0).contains(x)) {
            return Err(wrong("three numbers within [0, 1]".into()));
        }
        let albedo = Vec3::from(record.albedo);
        let of_material = *found.entry(object.material).or_insert(albedo);
        if of_material != albedo {
            return Err(wrong(format!("{of_material}, as for other objects of its material")));
        }
    }
    Ok(found)
}

/// Moves and scales the objects of `scene` to where the records have them.
fn place_objects(scene: &mut Scene, records: &[ObjectRecord]) -> Result<(), RenderError> {
    let mut edit = None;
    for record in records {
        let id = ObjectId(record.id);
        let map = DAffine3::from_cols_array(&record.world_from_object);
        if map != scene.world_from_loaded(id) {
            edit.get_or_insert_with(|| scene.edit())
                .place_object(id, map)
                .map_err(|e| RenderError::Object { reason: e.to_string() })?;
        }
    }
    if let Some(edit) = edit {
        *scene = edit.finish();
    }
    Ok(())
}

/// Replaces the lights of `scene` by the published ones.
///
/// # Errors
/// [`RenderError::Scene`] where their number differs, [`RenderError::Light`] for unusable values.
pub fn set_lights(scene: &mut Scene, records: &[LightRecord]) -> Result<(), RenderError> {
    let lights = lights(scene, records)?;
    put_lights(scene, lights);
    Ok(())
}

/// A published light: itself, whether it is on, and the object that shows it.
type Published = (Light, bool, Option<ObjectId>);

fn lights(scene: &Scene, records: &[LightRecord]) -> Result<Vec<Published>, RenderError> {
    if records.len() != scene.lights.len() {
        let reason = format!("{} lights are published, the text has {}", records.len(), scene.lights.len());
        return Err(RenderError::Scene { reason });
    }
    let object = |record: &LightRecord| (record.object != u32::MAX).then_some(ObjectId(record.object));
    records.iter().enumerate().map(|(i, r)| Ok((light(i, r)?, r.enabled != 0, object(r)))).collect()
}

fn put_lights(scene: &mut Scene, lights: Vec<Published>) {
    for (target, (light, enabled, object)) in scene.lights.iter_mut().zip(lights) {
        (target.light, target.enabled, target.object) = (light, enabled, object);
    }
}

fn light(index: usize, record: &LightRecord) -> Result<Light, RenderError> {
    let wrong = |field, found: String, expected| RenderError::Light { index, field, found, expected };
    let finite = |field, v: [f32; 3]| {
        let v = Vec3::from(v);
        if v.is_finite() { Ok(v) } else { Err(wrong(field, v.to_string(), "finite values")) }
    };
    let position = finite("position", record.position)?;
    let (edge_u, edge_v) = (finite("edge_u", record.edge_u)?, finite("edge_v", record.edge_v)?);
    let unit = || {
        let direction = finite("direction", record.direction)?;
        if (direction.length_squared() - 1.0).abs() < 1e-4 {
            Ok(direction)
        } else {
            Err(wrong("direction", direction.to_string(), "unit length"))
        }
    };
    let shape = match record.kind {
        0 => LightShape::Point { position },
        1 => {
            let (versine_inner, versine_outer) = (record.versine_inner, record.versine_outer);
            if !(versine_outer > 0.0
                && (0.0..=versine_outer).contains(&versine_inner)
                && versine_outer <= 2.0)
            {
                let found = format!("{versine_inner} and {versine_outer}");
                return Err(wrong(
                    "versine_inner, versine_outer",
                    found,
                    "0 <= inner <= outer, 0 < outer <= 2",
                ));
            }
            LightShape::Spot { position, direction: unit()?, versine_inner, versine_outer }
        }
        2 => LightShape::Directional { direction: unit()? },
        3 => LightShape::Parallelogram { corner: position, edge_u, edge_v },
        4 => LightShape::Triangle { corner: position, edge_u, edge_v },
        kind => {
            return Err(wrong("kind", kind.to_string(), "0 to 4; this renderer is older than the simulator"));
        }
    };
    let power = finite("power", record.power)?;
    if power.min_element() < 0.0 {
        return Err(wrong("power", power.to_string(), "0 or more"));
    }
    Ok(Light { shape, power: if record.enabled == 0 { Vec3::ZERO } else { power } })
}

#[cfg(test)]
pub(crate) mod tests {
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
        assert_eq!((followed.bounds, followed.lights[0].light), (moved.bounds, moved.lights[0].light));
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
        let text = format!(
            "origin_m = [0, 0, 0]\n{ROOM}[object.roof]\nmaterial = \"a\"\nobj = {{ path = {path:?} }}\n"
        );
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
            assert!(
                error.starts_with("the published scene cannot be loaded") && error.contains(part),
                "{error}"
            );
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
        let (ball, floor) =
            (scene.object("ball").unwrap().0 as usize, scene.object("floor").unwrap().0 as usize);
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
        let made = light(0, &spot).unwrap();
        assert_eq!(made.power, Vec3::new(1.0, 2.0, 3.0));
        assert!(matches!(made.shape, LightShape::Spot { versine_outer: 0.2, .. }));
        assert_eq!(light(0, &LightRecord { enabled: 0, ..spot }).unwrap().power, Vec3::ZERO);
        for (bad, field) in [
            (LightRecord { kind: 9, ..spot }, "kind"),
            (LightRecord { direction: [0.0; 3], ..spot }, "direction"),
            (LightRecord { versine_outer: 0.05, ..spot }, "versine_inner, versine_outer"),
            (LightRecord { power: [-1.0, 0.0, 0.0], ..spot }, "power"),
            (LightRecord { position: [f32::NAN; 3], ..spot }, "position"),
        ] {
            let error = light(7, &bad).unwrap_err().to_string();
            assert!(error.starts_with(&format!("light 7: {field}: found")), "{error}");
        }
    }
}
