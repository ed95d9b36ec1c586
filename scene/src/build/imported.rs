//! Turns an object that imports an OBJ or glTF file into one part for each group and material of the file.

use super::{
    Inputs,
    imported_cameras::PlacedCamera,
    imported_lights::{self, Overrides},
    imported_motion::{Motion, resolve_choice},
    materials::Materials,
};
use crate::{
    bake::{Emitter, EmitterFace, Part, Strength},
    config::{AnimationChoice, Field, GltfConfig, LightOverride, ObjConfig, ObjectConfig},
    error::{SceneError, nearest},
    import::{AssetRoots, Frame, Group, Import, ImportedMaterial, LeftOut, Terms, load_gltf, load_obj},
    placement::Placement,
    primitives::Mesh,
    scene::Sides,
};
use glam::DVec3;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// Albedo of imported faces without a material.
const DEFAULT_ALBEDO: f64 = 0.5;

/// Most emitting lights of an import.
const MAX_LIGHTS: usize = 1024;

/// What importing one object needs and fills.
pub(super) struct Context<'c, 'a> {
    pub(super) field: &'c Field<'a>,
    pub(super) roots: &'c AssetRoots,
    pub(super) materials: &'c mut Materials,
    pub(super) inputs: &'c mut Inputs<'a>,
    pub(super) notices: &'c mut Vec<String>,
}

/// The table of an object that names a file of several objects.
struct Table<'c, 'a> {
    path: &'c str,
    exclude: &'c [String],
    transmit: &'c [String],
    materials: Option<&'c BTreeMap<String, String>>,
    frame: Frame,
    smooth: bool,
    field: Field<'a>,
    /// Of files with lights and animations.
    stage: Option<Stage<'c>>,
}

/// What a table says of lights and motion.
struct Stage<'c> {
    animation: &'c mut Option<AnimationChoice>,
    held_s: Option<f64>,
    lights: Option<&'c BTreeMap<String, LightOverride>>,
}

fn table<'c, 'a>(object: &'c mut ObjectConfig, field: &Field<'a>) -> Result<Table<'c, 'a>, SceneError> {
    if let Some(ObjConfig { path, up_axis, unit_m, smooth, exclude, transmit, materials }) = &mut object.obj {
        let field = field.key("obj");
        let frame = Frame::resolve(up_axis, unit_m, &field)?;
        let (exclude, transmit) = (exclude.get_or_insert_default(), transmit.get_or_insert_default());
        return Ok(Table {
            path,
            exclude,
            transmit,
            materials: materials.as_ref(),
            frame,
            smooth: *smooth.get_or_insert(true),
            field,
            stage: None,
        });
    }
    let gltf = object.gltf.as_mut().expect("invariant: called for imports of several objects only");
    let GltfConfig { path, up_axis, unit_m, smooth, exclude, transmit, materials, lights, .. } = gltf;
    let (animation, held_s) = (&mut gltf.animation, gltf.animation_time_s);
    let field = field.key("gltf");
    let frame = Frame::resolve(up_axis, unit_m, &field)?;
    let (exclude, transmit) = (exclude.get_or_insert_default(), transmit.get_or_insert_default());
    if let Some(time) = held_s {
        field.key("animation_time_s").number(time, "a time in s", |_| true)?;
    }
    let materials = materials.as_ref();
    let smooth = *smooth.get_or_insert(true);
    let stage = Some(Stage { animation, held_s, lights: lights.as_ref() });
    Ok(Table { path, exclude, transmit, materials, frame, smooth, field, stage })
}

/// The file of an asset, and its absolute path as text.
pub(super) fn find(
    path: &str,
    field: &Field<'_>,
    roots: &AssetRoots,
) -> Result<(PathBuf, String), SceneError> {
    let file = roots.find(Path::new(path)).map_err(|looked| SceneError::AssetMissing {
        place: field.place(),
        asset: path.to_owned(),
        looked,
    })?;
    match file.to_str().map(str::to_owned) {
        Some(absolute) => Ok((file, absolute)),
        None => Err(asset_error(field, file, "its path is not valid UTF-8".into(), "rename its folder")),
    }
}

/// The error of an asset that cannot be used.
pub(super) fn asset_error(field: &Field<'_>, asset: PathBuf, problem: String, remedy: &str) -> SceneError {
    SceneError::Asset { place: field.place(), asset, problem, remedy: remedy.into() }
}

