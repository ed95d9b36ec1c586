//! Turns `[object.NAME]` tables into placed meshes with a material.

use super::{
    Inputs, check_name, imported,
    lights::{not_one_of, read_quad},
    materials::Materials,
};
use crate::{
    bake::Part,
    config::{BoxConfig, Field, ObjectConfig, PlyConfig, QuadConfig, SphereConfig, TorusKnotConfig, Vector},
    error::SceneError,
    import::{AssetRoots, Frame, read_file, read_ply},
    placement::Placement,
    primitives::{Mesh, TorusKnot, sphere, torus_knot},
    scene::Sides,
};
use std::collections::BTreeMap;

pub(super) fn read<'a>(
    table: &mut BTreeMap<String, ObjectConfig>,
    field: &Field<'a>,
    roots: &AssetRoots,
    materials: &mut Materials,
    inputs: &mut Inputs<'a>,
    notices: &mut Vec<String>,
) -> Result<(), SceneError> {
    for (name, object) in table {
        let field = field.key(name);
        check_name(name, &field)?;
        if let Some(material) = &object.material {
            materials.check(material, &field.key("material"))?;
        }
        if object.gltf.is_none() {
            // A glTF file says itself which of its sides reflect.
            object.sides.get_or_insert(Sides::Front);
        }
        let ObjectConfig { position_m, rotation_deg, scale, .. } = object;
        let placement = Placement::resolve(position_m, rotation_deg, scale, &field)?;
        let mesh = match primitive(object, &field)? {
            Some(mesh) => Some(mesh),
            None => imported_mesh(name, object, &field, roots, inputs)?,
        };
        let Some(mesh) = mesh else {
            let mut context = imported::Context { field: &field, roots, materials, inputs, notices };
            imported::read(name, object, placement, &mut context)?;
            continue;
        };
        let material = object.material.clone().ok_or_else(|| field.missing("material"))?;
        let sides = object.sides.unwrap_or_default();
        let part = Part {
            name: name.clone(),
            field,
            material,
            sides,
            mesh,
            placement,
            is_imported: false,
            moves: false,
            emitter: None,
        };
        inputs.parts.insert(name.clone(), part);
    }
    Ok(())
}

/// The mesh of an object's shape; `None` for an import, of which there is one then.
fn primitive(object: &mut ObjectConfig, field: &Field<'_>) -> Result<Option<Mesh>, SceneError> {
    let ObjectConfig { quad, cuboid, sphere, torus_knot, obj, ply, gltf, .. } = object;
    let given = [
        ("quad", quad.is_some()),
        ("box", cuboid.is_some()),
        ("sphere", sphere.is_some()),
        ("torus-knot", torus_knot.is_some()),
        ("obj", obj.is_some()),
        ("ply", ply.is_some()),
        ("gltf", gltf.is_some()),
    ];
    if given.iter().filter(|(_, given)| *given).count() != 1 {
        return Err(not_one_of(field, &given));
    }
    if let Some(QuadConfig { corner_m, edge_u_m, edge_v_m }) = quad {
        return read_quad([*corner_m, *edge_u_m, *edge_v_m], &field.key("quad")).map(Some);
    }
    if let Some(BoxConfig { size_m, centre_m }) = cuboid {
        let field = field.key("box");
        let size = field.key("size_m").lengths(*size_m)?;
        let centre = field.key("centre_m").metres(*centre_m.get_or_insert(Vector::default()))?;
        return Ok(Some(crate::primitives::cuboid(size, centre)));
    }
    if let Some(shape) = sphere {
        return read_sphere(shape, &field.key("sphere")).map(Some);
    }
    if let Some(shape) = torus_knot {
        return read_torus_knot(shape, &field.key("torus-knot")).map(Some);
    }
    Ok(None)
}

/// The mesh of an object that imports a file of one; `None` for other imports.
fn imported_mesh(
    name: &str,
    object: &mut ObjectConfig,
    field: &Field<'_>,
    roots: &AssetRoots,
    inputs: &mut Inputs<'_>,
) -> Result<Option<Mesh>, SceneError> {
    let Some(PlyConfig { path, up_axis, unit_m, smooth }) = &mut object.ply else { return Ok(None) };
    let field = field.key("ply");
    let frame = Frame::resolve(up_axis, unit_m, &field)?;
    let path_field = field.key("path");
    let (file, absolute) = imported::find(path, &path_field, roots)?;
    let mesh = read_file(&file).and_then(|bytes| {
        let content = blake3::hash(&bytes);
        inputs.contents.insert(name.to_owned(), (absolute, content));
        read_ply(&bytes, frame)
    });
    let mut mesh = mesh.map_err(|problem| {
        imported::asset_error(&path_field, file.clone(), problem, "export it anew, or remove the object")
    })?;
    inputs.files.push(file);
    if !*smooth.get_or_insert(true) {
        mesh.normals.clear();
    }
    Ok(Some(mesh))
}

fn read_sphere(shape: &mut SphereConfig, field: &Field<'_>) -> Result<Mesh, SceneError> {
    let segments = *shape.segments.get_or_insert(32);
    let radius = field.key("radius_m").length(shape.radius_m)?;
    Ok(sphere(radius, field.key("segments").count(segments, 3..=2048)?))
}

fn read_torus_knot(shape: &mut TorusKnotConfig, field: &Field<'_>) -> Result<Mesh, SceneError> {
    let p = *shape.p.get_or_insert(2);
    let q = *shape.q.get_or_insert(3);
    let segments = *shape.segments.get_or_insert(1024);
    let tube_segments = *shape.tube_segments.get_or_insert(48);
    let radius = field.key("radius_m").length(shape.radius_m)?;
    let tube = field.key("tube_radius_m");
    let tube_radius = tube.length(shape.tube_radius_m)?;
    if tube_radius >= 0.5 * radius {
        return Err(tube.invalid(
            tube_radius,
            format!("less than half of radius_m = {radius}"),
            "a thicker tube would run through itself",
        ));
    }
    let knot = TorusKnot {
        p: field.key("p").count(p, 1..=64)?,
        q: field.key("q").count(q, 1..=64)?,
        radius,
        tube_radius,
        segments: field.key("segments").count(segments, 3..=65_536)?,
        tube_segments: field.key("tube_segments").count(tube_segments, 3..=256)?,
    };
    if greatest_common_divisor(p, q) != 1 {
        return Err(field.key("q").invalid(
            format!("p = {p} and q = {q}"),
            "numbers without a common divisor",
            "with one the curve would run along itself: change p or q",
        ));
    }
    Ok(torus_knot(knot))
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
