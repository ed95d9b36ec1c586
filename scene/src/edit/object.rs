//! Turns edits of an object by the keys of a config into its new pose.

use super::{
    SceneEdit, unknown_name,
    values::{Keys, Values},
};
use crate::{
    config::{Document, Field, OneOrThree, Vector},
    error::SceneError,
    placement::rotation,
    pose,
    scene::ObjectId,
};

const KEYS: [&str; 3] = ["position_m", "rotation_deg", "scale"];

pub(super) fn set(edit: &mut SceneEdit, name: &str, values: &Values) -> Result<Vec<ObjectId>, SceneError> {
    let document = Document::default();
    let table = Field::root(&document).key("object");
    let field = table.key(name);
    let ids = called(edit, name);
    if ids.is_empty() {
        let known = edit.scene.objects.iter().map(|o| o.name.as_str());
        return Err(unknown_name(&table, "object", name, known));
    }
    let mut keys = Keys::read(values, None, &KEYS, &field)?;
    let position = keys
        .take::<Vector>("position_m", "three numbers [x, y, z]", &field)?
        .map(|value| field.key("position_m").metres(value))
        .transpose()?;
    let turn = keys
        .take::<Vector>("rotation_deg", "three numbers [x, y, z]", &field)?
        .map(|value| field.key("rotation_deg").degrees(value))
        .transpose()?;
    let scale = keys
        .take::<OneOrThree>("scale", "a number or three numbers [x, y, z]", &field)?
        .map(|value| field.key("scale").scale(value))
        .transpose()?;
    let before = edit.poses.clone();
    for &id in &ids {
        let mut pose = edit.pose(id);
        pose.offset = position.map_or(pose.offset, |p| pose::offset(p, edit.scene.origin_m));
        pose.scale = scale.unwrap_or(pose.scale);
        pose.rotation = turn.map_or(pose.rotation, rotation);
        if let Err(error) = edit.pose_object(id, pose, &field) {
            edit.poses = before;
            return Err(error);
        }
    }
    Ok(ids)
}

/// The object of this name, else those that the import of this name has made.
fn called(edit: &SceneEdit, name: &str) -> Vec<ObjectId> {
    if let Some(id) = edit.scene.object(name) {
        return vec![id];
    }
    (0u32..)
        .zip(&edit.scene.objects)
        .filter(|(_, object)| object.is_called(name))
        .map(|(id, _)| ObjectId(id))
        .collect()
}
