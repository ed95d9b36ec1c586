//! Turns a glTF 2.0 or GLB file into meshes by node and material, reflectances, emitters and lights.

mod accessor;
mod animations;
mod buffers;
mod cameras;
mod container;
mod lights;
mod materials;
mod names;
mod nodes;
mod primitive;
mod unmodelled;
mod vertex_colours;

use super::{
    Frame, Group, Import, Loaded, MAX_TRIANGLES, Terms,
    beside::{self, Beside},
};
use crate::config::AnimationChoice;
use accessor::Accessors;
pub(crate) use animations::Played;
pub(crate) use cameras::{FileCamera, gltf_cameras};
use container::Container;
use glam::DVec3;
use materials::Materials;
pub(super) use primitive::MAX_UV;
use std::{collections::BTreeMap, path::Path};
use vertex_colours::Palettes;

/// Lumens of a watt, which candela, lux and nits of a file are divided by. Source: the definition of the candela (SI).
const LUMENS_PER_WATT: f64 = 683.0;

/// Reads a glTF or GLB file, and the buffers and pictures it names, without the nodes that `exclude` names and what is
/// below them, and with the animation that `animation` asks for.
///
/// Memory is bounded by a constant times the size of the files, and by [`MAX_TRIANGLES`].
///
/// # Errors
/// A sentence on what is wrong with the file at the returned path.
///
/// Source: Khronos Group, *glTF 2.0 Specification*, 2021.
pub(crate) fn load_gltf(
    path: &Path,
    frame: Frame,
    exclude: &[String],
    animation: Option<&AnimationChoice>,
) -> Loaded {
    let bytes = beside::read(path).map_err(|problem| (path.to_owned(), problem))?;
    let beside = Beside::new(path, &bytes);
    load(&bytes, beside, frame, (exclude, animation)).map_err(|problem| (path.to_owned(), problem))
}

fn load(
    bytes: &[u8],
    mut beside: Beside<'_>,
    frame: Frame,
    (exclude, animation): (&[String], Option<&AnimationChoice>),
) -> Result<Import, String> {
    let Container { root, bin } = container::parse(bytes)?;
    let mut notices = unmodelled::check(&root)?;
    let buffers = buffers::load(&root, bin, &mut beside)?;
    let accessors = Accessors { root: &root, buffers: &buffers };
    let placed = nodes::place(&root, exclude)?;
    let played = animations::read(&root, &accessors, &placed.nodes, animation, &mut notices)?;

    let mut materials = Materials::new(&root);
    let mut palettes = Palettes::new(&root);
    let mut groups: BTreeMap<(String, String), Group> = BTreeMap::new();
    let mut left = MAX_TRIANGLES;
    let mut points_and_lines = 0;
    for node in &placed.nodes {
        let Some(mesh) = root.nodes[node.index].mesh else { continue };
        // Nodes that move keep their mesh in their own space.
        let moves = played.as_ref().is_some_and(|played| played.joints.contains_key(&node.name));
        let is_mirrored = !moves && node.world.matrix3.determinant() < 0.0;
        let place = |point: DVec3| match moves {
            true => point,
            false => frame.apply(node.world.transform_point3(point)),
        };
        for (number, primitive) in root.meshes[mesh.value()].primitives.iter().enumerate() {
            let at = |problem| format!("node \"{}\", primitive {number}: {problem}", node.name);
            if !primitive::is_surface(primitive) {
                points_and_lines += 1;
                continue;
            }
            let (material, found) = materials.of(primitive, &accessors, &mut beside)?;
            let mut surface = primitive::read(primitive, &accessors, left, found.uvs).map_err(at)?;
            left -= surface.read;
            if palettes.paints(primitive, found.uvs.is_some()) {
                palettes.paint(&mut surface, primitive, &accessors, &material).map_err(at)?;
            }
            if is_mirrored {
                surface.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            if !moves {
                let normals_to_world = node.world.matrix3.inverse().transpose();
                for normal in &mut surface.normals {
                    *normal = frame.turn(normals_to_world * *normal);
                }
            }
            for vertex in &mut surface.vertices {
                *vertex = place(*vertex);
                if !vertex.is_finite() {
                    return Err(at(format!("a position is not finite: {vertex}")));
                }
            }
            primitive::append(groups.entry((node.name.clone(), material)).or_default(), surface, found.emits);
        }
    }
    groups.retain(|_, group| !group.mesh.triangles.is_empty());
    notices.extend(palettes.finish(&mut groups, &mut materials.read));
    if points_and_lines > 0 {
        notices.push(format!("{points_and_lines} primitives of points or lines are passed over"));
    }
    let lights = lights::read(&root, &placed.nodes, frame, &mut notices)?;
    Ok(Import {
        terms: Terms { albedo: "baseColorFactor", radiance: "emissiveFactor" },
        groups,
        lights,
        cameras: cameras::read(&root, &placed.nodes, frame),
        material_problem: None,
        nodes: placed.names,
        animations: animations::names(&root),
        played,
        notices,
        material_notices: materials.notices(),
        materials: materials.read,
        files: beside.files,
        content: beside.hasher.finalize(),
    })
}
