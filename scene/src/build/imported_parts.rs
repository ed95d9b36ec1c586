//! Turns one group and material of an imported file into a part of the scene, with its surface and what it emits.

use super::{imported::Context, imported_names::Otherwise};
use crate::{
    bake::{Emitter, EmitterFace, Part, Strength},
    import::{Group, ImportedMaterial, Terms, emitter_faces},
    placement::Placement,
    primitives::Mesh,
    scene::Sides,
};
use glam::DVec3;

/// Albedo of imported faces without a material.
const DEFAULT_ALBEDO: f64 = 0.5;

/// Most emitting lights of an import.
const MAX_LIGHTS: usize = 1024;

/// Leaves an import the emitters of most power for each light, up to [`MAX_LIGHTS`] lights; the others stay dark.
pub(super) fn limit_emitters(parts: &mut [Part<'_>], notices: &mut Vec<String>) {
    let lights = |part: &Part<'_>| part.emitter.as_ref().map_or(0, Emitter::lights);
    if parts.iter().map(lights).sum::<usize>() <= MAX_LIGHTS {
        return;
    }
    let power_of_light = |part: &Part<'_>| {
        let Some(Emitter { strength: Strength::Radiance(radiance), .. }) = part.emitter else { return 0.0 };
        let Mesh { vertices, triangles, .. } = &part.mesh;
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| part.placement.apply(vertices[i as usize]));
            (b - a).cross(c - a).length()
        };
        radiance.element_sum() * triangles.iter().map(area).sum::<f64>() / lights(part) as f64
    };
    let mut order: Vec<usize> = (0..parts.len()).filter(|&i| lights(&parts[i]) > 0).collect();
    order.sort_by(|&a, &b| power_of_light(&parts[b]).total_cmp(&power_of_light(&parts[a])));
    let mut left = MAX_LIGHTS;
    for index in order {
        let part = &mut parts[index];
        let count = lights(part);
        if count <= left {
            left -= count;
            continue;
        }
        part.emitter = None;
        notices.push(format!(
            "object \"{}\": what emits of it stays dark: an import has at most {MAX_LIGHTS} lights, those of most power \
             first",
            part.name
        ));
    }
}

/// The names that a part of an import is made from.
pub(super) struct Source<'s> {
    /// That of the import.
    pub(super) import: &'s str,
    /// That of the part.
    pub(super) object: String,
    pub(super) material: &'s str,
    /// A material of the scene file in its place.
    pub(super) override_material: Option<&'s str>,
}

/// A part that stands where `placement` says, or where it has `moved`.
pub(super) fn part<'a>(
    source: Source<'_>,
    content: Group,
    surface: ImportedMaterial,
    (sides, placement, moved): (Option<Sides>, Placement, Option<Placement>),
    context: &mut Context<'_, 'a>,
) -> Part<'a> {
    let Source { import, object: part_name, material, override_material } = source;
    let Group { mut mesh, mut faces } = content;
    let sides = sides.unwrap_or(if surface.two_sided { Sides::Both } else { Sides::Front });
    let mut part_sides = sides;
    let emits = surface.radiance != DVec3::ZERO;
    if emits && faces.is_empty() {
        faces = emitter_faces(&mesh.vertices, &mesh.triangles);
    }
    if emits && sides == Sides::Back {
        // Emitters shine from their front: the file's winding is turned to bring it where the reflecting side is.
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        faces.iter_mut().for_each(|face| match face {
            EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners) => corners.swap(1, 2),
        });
        part_sides = Sides::Front;
    }
    if emits && sides == Sides::Both {
        context.notices.push(format!("object \"{part_name}\": emits from its front only"));
    }
    let mut has_texture = false;
    let material = match override_material {
        Some(material) => material.to_owned(),
        None => {
            let material = format!("{import}/{material}");
            has_texture = surface.texture.is_some();
            context.materials.add(material.clone(), surface.albedo, surface.texture);
            material
        }
    };
    if !has_texture {
        mesh.uvs.clear();
    }
    Part {
        name: part_name,
        field: context.field.clone(),
        material,
        sides: part_sides,
        mesh,
        placement: moved.unwrap_or(placement),
        is_imported: true,
        moves: moved.is_some(),
        emitter: emits.then_some(Emitter { strength: Strength::Radiance(surface.radiance), faces }),
    }
}

/// The validated surface of an imported material, with what is `otherwise`; what it reflects does not matter if it is
/// `overridden`.
pub(super) fn surface(
    object: &str,
    name: &str,
    material: Option<&ImportedMaterial>,
    (terms, overridden, otherwise): (Terms, bool, &Otherwise),
    notices: &mut Vec<String>,
) -> Result<ImportedMaterial, String> {
    let mut note = |what: String| {
        let notice = format!("object \"{object}\": material \"{name}\": {what}");
        if !notices.contains(&notice) {
            notices.push(notice);
        }
    };
    let Some(material) = material else {
        if !overridden {
            note(format!("faces without a known material have albedo {DEFAULT_ALBEDO}"));
        }
        return Ok(ImportedMaterial {
            albedo: DVec3::splat(DEFAULT_ALBEDO),
            texture: None,
            radiance: otherwise.radiance.unwrap_or(DVec3::ZERO),
            two_sided: false,
        });
    };
    let mut surface = material.clone();
    if !surface.albedo.is_finite() || surface.albedo.min_element() < 0.0 {
        return Err(format!(
            "material \"{name}\": found {} {}, expected numbers from 0 to 1",
            terms.albedo, surface.albedo
        ));
    }
    let radiance_max = surface.radiance.max_element();
    if !surface.radiance.is_finite() || surface.radiance.min_element() < 0.0 || radiance_max > 1e12 {
        return Err(format!(
            "material \"{name}\": found {} {}, expected numbers from 0 to 1e12",
            terms.radiance, surface.radiance
        ));
    }
    if surface.albedo.max_element() > 1.0 {
        note(format!("{} {} is brought down to at most 1", terms.albedo, surface.albedo));
        surface.albedo = surface.albedo.min(DVec3::ONE);
    }
    surface.radiance = otherwise.radiance.unwrap_or(surface.radiance);
    Ok(surface)
}
