//! Turns the materials of a glTF file into reflectances with their textures, and radiances.

use super::{Beside, LUMENS_PER_WATT, accessor::Accessors, buffers::read_uri, names, primitive::Uvs};
use crate::{
    import::{ImportedMaterial, NO_MATERIAL, pictures::Pictures, texture::decode},
    picture::{Picture, Texture},
};
use glam::{DAffine2, DVec2, DVec3};
use gltf::json::{
    Index, Root, extensions,
    material::{AlphaMode, Material},
    mesh::Primitive,
    texture::{self, WrappingMode},
    validation::Checked,
};
use photonstream_shading::texture::Wrap;
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

/// What a primitive has to know of its material.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub(super) emits: bool,
    pub(super) uvs: Option<Uvs>,
}

/// The materials that were asked for.
pub(super) struct Materials<'a> {
    root: &'a Root,
    names: Vec<String>,
    /// By name.
    pub(super) read: BTreeMap<String, ImportedMaterial>,
    found: BTreeMap<usize, Found>,
    pictures: Pictures<usize>,
    notices: BTreeSet<String>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root) -> Self {
        let given = root.materials.iter().map(|material| material.name.as_deref());
        // Faces without a material go by a name of their own.
        let names = names::unique(std::iter::once(Some(NO_MATERIAL)).chain(given), "material");
        let (read, found) = (BTreeMap::new(), BTreeMap::new());
        Self { root, names, read, found, pictures: Pictures::new(), notices: BTreeSet::new() }
    }

    /// What is passed over of them, one sentence each.
    pub(super) fn notices(&self) -> Vec<String> {
        self.notices.iter().cloned().chain(self.pictures.notices()).collect()
    }

    /// The name of a primitive's material, and what is to be known of it.
    ///
    /// # Errors
    /// If its picture lies beyond its buffer.
    pub(super) fn of(
        &mut self,
        primitive: &Primitive,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<(String, Found), String> {
        let Some(index) = primitive.material.map(|index| index.value()) else {
            return Ok((NO_MATERIAL.into(), Found::default()));
        };
        let name = self.names[index + 1].clone();
        let found = match self.found.get(&index) {
            Some(found) => *found,
            None => {
                let (material, uvs) = self.material(&name, &self.root.materials[index], accessors, beside)?;
                let found = Found { emits: material.radiance != DVec3::ZERO, uvs };
                self.read.insert(name.clone(), material);
                *self.found.entry(index).or_insert(found)
            }
        };
        Ok((name, found))
    }

    fn material(
        &mut self,
        name: &str,
        material: &Material,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<(ImportedMaterial, Option<Uvs>), String> {
        let pbr = &material.pbr_metallic_roughness;
        let [r, g, b, alpha] = pbr.base_color_factor.0.map(f64::from);
        let albedo = DVec3::new(r, g, b);
        let cutoff = self.cutoff(name, material, alpha);
        let (mut texture, mut uvs) = (None, None);
        if let Some(info) = &pbr.base_color_texture
            && let Some(picture) = self.picture(name, info.index, cutoff.is_some(), accessors, beside)?
        {
            texture = Some(Texture::new(picture, self.wraps(info.index), cutoff));
            uvs = Some(coordinates(info.tex_coord, info.extensions.as_ref()));
        }
        let strength = material.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |e| f64::from(e.emissive_strength.0));
        let mut radiance =
            DVec3::from_array(material.emissive_factor.0.map(f64::from)) * strength / LUMENS_PER_WATT;
        if let Some(info) = &material.emissive_texture
            && radiance != DVec3::ZERO
            && let Some(picture) = self.picture(name, info.index, false, accessors, beside)?
        {
            radiance *= picture.mean().truncate().as_dvec3();
            self.notices.insert("light comes from textured faces evenly, in their mean colour".into());
        }
        if pbr.metallic_factor.0 > 0.0 || material.normal_texture.is_some() {
            let what = "all surfaces are matt: metal, roughness and normal maps are passed over";
            self.notices.insert(what.into());
        }
        let two_sided = material.double_sided;
        Ok((ImportedMaterial { albedo, texture, radiance, two_sided }, uvs))
    }

    /// The alpha below which a material's texture has holes; none in an opaque one, and in one without a texture.
    fn cutoff(&mut self, name: &str, material: &Material, factor: f64) -> Option<f32> {
        let has_texture = material.pbr_metallic_roughness.base_color_texture.is_some();
        let cutoff = match material.alpha_mode.unwrap() {
            AlphaMode::Opaque => return None,
            AlphaMode::Mask => f64::from(material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0)),
            AlphaMode::Blend => {
                let what = if has_texture { "is a mask at half of its alpha" } else { "is opaque" };
                self.notices.insert(format!(
                    "material \"{name}\": what is blended {what}; `transmit` lets light pass where it is clear"
                ));
                0.5
            }
        };
        // The picture's alpha counts times the factor.
        let cutoff = (cutoff / factor) as f32;
        has_texture.then_some(if cutoff.is_nan() { 0.0 } else { cutoff })
    }

    /// How a texture goes on beyond its edges.
    fn wraps(&self, index: Index<texture::Texture>) -> [Wrap; 2] {
        let wrap = |mode: Checked<WrappingMode>| match mode.unwrap() {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let sampler =
            self.root.textures[index.value()].sampler.map(|index| &self.root.samplers[index.value()]);
        sampler.map_or([Wrap::Repeat; 2], |sampler| [wrap(sampler.wrap_s), wrap(sampler.wrap_t)])
    }

    /// The picture of a texture; none, with a notice, where it cannot be read.
    fn picture(
        &mut self,
        material: &str,
        texture: Index<texture::Texture>,
        holes: bool,
        accessors: &Accessors<'_>,
        beside: &mut Beside<'_>,
    ) -> Result<Option<Arc<Picture>>, String> {
        let image = self.root.textures[texture.value()].source.value();
        let picture = &self.root.images[image];
        let view = picture.buffer_view.map(|view| accessors.view(view)).transpose()?;
        let mut content = || match (view, &picture.uri) {
            (Some(bytes), _) => Ok(bytes.to_vec()),
            (None, Some(uri)) => read_uri(uri, beside),
            (None, None) => Err("it has neither uri nor buffer view".into()),
        };
        let label =
            picture.name.as_ref().map_or_else(|| image.to_string(), |name| format!("{image} \"{name}\""));
        let read = || Ok(decode(&content()?)?.picture(holes));
        Ok(match self.pictures.get(image, holes, &label, read) {
            Ok(picture) => Some(picture),
            Err(problem) => {
                self.notices.insert(format!(
                    "material \"{material}\": picture {image}: {problem}; the factor is used alone"
                ));
                None
            }
        })
    }
}

/// Which texture coordinates a texture uses, and how they are changed. Source: KHR_texture_transform.
fn coordinates(set: u32, extensions: Option<&extensions::texture::Info>) -> Uvs {
    let Some(transform) = extensions.and_then(|e| e.texture_transform.as_ref()) else {
        return Uvs { set, map: DAffine2::IDENTITY };
    };
    let vector = |v: [f32; 2]| DVec2::from_array(v.map(f64::from));
    // Angles are counter-clockwise in a plane whose second axis points down.
    let angle = -f64::from(transform.rotation.0);
    let map = DAffine2::from_scale_angle_translation(DVec2::ONE, angle, vector(transform.offset.0))
        * DAffine2::from_scale(vector(transform.scale.0));
    Uvs { set: transform.tex_coord.unwrap_or(set), map }
}
