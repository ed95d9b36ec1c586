//! Turns a camera of an imported file into the keys of the camera's table in the config's coordinates.

use super::imported_motion::Motion;
use crate::{
    config::{CameraConfig, Field},
    error::SceneError,
    import::FileCamera,
    placement::Placement,
};
use glam::DVec3;
use std::collections::BTreeMap;

/// A camera of an import, in the config's coordinates, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedCamera {
    position: DVec3,
    target: DVec3,
    up: DVec3,
    vertical_fov_deg: f64,
}

impl PlacedCamera {
    /// Where `import` puts a camera, and the motion of its node as the scene is loaded.
    pub(super) fn new(camera: FileCamera, import: &Placement, motion: Option<&Motion>) -> Self {
        let FileCamera { node, mut position, mut forward, mut up, vertical_fov_deg, .. } = camera;
        if let Some(world) = motion.and_then(|motion| motion.world(&node)) {
            let [_, y, z] = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis];
            (position, forward, up) = (world.translation, -z, y);
        }
        let turned = |v: DVec3| (import.rotation * (import.scale * v)).normalize_or_zero();
        let position = import.apply(position);
        Self { position, target: position + turned(forward), up: turned(up), vertical_fov_deg }
    }
}

/// Writes the camera that `config` names into it, if it names one.
///
/// # Errors
/// If there is no such camera, or the table says where it is, too.
pub(super) fn resolve(
    config: &mut CameraConfig,
    known: &BTreeMap<String, PlacedCamera>,
    field: &Field<'_>,
) -> Result<(), SceneError> {
    let Some(node) = &config.node else { return Ok(()) };
    for (key, is_given) in [
        ("position_m", config.position_m.is_some()),
        ("target_m", config.target_m.is_some()),
        ("up", config.up.is_some()),
    ] {
        if is_given {
            let found = format!("{key} besides node = \"{node}\"");
            return Err(field.key(key).invalid(found, "one of them", "leave one out"));
        }
    }
    let Some(camera) = known.get(node) else {
        return Err(SceneError::UnknownName {
            place: field.key("node").place(),
            kind: "camera of an imported file",
            found: node.clone(),
            // All are listed: there are few.
            nearest: None,
            known: known.keys().cloned().collect(),
        });
    };
    let PlacedCamera { position, target, up, vertical_fov_deg } = *camera;
    config.node = None;
    config.position_m = Some(position.into());
    config.target_m = Some(target.into());
    config.up = Some(up.into());
    config.vertical_fov_deg.get_or_insert(vertical_fov_deg);
    Ok(())
}
