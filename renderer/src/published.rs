//! Turns a published frame into the scene it was computed for: its text, with the lights of that very frame.

use crate::RenderError;
use glam::{DAffine3, Vec3};
use photonstream_protocol::{LightRecord, ObjectRecord, VslFrame};
use photonstream_scene::{ObjectId, Scene};
use photonstream_shading::{Light, LightShape};
use std::sync::Arc;

/// The scene of the last frame; its text is parsed again only when it changes.
#[derive(Debug, Default)]
pub struct PublishedScene {
    text: Option<Arc<str>>,
    scene: Option<Scene>,
}

impl PublishedScene {
    /// The scene of `frame`, with the frame's lights (which may have been switched, dimmed or moved).
    ///
    /// # Errors
    /// [`RenderError::Scene`] for a text that cannot be loaded or does not fit the records, [`RenderError::Light`],
    /// [`RenderError::Moved`] for an object that is no longer where the text puts it.
    pub fn update(&mut self, frame: &VslFrame) -> Result<&Scene, RenderError> {
        let is_known = self.scene.is_some() && self.text.as_deref() == Some(&*frame.scene_text);
        if !is_known {
            self.scene = None;
            let scene = Scene::from_resolved(&frame.scene_text)
                .map_err(|e| RenderError::Scene { reason: e.to_string() })?;
            self.text = Some(Arc::clone(&frame.scene_text));
            self.scene = Some(scene);
        }
        let scene = self.scene.as_mut().expect("invariant: set above");
        check_objects(scene, &frame.objects)?;
        set_lights(scene, &frame.lights)?;
        Ok(scene)
    }
}

fn check_objects(scene: &Scene, records: &[ObjectRecord]) -> Result<(), RenderError> {
    for record in records {
        let Some(object) = scene.objects.get(record.id as usize) else {
            let count = scene.objects.len();
            let reason = format!("object {} is published, the text has {count} objects", record.id);
            return Err(RenderError::Scene { reason });
        };
        let published = DAffine3::from_cols_array(&record.world_from_object);
        // Both sides come from the same f64 arithmetic; a motion of this size is not visible.
        if !published.abs_diff_eq(object.world_from_rest, 1e-9 * f64::from(scene.bounds.radius).max(1e-9)) {
            return Err(RenderError::Moved { object: object.name.clone() });
        }
    }
    Ok(())
}

/// Replaces the lights of `scene` by the published ones.
///
/// # Errors
/// [`RenderError::Scene`] where their number differs, [`RenderError::Light`] for unusable values.
pub fn set_lights(scene: &mut Scene, records: &[LightRecord]) -> Result<(), RenderError> {
    if records.len() != scene.lights.len() {
        let reason = format!("{} lights are published, the text has {}", records.len(), scene.lights.len());
        return Err(RenderError::Scene { reason });
    }
    let lights =
        records.iter().enumerate().map(|(i, r)| light(i, r)).collect::<Result<Vec<_>, RenderError>>()?;
    for ((target, light), record) in scene.lights.iter_mut().zip(lights).zip(records) {
        target.light = light;
        target.object = (record.object != u32::MAX).then_some(ObjectId(record.object));
    }
    Ok(())
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
mod tests {
    use super::*;

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