pub(super) fn read(
    name: &str,
    object: &mut ObjectConfig,
    placement: Placement,
    context: &mut Context<'_, '_>,
) -> Result<(), SceneError> {
    let (sides, overriding) = (object.sides, object.material.clone());
    let Table { path, exclude, transmit, materials, frame, smooth, field, stage } =
        table(object, context.field)?;
    let path_field = field.key("path");
    let (file, absolute) = find(path, &path_field, context.roots)?;
    let asset_error = |asset, problem, remedy| asset_error(&path_field, asset, problem, remedy);
    let loaded = match &stage {
        Some(stage) => load_gltf(&file, frame, exclude, stage.animation.as_ref()),
        None => load_obj(&file, frame),
    };
    let import = loaded
        .map_err(|(file, problem)| asset_error(file, problem, "export it anew, or remove the object"))?;
    if let Some(problem) = &import.material_problem {
        if overriding.is_none() {
            let remedy = "repair it, or give the object a `material`";
            return Err(asset_error(file, problem.clone(), remedy));
        }
        context.notices.push(format!("object \"{name}\": {problem}; its `material` is used instead"));
    }
    let mut excluded = named(&import, exclude, &field.key("exclude"))?;
    // What lets all light pass straight through is not there for it.
    excluded.extend(named(&import, transmit, &field.key("transmit"))?);
    let replaced = replaced(&import, materials, &field.key("materials"), context.materials)?;
    context.inputs.files.extend(import.files.iter().cloned());
    context.inputs.contents.insert(name.to_owned(), (absolute, import.content));
    let of_materials = if overriding.is_none() { import.material_notices.as_slice() } else { &[] };
    let notices =
        import.notices.iter().chain(of_materials).map(|notice| format!("object \"{name}\": {notice}"));
    context.notices.extend(notices);

    let (mut motion, mut changed_lights) = (None, None);
    if let Some(Stage { animation, held_s, lights }) = stage {
        resolve_choice(animation, &import.animations, &field.key("animation"))?;
        let note = |notice| context.notices.push(format!("object \"{name}\": {notice}"));
        motion = import.played.map(|played| Motion::new(played, frame, placement, held_s, note));
        changed_lights = lights;
    }
    let mut parts = Vec::new();
    for ((group, material), mut content) in import.groups {
        if excluded.contains(&format!("{group}/{material}")) {
            continue;
        }
        let imported = import.materials.get(&material);
        let overriding = replaced.get(&format!("{group}/{material}")).or(overriding.as_ref());
        let surface =
            surface(name, &material, imported, (import.terms, overriding.is_some()), context.notices)
                .map_err(|problem| asset_error(file.clone(), problem, "repair the material"))?;
        let source = Source {
            name,
            group: &group,
            material: &material,
            override_material: overriding.map(String::as_str),
        };
        if !smooth {
            content.mesh.normals.clear();
        }
        let object = source.object();
        let moved = motion.as_mut().and_then(|motion| motion.place(&group, &object, &mut content));
        parts.push(part(source, content, surface, (sides, placement, moved), context));
    }
    if parts.is_empty() {
        return Err(asset_error(file, "no faces are left of it".into(), "check the file and `exclude`"));
    }
    limit_emitters(&mut parts, context.notices);
    context.inputs.parts.extend(parts.into_iter().map(|part| (part.name.clone(), part)));
    let overrides = Overrides::new(changed_lights, &import.lights, field.key("lights"))?;
    for light in import.lights {
        imported_lights::add(name, light, (placement, motion.as_mut()), &overrides, context.inputs)?;
    }
    for camera in import.cameras {
        let name = format!("{name}/{}", camera.node);
        let placed = PlacedCamera::new(camera, &placement, motion.as_ref());
        context.inputs.cameras.insert(name, placed);
    }
    if let Some(motion) = motion {
        motion.finish(name, context.inputs);
    }
    Ok(())
}

/// Leaves an import the emitters of most power for each light, up to [`MAX_LIGHTS`] lights; the others stay dark.
fn limit_emitters(parts: &mut [Part<'_>], notices: &mut Vec<String>) {
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
struct Source<'s> {
    name: &'s str,
    group: &'s str,
    material: &'s str,
    override_material: Option<&'s str>,
}

impl Source<'_> {
    /// The name of the object.
    fn object(&self) -> String {
        format!("{}/{}/{}", self.name, self.group, self.material)
    }
}

fn part<'a>(
    source: Source<'_>,
    content: Group,
    surface: ImportedMaterial,
    (sides, placement, moved): (Option<Sides>, Placement, Option<Placement>),
    context: &mut Context<'_, 'a>,
) -> Part<'a> {
    let part_name = source.object();
    let Source { name, material, override_material, .. } = source;
    let Group { mut mesh, mut faces } = content;
    let sides = sides.unwrap_or(if surface.two_sided { Sides::Both } else { Sides::Front });
    let mut part_sides = sides;
    let emits = surface.radiance != DVec3::ZERO;
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
            let material = format!("{name}/{material}");
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

/// The validated surface of an imported material; what it reflects does not matter if it is `overridden`.
fn surface(
    object: &str,
    name: &str,
    material: Option<&ImportedMaterial>,
    (terms, overridden): (Terms, bool),
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
            radiance: DVec3::ZERO,
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
    Ok(surface)
}

/// The material of the scene file for each `group/material` pair that has one in the file's place: that of the pair, else
/// of the material, else of the group.
fn replaced(
    import: &Import,
    materials: Option<&BTreeMap<String, String>>,
    field: &Field<'_>,
    known: &Materials,
) -> Result<BTreeMap<String, String>, SceneError> {
    let mut replaced = BTreeMap::new();
    let Some(materials) = materials else { return Ok(replaced) };
    for (name, material) in materials {
        known.check(material, &field.key(name))?;
        named(import, std::slice::from_ref(name), field)?;
    }
    for (group, material) in import.groups.keys() {
        let pair = format!("{group}/{material}");
        let own = [&pair, material, group].into_iter().find_map(|name| materials.get(name));
        replaced.extend(own.map(|own| (pair, own.clone())));
    }
    Ok(replaced)
}

/// The `group/material` pairs that `names` name.
fn named(import: &Import, names: &[String], field: &Field<'_>) -> Result<BTreeSet<String>, SceneError> {
    let mut excluded = BTreeSet::new();
    for name in names {
        let mut known: BTreeSet<String> = import.nodes.keys().cloned().collect();
        let mut matched = import.nodes.get(name) == Some(&LeftOut(true));
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
                kind: if import.nodes.is_empty() {
                    "group or material of the file"
                } else {
                    "node or material of the file"
                },
                found: name.clone(),
                nearest: nearest(name, known.iter().map(String::as_str)),
                known: known.into_iter().collect(),
            });
        }
    }
    Ok(excluded)
}
