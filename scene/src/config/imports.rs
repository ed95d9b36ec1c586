//! Gathers what a scene file says of the files that objects are imported from.

use super::{ObjectConfig, OneOrThree, values};
use crate::scene::Sides;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::collections::BTreeMap;

/// Which axis of a file points up. The scene's is +Y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y, as in the scene: nothing is turned.
    #[default]
    Y,
    /// +Z: the file's (x, y, z) become (x, z, −y).
    Z,
}

/// `obj`: one object for each pair of group and material of an OBJ file, called `NAME/group/material`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjConfig {
    /// The file.
    pub path: String,
    /// The file's axis that points up; default y.
    #[serde(default, with = "values::by_name")]
    pub up_axis: Option<UpAxis>,
    /// Metres in a unit of the file; default 1.
    pub unit_m: Option<f64>,
    /// Whether pictures weigh light by the file's normals, which makes a mesh look curved; default true.
    pub smooth: Option<bool>,
    /// Groups, materials or `group/material` pairs to leave out.
    pub exclude: Option<Vec<String>>,
    /// Groups, materials or `group/material` pairs of clear panes: light passes straight through, and nothing is seen of
    /// them.
    pub transmit: Option<Vec<String>>,
    /// Materials of the scene file in the place of the file's, by group, material or `group/material` pair.
    pub materials: Option<BTreeMap<String, String>>,
    /// What is otherwise than in the file, of objects by group, material or `group/material` pair.
    pub parts: Option<BTreeMap<String, PartOverride>>,
}

/// `ply`: the faces of a PLY file as one object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlyConfig {
    /// The file.
    pub path: String,
    /// The file's axis that points up; default y.
    #[serde(default, with = "values::by_name")]
    pub up_axis: Option<UpAxis>,
    /// Metres in a unit of the file; default 1.
    pub unit_m: Option<f64>,
    /// Whether pictures weigh light by the file's normals, which makes a mesh look curved; default true.
    pub smooth: Option<bool>,
}

/// `gltf`: one object for each pair of node and material of a glTF or GLB file, called `NAME/node/material`, and a light
/// `NAME/node` for each node with one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GltfConfig {
    /// The file.
    pub path: String,
    /// The file's axis that points up; default y.
    #[serde(default, with = "values::by_name")]
    pub up_axis: Option<UpAxis>,
    /// Metres in a unit of the file; default 1.
    pub unit_m: Option<f64>,
    /// Whether pictures weigh light by the file's normals, which makes a mesh look curved; default true.
    pub smooth: Option<bool>,
    /// Nodes (with all below them), materials or `node/material` pairs to leave out.
    pub exclude: Option<Vec<String>>,
    /// Nodes, materials or `node/material` pairs of clear panes: light passes straight through, and nothing is seen of
    /// them.
    pub transmit: Option<Vec<String>>,
    /// Materials of the scene file in the place of the file's, by node, material or `node/material` pair.
    pub materials: Option<BTreeMap<String, String>>,
    /// What is otherwise than in the file, of objects by node, material or `node/material` pair.
    pub parts: Option<BTreeMap<String, PartOverride>>,
    /// What is otherwise than in the file, of the lights of nodes by the name of the node.
    pub lights: Option<BTreeMap<String, LightOverride>>,
    /// The animation that plays, again and again; default the file's first.
    pub animation: Option<AnimationChoice>,
    /// Moment at which the animation is held, s; default: it plays.
    pub animation_time_s: Option<f64>,
}

/// What of an object of a file is otherwise than there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartOverride {
    /// What takes the place of `group/material` in the name of the one object that it is.
    pub rename: Option<String>,
    /// Name of a material of the scene file.
    pub material: Option<String>,
    /// Which sides reflect; one that emits does so from its back if that is `back`, else from its front.
    #[serde(default, with = "values::by_name")]
    pub sides: Option<Sides>,
    /// Emitted radiance, W m⁻² sr⁻¹, linear RGB; 0 for none.
    pub radiance_w_m2_sr: Option<OneOrThree>,
}

/// What of a light of a file is otherwise than there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightOverride {
    /// Emitted power, W, linear RGB, of a point or spot light.
    pub power_w: Option<OneOrThree>,
    /// Irradiance of a surface that faces it, W m⁻², linear RGB, of a directional light.
    pub irradiance_w_m2: Option<OneOrThree>,
    /// Whether it is left out; what else its node has stays.
    pub exclude: Option<bool>,
}

/// Which animation of a file plays: its name, or `false` for none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnimationChoice {
    /// The one of this name.
    Named(String),
    /// None: everything stands as in the file's nodes.
    None,
}

impl Serialize for AnimationChoice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(name) => serializer.serialize_str(name),
            Self::None => serializer.serialize_bool(false),
        }
    }
}

impl<'de> Deserialize<'de> for AnimationChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ChoiceVisitor)
    }
}

struct ChoiceVisitor;

impl de::Visitor<'_> for ChoiceVisitor {
    type Value = AnimationChoice;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the name of an animation, or false")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<AnimationChoice, E> {
        Ok(AnimationChoice::Named(name.to_owned()))
    }

    fn visit_bool<E: de::Error>(self, plays: bool) -> Result<AnimationChoice, E> {
        match plays {
            false => Ok(AnimationChoice::None),
            true => Err(E::invalid_value(de::Unexpected::Bool(true), &self)),
        }
    }
}

impl ObjectConfig {
    /// The path of the file that the object is imported from.
    pub(crate) fn asset_path(&mut self) -> Option<&mut String> {
        let obj = self.obj.as_mut().map(|obj| &mut obj.path);
        obj.or(self.ply.as_mut().map(|ply| &mut ply.path)).or(self.gltf.as_mut().map(|gltf| &mut gltf.path))
    }
}
