//! Turns an object that imports an OBJ file into one part for each group and material of the file.

use super::{Inputs, materials::Materials};
use crate::{
    bake::{Emitter, EmitterFace, Part, Strength},
    config::{Field, ObjectConfig},
    error::{SceneError, nearest},
    import::{AssetRoots, Group, Import, ImportedMaterial, load_obj},
    placement::Placement,
    scene::Sides,
};
use glam::DVec3;
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// Albedo of imported faces without a material.
const DEFAULT_ALBEDO: f64 = 0.5;

/// What importing one object needs and fills.
pub(super) struct Context<'c, 'a> {
    pub(super) field: &'c Field<'a>,
    pub(super) roots: &'c AssetRoots,
    pub(super) materials: &'c mut Materials,
    pub(super) inputs: &'c mut Inputs<'a>,
    pub(super) notices: &'c mut Vec<String>,
}

pub(super) fn read(
    name: &str,
    object: &mut ObjectConfig,
    placement: Placement,
    context: &mut Context<'_, '_>,
) -> Result<(), SceneError> {
    let obj = object.obj.as_mut().expect("invariant: called for imports only");
    let sides = object.sides.unwrap_or_default();
    let field = context.field.key("obj");
    let path_field = field.key("path");
    let file = context.roots.find(Path::new(&obj.path)).map_err(|looked| SceneError::AssetMissing {
        place: path_field.place(),
        asset: obj.path.clone(),
        looked,
    })?;
    let asset_error = |asset: PathBuf, problem: String, remedy: &str| SceneError::Asset {
        place: path_field.place(),
        asset,
        problem,
        remedy: remedy.into(),
    };
    let absolute = file.to_str().map(str::to_owned).ok_or_else(|| {
        asset_error(file.clone(), "its path is not valid UTF-8".into(), "rename its folder")
    })?;
    let import = load_obj(&file)
        .map_err(|(file, problem)| asset_error(file, problem, "export it anew, or remove the object"))?;
    let overridden = object.material.is_some();
    if let Some(problem) = &import.material_problem {
        if object.material.is_none() {
            let remedy = "repair it, or give the object a `material`";
            return Err(asset_error(file, problem.clone(), remedy));
        }
        context.notices.push(format!("object \"{name}\": {problem}; its `material` is used instead"));
    }
    let excluded = excluded(&import, obj.exclude.get_or_insert_default(), &field.key("exclude"))?;
    context.inputs.files.extend(import.files.iter().cloned());
    context.inputs.contents.insert(name.to_owned(), (absolute, import.content));

    let mut parts = 0;
    for ((group, material), content) in import.groups {
        if excluded.contains(&format!("{group}/{material}")) {
            continue;
        }
        let surface = surface(name, &material, import.materials.get(&material), overridden, context.notices)
            .map_err(|problem| asset_error(file.clone(), problem, "repair the material file"))?;
        let part = part(
            Source {
                name,
                group: &group,
                material: &material,
                override_material: object.material.as_deref(),
            },
            content,
            surface,
            (sides, placement),
            context,
        );
        context.inputs.parts.insert(part.name.clone(), part);
        parts += 1;
    }
    if parts == 0 {
        return Err(asset_error(file, "no faces are left of it".into(), "check the file and `exclude`"));
    }
    Ok(())
}

/// The names that a part of an import is made from.
struct Source<'s> {
    name: &'s str,
    group: &'s str,
    material: &'s str,
    override_material: Option<&'s str>,
}

fn part<'a>(
    source: Source<'_>,
    content: Group,
    surface: ImportedMaterial,
    (sides, placement): (Sides, Placement),
    context: &mut Context<'_, 'a>,
) -> Part<'a> {
    let Source { name, group, material, override_material } = source;
    let part_name = format!("{name}/{group}/{material}");
    let Group { mut mesh, mut faces } = content;
    let mut part_sides = sides;
    let emits = surface.radiance != DVec3::ZERO;
    if emits && sides == Sides::Back {
        // Emitters shine from their front: the file's winding is turned to bring it where the reflecting side is.
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        faces.iter_mut().for_each(|face| match face {
            EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners) => corners.swap(1, 2),
        });
        part_sides = Sides::Front;
    }
    if emits && sides == Sides::Both {
        context.notices.push(format!("object \"{part_name}\": emits from its front only"));
    }
    let material = match override_material {
        Some(material) => material.to_owned(),
        None => {
            let material = format!("{name}/{material}");
            context.materials.add(material.clone(), surface.albedo);
            material
        }
    };
    Part {
        name: part_name,
        field: context.field.clone(),
        material,
        sides: part_sides,
        mesh,
        placement,
        emitter: emits.then_some(Emitter { strength: Strength::Radiance(surface.radiance), faces }),
    }
}

/// The validated surface of an imported material; what it reflects does not matter if it is `overridden`.
fn surface(
    object: &str,
    name: &str,
    material: Option<&ImportedMaterial>,
    overridden: bool,
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
            radiance: DVec3::ZERO,
            textured: false,
        });
    };
    let mut surface = material.clone();
    if !surface.albedo.is_finite() || surface.albedo.min_element() < 0.0 {
        return Err(format!(
            "material \"{name}\": found Kd {}, expected numbers from 0 to 1",
            surface.albedo
        ));
    }
    let radiance_max = surface.radiance.max_element();
    if !surface.radiance.is_finite() || surface.radiance.min_element() < 0.0 || radiance_max > 1e12 {
        return Err(format!(
            "material \"{name}\": found Ke {}, expected numbers from 0 to 1e12",
            surface.radiance
        ));
    }
    if surface.albedo.max_element() > 1.0 {
        note(format!("Kd {} is brought down to at most 1", surface.albedo));
        surface.albedo = surface.albedo.min(DVec3::ONE);
    }
    if surface.textured {
        note("textures are not supported yet; Kd is used alone".into());
    }
    Ok(surface)
}

/// The `group/material` pairs to leave out.
fn excluded(import: &Import, names: &[String], field: &Field<'_>) -> Result<BTreeSet<String>, SceneError> {
    let mut excluded = BTreeSet::new();
    for name in names {
        let mut known = BTreeSet::new();
        let mut matched = false;
        for (group, material) in import.groups.keys() {
            let pair = format!("{group}/{material}");
            if name == group || name == material || *name == pair {
                matched = true;
                excluded.insert(pair);
            } else {
                known.extend([group.clone(), material.clone()]);
            }
        }
        if !matched {
            return Err(SceneError::UnknownName {
                place: field.place(),
                kind: "group or material of the file",
                found: name.clone(),
                nearest: nearest(name, known.iter().map(String::as_str)),
                known: known.into_iter().collect(),
            });
        }
    }
    Ok(excluded)
}
