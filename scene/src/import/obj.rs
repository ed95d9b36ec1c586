//! Turns a Wavefront OBJ file and its MTL files into meshes by group and material, reflectances and emitters.

use crate::{bake::EmitterFace, primitives::Mesh};
use glam::DVec3;
use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// What an OBJ file holds.
#[derive(Debug)]
pub(crate) struct Import {
    /// Meshes by (group, material).
    pub(crate) groups: BTreeMap<(String, String), Group>,
    /// Materials by name.
    pub(crate) materials: BTreeMap<String, ImportedMaterial>,
    /// What could not be read of the MTL files; faces may lack their material.
    pub(crate) material_problem: Option<String>,
    /// All files read, and MTL files that it names and that are not there.
    pub(crate) files: Vec<PathBuf>,
    /// Hash of the content of all files read.
    pub(crate) content: blake3::Hash,
}

/// The faces of one group and material.
#[derive(Debug, Default)]
pub(crate) struct Group {
    pub(crate) mesh: Mesh,
    /// The same surface as light sources would cover it.
    pub(crate) faces: Vec<EmitterFace>,
}

/// Reflectance and emission of an MTL material.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImportedMaterial {
    /// Kd; white where the file gives none.
    pub(crate) albedo: DVec3,
    /// Ke, W m⁻² sr⁻¹.
    pub(crate) radiance: DVec3,
    /// Whether it has a texture.
    pub(crate) textured: bool,
}

/// Name of the material of faces that have none.
pub(crate) const NO_MATERIAL: &str = "none";

/// Reads an OBJ file and the MTL files it names.
///
/// # Errors
/// A sentence on what is wrong with the file at the returned path.
pub(crate) fn load_obj(path: &Path) -> Result<Import, (PathBuf, String)> {
    let at = |problem: String| (path.to_owned(), problem);
    let bytes = fs::read(path).map_err(|e| at(format!("cannot be read ({e})")))?;
    let mut hasher = blake3::Hasher::new();
    hash_file(&mut hasher, &bytes);

    let read = RefCell::new(Vec::new());
    let files = RefCell::new(vec![path.to_owned()]);
    let problems = RefCell::new(Vec::new());
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let positions_and_faces = without_texture_coordinates_and_normals(&bytes);
    let loaded = tobj::load_obj_buf(&mut positions_and_faces.as_slice(), &options, |name| {
        let file = path.parent().unwrap_or(Path::new("")).join(name);
        files.borrow_mut().push(file.clone());
        let content = fs::read(&file).map_err(|e| {
            problems.borrow_mut().push(format!("material file {} cannot be read ({e})", file.display()));
            tobj::LoadError::OpenFileFailed
        })?;
        let parsed = complete_colours(&String::from_utf8_lossy(&content))
            .and_then(|text| tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| e.to_string()));
        read.borrow_mut().push(content);
        parsed.map_err(|problem| {
            problems.borrow_mut().push(format!("material file {}: {problem}", file.display()));
            tobj::LoadError::MaterialParseError
        })
    });
    let (models, materials) = loaded.map_err(|e| at(format!("not a valid OBJ file: {e}")))?;
    read.into_inner().iter().for_each(|content| hash_file(&mut hasher, content));
    let materials = materials.unwrap_or_default();

    let mut groups: BTreeMap<(String, String), Group> = BTreeMap::new();
    for model in &models {
        let material = model.mesh.material_id.and_then(|id| materials.get(id));
        let material = material.map_or(NO_MATERIAL, |m| m.name.as_str());
        // A slash separates the parts of an imported name.
        let key = (model.name.replace('/', "_"), material.replace('/', "_"));
        append(groups.entry(key).or_default(), &model.mesh);
    }
    groups.retain(|_, group| !group.mesh.triangles.is_empty());
    let materials = materials.iter().map(|m| (m.name.replace('/', "_"), imported_material(m))).collect();
    Ok(Import {
        files: files.into_inner(),
        groups,
        materials,
        material_problem: problems.into_inner().into_iter().next(),
        content: hasher.finalize(),
    })
}

