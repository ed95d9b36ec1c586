//! Turns a Wavefront OBJ file and its MTL files into meshes by group and material, reflectances and emitters.

use super::{
    Frame, Group, Import, ImportedMaterial, Loaded, Terms,
    beside::Beside,
    polygons::push_polygon,
    texture::{Alpha, mean_colour},
};
use glam::DVec3;
use std::{cell::RefCell, collections::BTreeMap, fs, path::Path};

/// Name of the material of faces that have none.
pub(crate) const NO_MATERIAL: &str = "none";

/// Reads an OBJ file, the MTL files it names, and the textures that these name, of which the mean colour is taken.
///
/// # Errors
/// A sentence on what is wrong with the file at the returned path.
pub(crate) fn load_obj(path: &Path, frame: Frame) -> Loaded {
    let at = |problem: String| (path.to_owned(), problem);
    let bytes = fs::read(path).map_err(|e| at(format!("cannot be read ({e})")))?;
    let beside = RefCell::new(Beside::new(path, &bytes));
    let problems = RefCell::new(Vec::new());
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let positions_and_faces = without_texture_coordinates_and_normals(&bytes);
    let loaded = tobj::load_obj_buf(&mut positions_and_faces.as_slice(), &options, |name| {
        let content = beside.borrow_mut().read(&name.to_string_lossy()).map_err(|e| {
            problems.borrow_mut().push(format!("material file {e}"));
            tobj::LoadError::OpenFileFailed
        })?;
        let parsed = complete_colours(&String::from_utf8_lossy(&content))
            .and_then(|text| tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| e.to_string()));
        parsed.map_err(|problem| {
            problems.borrow_mut().push(format!("material file {}: {problem}", name.display()));
            tobj::LoadError::MaterialParseError
        })
    });
    let (models, materials) = loaded.map_err(|e| at(format!("not a valid OBJ file: {e}")))?;
    let materials = materials.unwrap_or_default();
    let mut textures = Textures { beside: beside.into_inner(), means: BTreeMap::new(), notices: Vec::new() };
    let imported = materials.iter().map(|m| (m.name.replace('/', "_"), textures.material(m))).collect();

    let mut groups: BTreeMap<(String, String), Group> = BTreeMap::new();
    for model in &models {
        let material = model.mesh.material_id.and_then(|id| materials.get(id));
        let material = material.map_or(NO_MATERIAL, |m| m.name.as_str());
        // A slash separates the parts of an imported name.
        let key = (model.name.replace('/', "_"), material.replace('/', "_"));
        append(groups.entry(key).or_default(), &model.mesh, frame);
    }
    groups.retain(|_, group| !group.mesh.triangles.is_empty());
    Ok(Import {
        terms: Terms { albedo: "Kd", radiance: "Ke" },
        files: textures.beside.files,
        groups,
        materials: imported,
        lights: Vec::new(),
        material_problem: problems.into_inner().into_iter().next(),
        nodes: BTreeMap::new(),
        notices: Vec::new(),
        material_notices: textures.notices,
        content: textures.beside.hasher.finalize(),
    })
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

/// The textures of MTL files, each read once.
struct Textures<'p> {
    beside: Beside<'p>,
    /// The mean colour by name.
    means: BTreeMap<String, DVec3>,
    notices: Vec<String>,
}

impl Textures<'_> {
    fn material(&mut self, material: &tobj::Material) -> ImportedMaterial {
        let vector =
            |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
        let mut albedo = vector(material.diffuse, DVec3::ONE);
        if let Some(texture) = &material.diffuse_texture {
            match self.mean(texture) {
                Ok(mean) => {
                    albedo *= mean;
                    self.note(
                        "textures are not modelled yet: Kd times a texture's mean colour is the albedo"
                            .into(),
                    );
                }
                Err(problem) => {
                    self.note(format!("material \"{}\": texture {problem}; Kd is used alone", material.name))
                }
            }
        }
        ImportedMaterial { albedo, radiance: vector(material.emissive, DVec3::ZERO), two_sided: false }
    }

    fn note(&mut self, notice: String) {
        if !self.notices.contains(&notice) {
            self.notices.push(notice);
        }
    }

    /// The mean colour of the texture that a `map_Kd` line names.
    fn mean(&mut self, line: &str) -> Result<DVec3, String> {
        // Options such as `-s 1 1 1` stand before the name.
        let name = if line.starts_with('-') { line.split_whitespace().last().unwrap_or(line) } else { line };
        if let Some(mean) = self.means.get(name) {
            return Ok(*mean);
        }
        let content = self.beside.read(name)?;
        let mean =
            mean_colour(&content, Alpha::Ignored).map_err(|e| format!("\"{name}\" is no picture ({e})"))?;
        self.means.insert(name.to_owned(), mean);
        Ok(mean)
    }
}

fn append(group: &mut Group, mesh: &tobj::Mesh, frame: Frame) {
    let first = group.mesh.vertices.len() as u32;
    group.mesh.vertices.extend(mesh.positions.chunks_exact(3).map(|p| {
        let [x, y, z] = [p[0], p[1], p[2]].map(f64::from);
        frame.apply(DVec3::new(x, y, z))
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
        push_polygon(group, &face);
    }
}
