//! Turns a Wavefront OBJ file and its MTL files into meshes by group and material, reflectances and emitters.

mod materials;
mod smoothing;
mod statements;

use super::{
    Frame, Group, Import, Loaded, MAX_TRIANGLES, Terms,
    beside::{self, Beside},
    gltf::MAX_UV,
    pictures::Pictures,
    polygons::push_polygon,
    unit,
};
use glam::{DAffine2, DVec2, DVec3, Vec2, Vec3};
use materials::{Surfaces, library};
use statements::{Faces, NONE, Statements};
use std::{
    collections::{BTreeMap, HashMap, hash_map::Entry},
    path::Path,
};

/// Name of the material of faces that have none.
pub(crate) const NO_MATERIAL: &str = "none";

/// Reads an OBJ file, the MTL files it names, and the textures that these name.
///
/// # Errors
/// A sentence on what is wrong with the file at the returned path.
pub(crate) fn load_obj(path: &Path, frame: Frame) -> Loaded {
    let at = |problem: String| (path.to_owned(), problem);
    let bytes = beside::read(path).map_err(at)?;
    let mut beside = Beside::new(path, &bytes);
    let read = statements::read(&bytes).map_err(|e| at(format!("not a valid OBJ file: {e}")))?;
    let Statements { positions, uvs, mut normals, mut faces, libraries, unread } = read;
    smoothing::fill(&positions, &mut normals, &mut faces).map_err(at)?;

    let (mut materials, mut material_problem) = (Vec::new(), None);
    for name in &libraries {
        match library(name, &mut beside) {
            Ok(found) => materials.extend(found),
            Err(problem) => {
                material_problem.get_or_insert(problem);
            }
        }
    }
    let mut surfaces = Surfaces { beside, pictures: Pictures::new(), notices: Vec::new() };
    let mut imported = BTreeMap::new();
    let mut transforms = BTreeMap::new();
    for material in &materials {
        let (surface, transform) = surfaces.material(material);
        imported.insert(plain(&material.name), surface);
        transforms.insert(material.name.as_str(), transform);
    }

    let mut groups: BTreeMap<(String, String), Group> = BTreeMap::new();
    let corners = Corners { positions: &positions, uvs: &uvs, normals: &normals, frame };
    for ((group, material), faces) in &faces {
        let known = transforms.get(material.as_str());
        let material = if known.is_some() { plain(material) } else { NO_MATERIAL.to_owned() };
        let group = groups.entry((plain(group), material)).or_default();
        corners.append(group, faces, known.copied().flatten()).map_err(at)?;
    }
    groups.retain(|_, group| !group.mesh.triangles.is_empty());
    let number = groups.values().map(|group| group.mesh.triangles.len()).sum::<usize>();
    if number > MAX_TRIANGLES {
        return Err(at(format!("it has more than {MAX_TRIANGLES} triangles")));
    }
    let notices = unread.iter().map(|(what, n)| format!("{n} statements `{what}` are passed over"));
    let Surfaces { beside, pictures, notices: mut material_notices } = surfaces;
    material_notices.extend(pictures.notices());
    Ok(Import {
        terms: Terms { albedo: "Kd", radiance: "Ke" },
        groups,
        materials: imported,
        lights: Vec::new(),
        cameras: Vec::new(),
        material_problem,
        nodes: BTreeMap::new(),
        animations: Vec::new(),
        played: None,
        notices: notices.collect(),
        material_notices,
        files: beside.files,
        content: beside.hasher.finalize(),
    })
}

/// A name without slashes, which separate the parts of an imported name.
fn plain(name: &str) -> String {
    name.replace('/', "_")
}

/// The vertices that faces refer to.
struct Corners<'a> {
    positions: &'a [DVec3],
    uvs: &'a [DVec2],
    normals: &'a [DVec3],
    frame: Frame,
}

impl Corners<'_> {
    /// Adds faces to a group; with `map`, the map from their texture coordinates to those of the picture, they have these.
    fn append(&self, group: &mut Group, faces: &Faces, map: Option<DAffine2>) -> Result<(), String> {
        let mut own: HashMap<[u32; 3], u32> = HashMap::new();
        let mut rest = faces.corners.as_slice();
        let mut polygon = Vec::new();
        for &arity in &faces.arities {
            let (face, others) = rest.split_at(arity as usize);
            rest = others;
            polygon.clear();
            for &[position, uv, normal] in face {
                let uv = if map.is_some() { uv } else { NONE };
                let mesh = &mut group.mesh;
                polygon.push(match own.entry([position, uv, normal]) {
                    Entry::Occupied(known) => *known.get(),
                    Entry::Vacant(place) => {
                        let index = mesh.vertices.len() as u32;
                        mesh.vertices.push(self.frame.apply(self.positions[position as usize]));
                        if let Some(map) = map {
                            mesh.uvs.push(self.uv(uv, &map)?);
                        }
                        if let Some(&normal) = self.normals.get(normal as usize) {
                            mesh.normals.resize(index as usize, Vec3::ZERO);
                            mesh.normals.push(unit(self.frame.turn(normal)));
                        }
                        *place.insert(index)
                    }
                });
            }
            push_polygon(group, &polygon);
        }
        if !group.mesh.normals.is_empty() {
            // Faces without normals are flat.
            group.mesh.normals.resize(group.mesh.vertices.len(), Vec3::ZERO);
        }
        Ok(())
    }

    /// Texture coordinates with rows counted from the top; those of the corner at the origin where there are none.
    fn uv(&self, index: u32, map: &DAffine2) -> Result<Vec2, String> {
        let Some(&uv) = self.uvs.get(index as usize) else { return Ok(Vec2::ZERO) };
        let DVec2 { x, y } = map.transform_point2(uv);
        let uv = DVec2::new(x, 1.0 - y).as_vec2();
        if uv.abs().max_element() <= MAX_UV {
            return Ok(uv);
        }
        Err(format!("texture coordinate {}: found {uv}, expected at most {MAX_UV}", index + 1))
    }
}