fn hash_file(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

/// Leaves out what is not imported: tobj checks its indices less strictly than those of positions.
fn without_texture_coordinates_and_normals(bytes: &[u8]) -> Vec<u8> {
    let lines = bytes.split_inclusive(|b| *b == b'\n');
    lines
        .filter(|line| {
            !line.trim_ascii_start().starts_with(b"vt") && !line.trim_ascii_start().starts_with(b"vn")
        })
        .flatten()
        .copied()
        .collect()
}

/// Writes colours of one number, which MTL allows for greys, with the three that tobj wants, and refuses others.
fn complete_colours(text: &str) -> Result<String, String> {
    let mut complete = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        match words.as_slice() {
            ["Ka" | "Kd" | "Ks" | "Ke", numbers @ ..] if numbers.len() != 3 => match numbers {
                [grey] => complete.push_str(&format!("{} {grey} {grey} {grey}", words[0])),
                _ => {
                    let found = words.join(" ");
                    return Err(format!(
                        "line {}: found `{found}`, expected one or three numbers",
                        index + 1
                    ));
                }
            },
            _ => complete.push_str(line),
        }
        complete.push('\n');
    }
    Ok(complete)
}

fn imported_material(material: &tobj::Material) -> ImportedMaterial {
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    ImportedMaterial {
        albedo: vector(material.diffuse, DVec3::ONE),
        radiance: vector(material.emissive, DVec3::ZERO),
        textured: material.diffuse_texture.is_some(),
    }
}

fn append(group: &mut Group, mesh: &tobj::Mesh) {
    let first = group.mesh.vertices.len() as u32;
    group.mesh.vertices.extend(mesh.positions.chunks_exact(3).map(|p| {
        let [x, y, z] = [p[0], p[1], p[2]].map(f64::from);
        DVec3::new(x, y, z)
    }));
    let arities: &mut dyn Iterator<Item = u32> = if mesh.face_arities.is_empty() {
        &mut std::iter::repeat_n(3, mesh.indices.len() / 3)
    } else {
        &mut mesh.face_arities.iter().copied()
    };
    let mut rest = mesh.indices.as_slice();
    for arity in arities {
        let Some((face, others)) = rest.split_at_checked(arity as usize) else { break };
        rest = others;
        let face: Vec<u32> = face.iter().map(|i| i + first).collect();
        push_face(group, &face);
    }
}

/// Cuts a polygon into triangles, and notes how a light would cover it: whole if it is a parallelogram.
fn push_face(group: &mut Group, face: &[u32]) {
    if face.len() < 3 {
        return;
    }
    let vertex = |i: usize| group.mesh.vertices[face[i] as usize];
    let start =
        if face.len() == 4 && !is_convex_at(vertex(0), vertex(1), vertex(2), vertex(3)) { 1 } else { 0 };
    let n = face.len();
    let fan: Vec<[u32; 3]> =
        (1..n - 1).map(|i| [face[start], face[(start + i) % n], face[(start + i + 1) % n]]).collect();
    if n == 4 && is_parallelogram(vertex(0), vertex(1), vertex(2), vertex(3)) {
        group.faces.push(EmitterFace::Parallelogram([face[0], face[1], face[3]]));
    } else {
        group.faces.extend(fan.iter().map(|&t| EmitterFace::Triangle(t)));
    }
    group.mesh.triangles.extend(fan);
}

/// Whether the diagonal from `a` to `c` cuts the quadrilateral into two triangles that look the same way.
fn is_convex_at(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> bool {
    (b - a).cross(c - a).dot((c - a).cross(d - a)) > 0.0
}

/// Whether opposite edges are equal to 1e-5 of the diagonals: as close as the file's f32 positions allow.
fn is_parallelogram(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> bool {
    let size = (c - a).length().max((d - b).length());
    (a - b + c - d).length() <= 1e-5 * size
}
