//! Turns the perspective cameras of a glTF file into places, directions and angles in metres with +Y up.

use super::{
    container,
    nodes::{self, Placed},
};
use crate::import::{Frame, beside};
use glam::DVec3;
use gltf::json::{Root, camera::Type};
use std::path::Path;

/// A perspective camera of a file, m.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FileCamera {
    /// The node that bears it.
    pub(crate) node: String,
    pub(crate) position: DVec3,
    /// Of unit length.
    pub(crate) forward: DVec3,
    /// Of any length but 0.
    pub(crate) up: DVec3,
    pub(crate) vertical_fov_deg: f64,
    /// Width over height of its picture.
    pub(crate) aspect_ratio: Option<f64>,
}

/// The perspective cameras of a file, as [`read`] gives them, with all nodes.
///
/// # Errors
/// A sentence on what is wrong with the file.
pub(crate) fn gltf_cameras(path: &Path, frame: Frame) -> Result<Vec<FileCamera>, String> {
    let bytes = beside::read(path)?;
    let root = container::parse(&bytes)?.root;
    Ok(read(&root, &nodes::place(&root, &[])?.nodes, frame))
}

/// The perspective cameras of `nodes`, in their order; others are passed over.
pub(super) fn read(root: &Root, nodes: &[Placed], frame: Frame) -> Vec<FileCamera> {
    let cameras = nodes.iter().filter_map(|node| {
        let camera = root.cameras.get(root.nodes[node.index].camera?.value())?;
        if !matches!(camera.type_.as_ref(), gltf::json::validation::Checked::Valid(Type::Perspective)) {
            return None;
        }
        let perspective = camera.perspective.as_ref()?;
        let turned = |v: DVec3| (node.world.matrix3 * v).try_normalize().map(|v| frame.turn(v));
        Some(FileCamera {
            position: frame.apply(node.world.translation),
            forward: turned(DVec3::NEG_Z)?,
            up: turned(DVec3::Y)?,
            vertical_fov_deg: f64::from(perspective.yfov).to_degrees(),
            aspect_ratio: perspective.aspect_ratio.map(f64::from).filter(|aspect| *aspect > 0.0),
            node: node.name.clone(),
        })
    });
    cameras.collect()
}
