//! Turns edits of an object by the keys of a config into its new pose.

use super::{
    SceneEdit, unknown_name,
    values::{Keys, Values},
};
use crate::{
    config::{Document, Field, OneOrThree, Vector},
    error::SceneError,
    placement::{Placement, rotation},
    pose,
    scene::ObjectId,
};
use glam::DVec3;
use serde_json::Value;
use std::sync::Arc;

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
    let to = (position, turn, scale);
    if ids.len() == 1 && !edit.scene.imports.contains_key(name) {
        // A step that fails changes nothing.
        move_all(edit, name, &ids, to, &field)?;
    } else {
        edit.all_or_nothing(|edit| move_all(edit, name, &ids, to, &field))?;
    }
    Ok(ids)
}

/// Moves objects, and with an import what else belongs to it.
fn move_all(
    edit: &mut SceneEdit,
    name: &str,
    ids: &[ObjectId],
    (position, turn, scale): (Option<DVec3>, Option<DVec3>, Option<DVec3>),
    field: &Field<'_>,
) -> Result<(), SceneError> {
    for &id in ids {
        let mut pose = edit.pose(id);
        pose.offset = position.map_or(pose.offset, |p| pose::offset(p, edit.scene.origin_m));
        pose.scale = scale.unwrap_or(pose.scale);
        pose.rotation = turn.map_or(pose.rotation, rotation);
        edit.pose_object(id, pose, field)?;
    }
    let import = edit.scene.imports.get_mut(name).map(|import| {
        import.position = position.unwrap_or(import.position);
        import.scale = scale.unwrap_or(import.scale);
        import.rotation = turn.map_or(import.rotation, rotation);
        *import
    });
    if let Some(import) = import {
        carry_lights(edit, name, &import)?;
    }
    Ok(())
}

/// Puts the lights of an import that do not move by themselves where they stand in it.
fn carry_lights(edit: &mut SceneEdit, name: &str, import: &Placement) -> Result<(), SceneError> {
    let lights = Arc::clone(&edit.scene.imported_lights);
    for light in lights.iter().filter(|light| light.import == name) {
        let vector = |v: DVec3| Value::from(v.to_array().to_vec());
        let position = light.position.map(|p| ("position_m".to_owned(), vector(import.apply(p))));
        let direction = light.direction.map(|d| ("direction".to_owned(), vector(import.turn(d))));
        edit.set_light(&light.light, &position.into_iter().chain(direction).collect())?;
    }
    Ok(())
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
