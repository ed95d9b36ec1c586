//! Turns a time into where the objects and lights of an animated import are.

pub(crate) mod channel;
pub(crate) mod hierarchy;
mod shape;

use crate::{edit::SceneEdit, error::SceneError, import::Frame, placement::Placement};
use glam::{DAffine3, DVec3};
use hierarchy::Hierarchy;
use serde_json::{Map, Value};
pub(crate) use shape::Shape;
use std::sync::Arc;

/// The animation of an imported file: a pure function of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rig {
    /// Name of the object that imports the file.
    pub(crate) import: String,
    pub(crate) skeleton: Skeleton,
    pub(crate) riders: Vec<Rider>,
}

/// The moving nodes of a file, in the scene's axes and metres.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Skeleton {
    pub(crate) hierarchy: Arc<Hierarchy>,
    pub(crate) frame: Frame,
}

/// Something that moves with a node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rider {
    pub(crate) joint: usize,
    /// Of the object or light in the scene.
    pub(crate) name: String,
    pub(crate) kind: RiderKind,
}

/// What moves with a node, and what of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RiderKind {
    Object(Shape),
    Light { has_position: bool, has_direction: bool },
}

impl Skeleton {
    /// Where the joints are at `time_s`: maps from their nodes' space, in the file's units, to the import's in m.
    pub(crate) fn worlds(&self, time_s: f64) -> Vec<DAffine3> {
        let Self { hierarchy, frame } = self;
        let to_metres = frame.matrix();
        let placed = |world: DAffine3| DAffine3 {
            matrix3: to_metres * world.matrix3,
            translation: frame.apply(world.translation),
        };
        hierarchy.worlds(time_s).into_iter().map(placed).collect()
    }
}

/// Where a light on a node stands and the way it shines, in the config's coordinates.
pub(crate) fn light_at(world: &DAffine3, import: &Placement) -> (DVec3, DVec3) {
    let direction = import.rotation * (import.scale * (world.matrix3 * DVec3::NEG_Z));
    (import.apply(world.translation), direction.try_normalize().unwrap_or(DVec3::NEG_Y))
}

impl Rig {
    /// Puts all that moves with the nodes where it is at `time_s`, with the import itself at `placement`.
    ///
    /// # Errors
    /// If something comes to lie beyond what f32 can hold, or is not in the scene.
    pub(crate) fn apply(
        &self,
        time_s: f64,
        placement: &Placement,
        edit: &mut SceneEdit,
    ) -> Result<(), SceneError> {
        let worlds = self.skeleton.worlds(time_s);
        for Rider { joint, name, kind } in &self.riders {
            match kind {
                RiderKind::Object(shape) => {
                    edit.set_placement(name, &shape.at(&worlds[*joint], placement))?
                }
                RiderKind::Light { has_position, has_direction } => {
                    let (position, direction) = light_at(&worlds[*joint], placement);
                    let vector = |v: DVec3| Value::from(v.to_array().to_vec());
                    let mut values = Map::new();
                    if *has_position {
                        values.insert("position_m".into(), vector(position));
                    }
                    if *has_direction {
                        values.insert("direction".into(), vector(direction));
                    }
                    edit.set_light(name, &values)?;
                }
            }
        }
        Ok(())
    }
}
