//! Turns an object that imports an OBJ or glTF file into one part for each group and material of the file.

use super::{
    Inputs,
    imported_cameras::PlacedCamera,
    imported_lights::{self, Overrides},
    imported_motion::{Motion, resolve_choice},
    imported_names::{Tables, full, named},
    imported_parts::{Source, limit_emitters, part, surface},
    materials::Materials,
};
use crate::{
    config::{AnimationChoice, Field, GltfConfig, LightOverride, ObjConfig, ObjectConfig, PartOverride},
    error::SceneError,
    import::{AssetRoots, Frame, load_gltf, load_obj},
    placement::Placement,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

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
    parts: Option<&'c BTreeMap<String, PartOverride>>,
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
    if let Some(ObjConfig { path, up_axis, unit_m, smooth, exclude, transmit, materials, parts }) =
        &mut object.obj
    {
        let field = field.key("obj");
        let frame = Frame::resolve(up_axis, unit_m, &field)?;
        let (exclude, transmit) = (exclude.get_or_insert_default(), transmit.get_or_insert_default());
        return Ok(Table {
            path,
            exclude,
            transmit,
            materials: materials.as_ref(),
            parts: parts.as_ref(),
            frame,
            smooth: *smooth.get_or_insert(true),
            field,
            stage: None,
        });
    }
    let gltf = object.gltf.as_mut().expect("invariant: called for imports of several objects only");
    let GltfConfig { path, up_axis, unit_m, smooth, exclude, transmit, materials, parts, lights, .. } = gltf;
    let (animation, held_s) = (&mut gltf.animation, gltf.animation_time_s);
    let field = field.key("gltf");
    let frame = Frame::resolve(up_axis, unit_m, &field)?;
    let (exclude, transmit) = (exclude.get_or_insert_default(), transmit.get_or_insert_default());
    if let Some(time) = held_s {
        field.key("animation_time_s").number(time, "a time in s", |_| true)?;
    }
    let (materials, parts) = (materials.as_ref(), parts.as_ref());
    let smooth = *smooth.get_or_insert(true);
    let stage = Some(Stage { animation, held_s, lights: lights.as_ref() });
    Ok(Table { path, exclude, transmit, materials, parts, frame, smooth, field, stage })
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
    let Table { path, exclude, transmit, materials, parts, frame, smooth, field, stage } =
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
    let mut excluded = named(&import, &import.nodes, exclude, &field.key("exclude"))?;
    // What lets all light pass straight through is not there for it.
    excluded.extend(named(&import, &BTreeMap::new(), transmit, &field.key("transmit"))?);
    let tables = Tables { materials, parts, field: field.clone() };
    let mut objects = tables.read(name, &import, &excluded, context.materials)?;
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
    let mut made = Vec::new();
    for (pair, mut content) in import.groups {
        let Some(otherwise) = objects.remove(&pair) else { continue };
        let (group, material) = &pair;
        let imported = import.materials.get(material);
        let overriding = otherwise.material.as_ref().or(overriding.as_ref());
        let terms = (import.terms, overriding.is_some(), &otherwise);
        let surface = surface(name, material, imported, terms, context.notices)
            .map_err(|problem| asset_error(file.clone(), problem, "repair the material"))?;
        let object = match &otherwise.rename {
            Some(new) => format!("{name}/{new}"),
            None => full(name, &pair),
        };
        if !smooth {
            content.mesh.normals.clear();
        }
        let moved = motion.as_mut().and_then(|motion| motion.place(group, &object, &mut content));
        let override_material = overriding.map(String::as_str);
        let source = Source { import: name, object, material, override_material };
        let sides = otherwise.sides.or(sides);
        made.push(part(source, content, surface, (sides, placement, moved), context));
    }
    if made.is_empty() {
        return Err(asset_error(file, "no faces are left of it".into(), "check the file and `exclude`"));
    }
    limit_emitters(&mut made, context.notices);
    context.inputs.parts.extend(made.into_iter().map(|part| (part.name.clone(), part)));
    let overrides = Overrides::new(changed_lights, &import.lights, field.key("lights"))?;
    for light in import.lights {
        imported_lights::add(name, light, (placement, motion.as_mut()), &overrides, context.inputs)?;
    }
    for camera in import.cameras {
        let name = format!("{name}/{}", camera.node);
        let placed = PlacedCamera::new(camera, &placement, motion.as_ref());
        context.inputs.cameras.insert(name, placed);
    }
    context.inputs.imports.insert(name.to_owned(), placement);
    if let Some(motion) = motion {
        motion.finish(name, context.inputs);
    }
    Ok(())
}
