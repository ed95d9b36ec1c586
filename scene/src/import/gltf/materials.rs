//! Turns the materials of a glTF file into reflectances and radiances: factors times the mean of their textures.

use super::{Beside, LUMENS_PER_WATT, accessor::Accessors, buffers::read_uri, names};
use crate::import::{
    ImportedMaterial, NO_MATERIAL,
    texture::{Alpha, mean_colour},
};
use glam::DVec3;
use gltf::json::{
    Index, Root,
    material::{AlphaMode, Material},
    mesh::Primitive,
    texture::Texture,
    validation::Checked,
};
use std::collections::{BTreeMap, BTreeSet};

/// The materials that were asked for.
pub(super) struct Materials<'a> {
    root: &'a Root,
    names: Vec<String>,
    /// By name.
    pub(super) read: BTreeMap<String, ImportedMaterial>,
    /// Mean colours of pictures.
    means: BTreeMap<(usize, Alpha), Result<DVec3, String>>,
    notices: BTreeSet<String>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root) -> Self {
        let given = root.materials.iter().map(|material| material.name.as_deref());
        // Faces without a material go by a name of their own.
        let names = names::unique(std::iter::once(Some(NO_MATERIAL)).chain(given), "material");
        Self { root, names, read: BTreeMap::new(), means: BTreeMap::new(), notices: BTreeSet::new() }
    }

    /// What is passed over of them, one sentence each.
    pub(super) fn notices(&self) -> Vec<String> {
        self.notices.iter().cloned().collect()
    }

    /// The name of a primitive's material, and whether it emits.
    ///
    /// # Errors
    /// If its picture lies beyond its buffer.
    pub(super) fn of(
        &mut self,
        primitive: &Primitive,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<(String, bool), String> {
        let Some(index) = primitive.material.map(|index| index.value()) else {
            return Ok((NO_MATERIAL.into(), false));
        };
        let name = self.names[index + 1].clone();
        if !self.read.contains_key(&name) {
            let material = self.material(&name, &self.root.materials[index], accessors, beside)?;
            self.read.insert(name.clone(), material);
        }
        let emits = self.read[&name].radiance != DVec3::ZERO;
        Ok((name, emits))
    }

    fn material(
        &mut self,
        name: &str,
        material: &Material,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<ImportedMaterial, String> {
        let pbr = &material.pbr_metallic_roughness;
        let [r, g, b, _] = pbr.base_color_factor.0.map(f64::from);
        let opaque = material.alpha_mode == Checked::Valid(AlphaMode::Opaque);
        let alpha = if opaque { Alpha::Ignored } else { Alpha::Weighs };
        let mut albedo = DVec3::new(r, g, b);
        if let Some(texture) = &pbr.base_color_texture {
            albedo *= self.texture(name, texture.index, alpha, accessors, beside)?;
        }
        let strength = material.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |e| f64::from(e.emissive_strength.0));
        let mut radiance =
            DVec3::from_array(material.emissive_factor.0.map(f64::from)) * strength / LUMENS_PER_WATT;
        if let Some(texture) = &material.emissive_texture
            && radiance != DVec3::ZERO
        {
            radiance *= self.texture(name, texture.index, Alpha::Ignored, accessors, beside)?;
        }
        for (is_there, what) in [
            (!opaque, "transparency is not modelled: all is opaque"),
            (
                pbr.metallic_factor.0 > 0.0 || material.normal_texture.is_some(),
                "all surfaces are matt: metal, roughness and normal maps are passed over",
            ),
        ] {
            if is_there {
                self.notices.insert(what.to_owned());
            }
        }
        Ok(ImportedMaterial { albedo, radiance, two_sided: material.double_sided })
    }

    /// The mean colour of a texture; white, with a notice, where it cannot be read.
    fn texture(
        &mut self,
        material: &str,
        texture: Index<Texture>,
        alpha: Alpha,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<DVec3, String> {
        let image = self.root.textures[texture.value()].source.value();
        if !self.means.contains_key(&(image, alpha)) {
            let picture = &self.root.images[image];
            let mean = match (picture.buffer_view, &picture.uri) {
                (Some(view), _) => mean_colour(accessors.view(view)?, alpha),
                (None, Some(uri)) => read_uri(uri, beside).and_then(|bytes| mean_colour(&bytes, alpha)),
                (None, None) => Err("it has neither uri nor buffer view".into()),
            };
            self.means.insert((image, alpha), mean);
        }
        Ok(match &self.means[&(image, alpha)] {
            Ok(mean) => {
                self.notices.insert(
                    "textures are not modelled yet: their mean colour times the factor is the albedo".into(),
                );
                *mean
            }
            Err(problem) => {
                self.notices.insert(format!(
                    "material \"{material}\": picture {image}: {problem}; the factor is used alone"
                ));
                DVec3::ONE
            }
        })
    }
}
