//! Turns asset files into meshes, materials and lights.

mod assets;
mod beside;
mod frame;
mod gltf;
mod obj;
mod pictures;
mod ply;
mod ply_strips;
mod polygons;
mod sky_map;
mod texture;

pub use assets::AssetRoots;
pub(crate) use beside::read as read_file;
pub(crate) use frame::Frame;
pub(crate) use gltf::{FileCamera, Played, gltf_cameras, load_gltf};
pub(crate) use obj::{NO_MATERIAL, load_obj};
pub(crate) use ply::read_ply;
pub(crate) use polygons::emitter_faces;
pub(crate) use sky_map::read_radiances;

use crate::{bake::EmitterFace, picture::Texture, primitives::Mesh};
use glam::{DVec3, Vec3};
use std::{collections::BTreeMap, path::PathBuf};

/// Most triangles of one imported file, instances counted each: 2²⁵.
pub(crate) const MAX_TRIANGLES: usize = 1 << 25;

/// An import, or a sentence on what is wrong with the file at the path.
pub(crate) type Loaded = Result<Import, (PathBuf, String)>;

/// What a file holds that has several objects.
#[derive(Debug)]
pub(crate) struct Import {
    /// What the file format calls reflectance and emission.
    pub(crate) terms: Terms,
    /// Meshes by (group, material).
    pub(crate) groups: BTreeMap<(String, String), Group>,
    /// Materials by name.
    pub(crate) materials: BTreeMap<String, ImportedMaterial>,
    /// Lights without a surface.
    pub(crate) lights: Vec<ImportedLight>,
    /// Perspective cameras, m.
    pub(crate) cameras: Vec<FileCamera>,
    /// What could not be read of the material files; faces may lack their material.
    pub(crate) material_problem: Option<String>,
    /// Further names that can be left out, and which of them were.
    pub(crate) nodes: BTreeMap<String, LeftOut>,
    /// Names of its animations, in the file's order.
    pub(crate) animations: Vec<String>,
    /// The one that plays; the meshes of nodes that move are in the space of their node and the file's units.
    pub(crate) played: Option<Played>,
    /// What is passed over of the file, one sentence each.
    pub(crate) notices: Vec<String>,
    /// The same of its materials, without interest where they are replaced.
    pub(crate) material_notices: Vec<String>,
    /// All files read, and files that it names and that are not there.
    pub(crate) files: Vec<PathBuf>,
    /// Hash of the content of all files read.
    pub(crate) content: blake3::Hash,
}

/// A file's normal at unit length; zero, which is flat, where it leads nowhere.
fn unit(normal: DVec3) -> Vec3 {
    // Of any length: a square could overflow.
    let longest = normal.abs().max_element();
    let normal = (normal / longest).as_vec3();
    if longest > 0.0 && normal.is_finite() { normal.normalize() } else { Vec3::ZERO }
}

/// Whether a node was left out by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LeftOut(pub(crate) bool);

/// Names of material properties in a file format, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Terms {
    pub(crate) albedo: &'static str,
    pub(crate) radiance: &'static str,
}

/// The faces of one group and material.
#[derive(Debug, Default)]
pub(crate) struct Group {
    pub(crate) mesh: Mesh,
    /// The same surface as light sources would cover it; there may be none where the file's material does not emit.
    pub(crate) faces: Vec<EmitterFace>,
}

/// Reflectance and emission of a material of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImportedMaterial {
    /// Share of light reflected, apart from the texture; white where the file gives none.
    pub(crate) albedo: DVec3,
    /// What that is multiplied by from place to place.
    pub(crate) texture: Option<Texture>,
    /// Emitted radiance, W m⁻² sr⁻¹.
    pub(crate) radiance: DVec3,
    /// Whether both sides reflect.
    pub(crate) two_sided: bool,
}

/// A light without a surface, in the file's own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImportedLight {
    /// The node that bears it.
    pub(crate) node: String,
    pub(crate) position: DVec3,
    /// The way it shines, of any length but 0.
    pub(crate) direction: DVec3,
    pub(crate) kind: ImportedLightKind,
}

/// What kind of light a file describes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ImportedLightKind {
    /// W.
    Point { power: DVec3 },
    /// W, and half opening angles in degrees.
    Spot { power: DVec3, inner_deg: f64, outer_deg: f64 },
    /// W m⁻².
    Directional { irradiance: DVec3 },
}
