//! Turns the animation of an imported file into placements of its parts as the scene is loaded, and what moves them later.

use super::Inputs;
use crate::bake::EmitterFace;
use crate::{
    animation::{Rider, RiderKind, Rig, Shape, Skeleton},
    config::{AnimationChoice, Field},
    error::{SceneError, nearest},
    import::{Frame, Group, Played},
    placement::Placement,
};
use glam::DAffine3;
use std::{collections::BTreeMap, sync::Arc};

/// The animation of an import, as it stands when the scene is loaded.
pub(super) struct Motion {
    skeleton: Skeleton,
    joints: BTreeMap<String, usize>,
    shapes: Vec<Shape>,
    worlds: Vec<DAffine3>,
    import: Placement,
    /// Whether it is held at a moment: nothing moves later.
    is_held: bool,
    riders: Vec<Rider>,
}

impl Motion {
    /// The motion of what is `played` of an import that stands at `import`, held at `held_s` if that is given.
    pub(super) fn new(
        played: Played,
        frame: Frame,
        import: Placement,
        held_s: Option<f64>,
        mut note: impl FnMut(String),
    ) -> Self {
        let Played { hierarchy, joints } = played;
        let skeleton = Skeleton { hierarchy: Arc::new(hierarchy), frame };
        let shapes = Shape::of(&skeleton, &import);
        for (node, joint) in &joints {
            let degrees = shapes[*joint].1;
            if degrees > 0.0 {
                note(format!(
                    "node \"{node}\": its animation shears it, which moving, turning and scaling cannot: right angles are up to {degrees:.2}° off"
                ));
            }
        }
        let worlds = skeleton.worlds(held_s.unwrap_or(0.0));
        let shapes = shapes.into_iter().map(|(shape, _)| shape).collect();
        Self { skeleton, joints, shapes, worlds, import, is_held: held_s.is_some(), riders: Vec::new() }
    }

    /// Gives the mesh of a node that moves as its placement needs it; `None` for a node that does not.
    pub(super) fn place(&mut self, node: &str, object: &str, content: &mut Group) -> Option<Placement> {
        let joint = *self.joints.get(node)?;
        let shape = self.shapes[joint];
        let map = shape.own_from_node;
        content.mesh.vertices.iter_mut().for_each(|vertex| *vertex = map * *vertex);
        let of_normals = map.inverse().transpose();
        for normal in &mut content.mesh.normals {
            *normal = (of_normals * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        if map.determinant() < 0.0 {
            content.mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            content.faces.iter_mut().for_each(|face| match face {
                EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners) => corners.swap(1, 2),
            });
        }
        self.riders.push(Rider { joint, name: object.to_owned(), kind: RiderKind::Object(shape) });
        Some(shape.at(&self.worlds[joint], &self.import))
    }

    /// Where the node of a light is, if it moves.
    pub(super) fn carry(
        &mut self,
        node: &str,
        light: &str,
        (has_position, has_direction): (bool, bool),
    ) -> Option<DAffine3> {
        let joint = *self.joints.get(node)?;
        let kind = RiderKind::Light { has_position, has_direction };
        self.riders.push(Rider { joint, name: light.to_owned(), kind });
        Some(self.worlds[joint])
    }

    /// Where a node is as the scene is loaded, if it moves: from its space to the import's.
    pub(super) fn world(&self, node: &str) -> Option<DAffine3> {
        self.joints.get(node).map(|joint| self.worlds[*joint])
    }

    /// Hands over what moves later.
    pub(super) fn finish(self, import: &str, inputs: &mut Inputs<'_>) {
        let Self { skeleton, is_held, riders, .. } = self;
        if !(is_held || riders.is_empty()) {
            inputs.rigs.push(Rig { import: import.to_owned(), skeleton, riders });
        }
    }
}

/// Writes which animation of `known` plays into the config.
///
/// # Errors
/// If there is none of the name that it asks for.
pub(super) fn resolve_choice(
    choice: &mut Option<AnimationChoice>,
    known: &[String],
    field: &Field<'_>,
) -> Result<(), SceneError> {
    let first = || known.first().map_or(AnimationChoice::None, |name| AnimationChoice::Named(name.clone()));
    match choice.get_or_insert_with(first) {
        AnimationChoice::Named(name) if !known.contains(name) => Err(SceneError::UnknownName {
            place: field.place(),
            kind: "animation of the file",
            found: name.clone(),
            nearest: nearest(name, known.iter().map(String::as_str)),
            known: known.to_vec(),
        }),
        _ => Ok(()),
    }
}
