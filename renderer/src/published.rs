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
    records
        .iter()
        .enumerate()
        .map(|(i, r)| Ok((light(i, r, &scene.lights[i].light.shape)?, r.enabled != 0, object(r))))
        .collect()
}

fn put_lights(scene: &mut Scene, lights: Vec<Published>) {
    for (target, (light, enabled, object)) in scene.lights.iter_mut().zip(lights) {
        (target.enabled, target.object) = (enabled, object);
        match (&target.light.shape, &light.shape) {
            // It is where its object is.
            (LightShape::Mesh { .. }, LightShape::Mesh { .. }) => target.light.power = light.power,
            _ => target.light = light,
        }
    }
}

/// The light of a record; what a sky looks like is known from the text alone, `loaded`.
fn light(index: usize, record: &LightRecord, loaded: &LightShape) -> Result<Light, RenderError> {
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
        5 if loaded.sky().is_some() => loaded.clone(),
        6 if matches!(loaded, LightShape::Mesh { .. }) => loaded.clone(),
        6 => return Err(wrong("kind", "6, a mesh".into(), "what the scene's text has in this place")),
        5 => return Err(wrong("kind", "5, a sky".into(), "what the scene's text has in this place")),
        kind => {
            return Err(wrong("kind", kind.to_string(), "0 to 6; this renderer is older than the simulator"));
        }
    };
    let power = finite("power", record.power)?;
    if power.min_element() < 0.0 {
        return Err(wrong("power", power.to_string(), "0 or more"));
    }
    Ok(Light { shape, power: if record.enabled == 0 { Vec3::ZERO } else { power } })
}

#[cfg(test)]
pub(crate) mod tests;
