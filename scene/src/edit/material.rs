//! Turns an edit of a material by the keys of a config into its reflectance in the next version.

use super::{
    unknown_name,
    values::{Keys, Values},
};
use crate::{
    config::{Document, Field, OneOrThree},
    error::SceneError,
    scene::{MaterialId, Scene},
};

const KEYS: [&str; 1] = ["albedo"];

pub(super) fn set(scene: &mut Scene, name: &str, values: &Values) -> Result<MaterialId, SceneError> {
    let document = Document::default();
    let table = Field::root(&document).key("material");
    let field = table.key(name);
    let Some(id) = scene.material(name) else {
        return Err(unknown_name(&table, "material", name, scene.materials.iter().map(|m| m.name.as_str())));
    };
    let mut keys = Keys::read(values, None, &KEYS, &field)?;
    let albedo: Option<OneOrThree> = keys.take("albedo", "a number or three numbers [r, g, b]", &field)?;
    let albedo = albedo.expect("invariant: one of the keys is given, and there is one");
    scene.materials[id.0 as usize].albedo = field.key("albedo").albedo(albedo)?.as_vec3();
    Ok(id)
}
