//! Turns where objects and lights are in a scene's own space into the positions that a config gives them.

use crate::picking::anchor;
use glam::{DAffine3, DVec3};
use photonstream_scene::{LightId, ObjectId, Scene, SceneConfig};
use std::path::Path;

/// Where the origin of each object lies in its rest space, found once for a scene's text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Standing {
    /// By object: its name for edits, and the middle of its rest space seen from its own origin.
    objects: Vec<(String, DVec3)>,
    /// By object: where the scene's text puts it, as [`Scene::world_from_loaded`].
    loaded: Vec<DAffine3>,
}

impl Standing {
    /// Reads a scene that is as its text says.
    pub(crate) fn of(scene: &Scene) -> Self {
        // The scene was made from this text; where it could not be read, nothing could be moved by name.
        let Ok(config) = SceneConfig::from_text(&scene.resolved_text, Path::new("")) else {
            return Self::default();
        };
        let objects = scene.objects.iter().map(|object| {
            let import = object.name.split('/').next().unwrap_or_default();
            let name = if config.object.contains_key(&object.name) || config.light.contains_key(&object.name)
            {
                &object.name
            } else {
                import
            };
            let written =
                config.object.get(name).and_then(|o| o.position_m).map_or(DVec3::ZERO, |p| p.0.into());
            let DAffine3 { matrix3, translation } = object.world_from_rest;
            (name.to_owned(), matrix3.transpose() * (translation - (written - scene.origin_m)))
        });
        let loaded = (0u32..).zip(&scene.objects).map(|(id, _)| scene.world_from_loaded(ObjectId(id)));
        Self { objects: objects.collect(), loaded: loaded.collect() }
    }

    /// The name by which an object is moved, and its `position_m` now.
    pub(crate) fn object(&self, scene: &Scene, id: ObjectId) -> Option<(String, DVec3)> {
        let (name, centre) = self.objects.get(id.0 as usize)?;
        let DAffine3 { matrix3, translation } = scene.objects.get(id.0 as usize)?.world_from_rest;
        Some((name.clone(), translation - matrix3 * *centre + scene.origin_m))
    }

    /// Where the scene's text puts an object, as [`Scene::world_from_loaded`].
    pub(crate) fn loaded(&self, id: ObjectId) -> Option<DAffine3> {
        self.loaded.get(id.0 as usize).copied()
    }

    /// The `position_m` of a light without a surface; `None` for others, which stand where their objects do.
    pub(crate) fn light(scene: &Scene, id: LightId) -> Option<DVec3> {
        let light = scene.lights.get(id.0 as usize)?;
        let position = anchor(&light.light).filter(|_| light.object.is_none())?;
        Some(position.as_dvec3() + scene.origin_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_the_config() {
        let text = "
            [camera]
            position_m = [3000.0, 1.0, 4.0]
            target_m = [3000.0, 1.0, 0.0]
            vertical_fov_deg = 40
            [material.white]
            albedo = 0.5
            [object.floor]
            material = \"white\"
            quad = { corner_m = [2999, 0, 1], edge_u_m = [2, 0, 0], edge_v_m = [0, 0, -2] }
            [object.box]
            material = \"white\"
            position_m = [3000.25, 0.5, -0.25]
            rotation_deg = [10, 20, 30]
            box = { size_m = [0.5, 1, 0.5] }
            [light.lamp]
            power_w = 10
            point = { position_m = [3000.5, 1.5, 0.25] }
        ";
        let scene = SceneConfig::from_text(text, Path::new("s.toml")).unwrap().build().unwrap();
        let standing = Standing::of(&scene);
        let position = |name| standing.object(&scene, scene.object(name).unwrap()).unwrap();
        let (name, place) = position("box");
        assert_eq!(name, "box");
        // Rounding of f64 at 3 km.
        assert!((place - DVec3::new(3000.25, 0.5, -0.25)).length() < 1e-11, "{place}");
        assert!(position("floor").1.length() < 1e-11, "a quad stands where its corner says");
        let lamp = Standing::light(&scene, scene.light("lamp").unwrap()).unwrap();
        assert!((lamp - DVec3::new(3000.5, 1.5, 0.25)).length() < 1e-6);
    }
}
