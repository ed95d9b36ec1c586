//! Turns `[material.NAME]` tables into a list of reflectances that objects refer to by index.

use super::check_name;
use crate::{
    config::{Field, MaterialConfig},
    error::{SceneError, nearest},
    picture::Texture,
    scene::Material,
};
use glam::DVec3;
use std::collections::BTreeMap;

/// All materials, with the names they were given.
pub(super) struct Materials {
    by_name: BTreeMap<String, (DVec3, Option<Texture>)>,
}

impl Materials {
    pub(super) fn read(
        table: &BTreeMap<String, MaterialConfig>,
        field: &Field<'_>,
    ) -> Result<Self, SceneError> {
        let mut by_name = BTreeMap::new();
        for (name, material) in table {
            let field = field.key(name);
            check_name(name, &field)?;
            by_name.insert(name.clone(), (field.key("albedo").albedo(material.albedo)?, None));
        }
        Ok(Self { by_name })
    }

    /// Checks that a material of the config exists.
    pub(super) fn check(&self, name: &str, field: &Field<'_>) -> Result<(), SceneError> {
        if self.by_name.contains_key(name) {
            return Ok(());
        }
        Err(SceneError::UnknownName {
            place: field.place(),
            kind: "material",
            found: name.to_owned(),
            nearest: nearest(name, self.by_name.keys().map(String::as_str)),
            known: self.by_name.keys().cloned().collect(),
        })
    }

    /// Adds a generated material.
    pub(super) fn add(&mut self, name: String, albedo: DVec3, texture: Option<Texture>) {
        self.by_name.insert(name, (albedo, texture));
    }

    /// The materials ordered by name.
    pub(super) fn into_list(self) -> Vec<Material> {
        let material = |(name, (albedo, texture)): (String, (DVec3, _))| Material {
            name,
            albedo: albedo.as_vec3(),
            texture,
        };
        self.by_name.into_iter().map(material).collect()
    }
}
