//! Turns the node hierarchy of a glTF file into a list of nodes, each with the map from its own space to the file's.

use super::names;
use crate::{animation::Local, import::LeftOut};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::{Root, scene};
use std::collections::BTreeMap;

/// A node of the scene.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) index: usize,
    pub(super) name: String,
    /// The node above it, in this list.
    pub(super) parent: Option<usize>,
    pub(super) local: Local,
    pub(super) world: DAffine3,
}

/// The nodes of the scene that are not left out, and the names of all.
#[derive(Debug)]
pub(super) struct Nodes {
    pub(super) nodes: Vec<Placed>,
    pub(super) names: BTreeMap<String, LeftOut>,
}

/// Walks the default scene, or the first one, or all nodes without a parent; passes over nodes that `exclude` names and
/// what is below them.
///
/// # Errors
/// If a node is reached twice, or its place is not finite.
pub(super) fn place(root: &Root, exclude: &[String]) -> Result<Nodes, String> {
    let own = names::unique(root.nodes.iter().map(|node| node.name.as_deref()), "node");
    let mut names: BTreeMap<String, LeftOut> = BTreeMap::new();
    let mut seen = vec![false; root.nodes.len()];
    let mut nodes = Vec::new();
    let mut stack: Vec<(usize, DAffine3, Option<usize>, bool)> =
        tops(root).into_iter().rev().map(|top| (top, DAffine3::IDENTITY, None, false)).collect();
    while let Some((index, above, parent, out)) = stack.pop() {
        let (node, name) = (&root.nodes[index], &own[index]);
        if std::mem::replace(&mut seen[index], true) {
            return Err(format!(
                "node \"{name}\" is reached twice: the hierarchy of nodes is a cycle, or two have the same child"
            ));
        }
        let local = local(node);
        let world = above * local.matrix();
        if !world.is_finite() {
            return Err(format!("node \"{name}\": its matrix is not finite"));
        }
        let named = exclude.contains(name);
        let out = out || named;
        names.insert(name.clone(), LeftOut(named));
        if !out {
            nodes.push(Placed { index, name: name.clone(), parent, local, world });
        }
        let parent = nodes.len().checked_sub(1);
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), world, parent, out)));
    }
    Ok(Nodes { nodes, names })
}

fn tops(root: &Root) -> Vec<usize> {
    let scene = root.scene.map_or_else(|| root.scenes.first(), |index| root.scenes.get(index.value()));
    if let Some(scene) = scene {
        return scene.nodes.iter().map(|node| node.value()).collect();
    }
    let mut is_child = vec![false; root.nodes.len()];
    root.nodes
        .iter()
        .flat_map(|node| node.children.iter().flatten())
        .for_each(|child| is_child[child.value()] = true);
    (0..root.nodes.len()).filter(|&i| !is_child[i]).collect()
}

/// The map from a node's space to its parent's.
fn local(node: &scene::Node) -> Local {
    if let Some(matrix) = node.matrix {
        // Column by column; the last row is (0, 0, 0, 1).
        return Local::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
    // A quaternion of zeros turns nothing.
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    let (translation, scale) = (vector(node.translation, DVec3::ZERO), vector(node.scale, DVec3::ONE));
    Local::Parts { translation, rotation, scale }
}
