//! Turns a scene into files that Mitsuba 3 renders: an independent program that says what the picture should be.
//!
//! Everything is written in the scene's own space, metres around [`Scene::origin_m`], with the f32 coordinates that our
//! rays meet. All that is approximated is the smooth edge of a spot light (see [`spot`]), and skies but constant ones, whose
//! texels Mitsuba interpolates.
#![forbid(unsafe_code)]

mod document;
mod ply;
mod sensor;
mod sky;
pub mod spot;
mod surfaces;
mod textures;

use document::Document;
use photonstream_scene::Scene;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Largest depth of the `path` integrator that leaves what our layer `direct` shows: emitters seen, and their light
/// reflected once.
pub const DIRECT_MAX_DEPTH: i32 = 2;

/// What [`export`] has written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// All files; the first is `scene.xml`.
    pub files: Vec<PathBuf>,
    /// Meshes, one for each object.
    pub meshes: usize,
    /// Triangles in all of them.
    pub triangles: usize,
    /// Emitters: one for each emitting object, point light and directional light, several for a spot with a smooth edge.
    pub emitters: usize,
}

/// Why a scene could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file or folder cannot be written.
    #[error("{}: cannot be written ({source}); check that the folder may be written to and has room", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Writes `scene` into `folder`, which is made if need be:
/// - `scene.xml`: the scene, for the variants `scalar_rgb` and `llvm_ad_rgb`. Its parameters, which Mitsuba takes as
///   `-Dname=value`, are `width`, `height`, `spp` and `max_depth`;
/// - `direct.xml`: the same with [`DIRECT_MAX_DEPTH`], our layer `direct`. `indirect` is `full` less `direct`, best rendered
///   from the same seed: in `llvm_ad_rgb` their first reflections then are the same samples;
/// - `full.xml`: the same without a limit of depth, our layer `full`;
/// - `meshes/*.ply`: one mesh for each object;
/// - `textures/*.pfm`: what albedos are multiplied by, and where holes are, at four times the resolution;
/// - `sky.exr`: radiances of a sky that is not constant;
/// - `scene.toml`: the scene as our own programs read it, at the moment that is exported.
///
/// # Errors
/// [`ExportError::Write`].
pub fn export(scene: &Scene, folder: &Path) -> Result<Exported, ExportError> {
    let meshes_folder = folder.join("meshes");
    fs::create_dir_all(&meshes_folder)
        .map_err(|source| ExportError::Write { path: meshes_folder.clone(), source })?;
    let mut document = Document::new(scene);
    sensor::write(scene, &mut document);
    let emitting_objects = surfaces::write(scene, &mut document);
    let lights = surfaces::write_lights(scene, &mut document);

    let mut files = Vec::with_capacity(scene.objects.len() + 4);
    let mut write = |path: PathBuf, bytes: &[u8]| {
        fs::write(&path, bytes).map_err(|source| ExportError::Write { path: path.clone(), source })?;
        files.push(path);
        Ok(())
    };
    write(folder.join("scene.xml"), document.finish().as_bytes())?;
    write(folder.join("direct.xml"), document::variant(DIRECT_MAX_DEPTH).as_bytes())?;
    write(folder.join("full.xml"), document::variant(-1).as_bytes())?;
    write(folder.join("scene.toml"), scene.resolved_text.as_bytes())?;
    let textures = textures::files(scene);
    if !textures.is_empty() {
        let path = folder.join("textures");
        fs::create_dir_all(&path).map_err(|source| ExportError::Write { path, source })?;
    }
    for (name, bytes) in textures {
        write(folder.join(name), &bytes)?;
    }
    if let Some(bytes) = sky::map(scene) {
        write(folder.join(sky::FILE), &bytes)?;
    }
    for (index, object) in scene.objects.iter().enumerate() {
        let bytes = ply::encode(scene, object.triangles.clone());
        write(folder.join(surfaces::mesh_file(index, &object.name)), &bytes)?;
    }
    Ok(Exported {
        files,
        meshes: scene.objects.len(),
        triangles: scene.geometry.triangles.len(),
        emitters: emitting_objects + lights,
    })
}
