//! Turns an animation of a glTF file into the moving nodes of its hierarchy.

use super::{accessor::Accessors, names, nodes::Placed};
use crate::{
    animation::{Between, Channel, Hierarchy, Joint, Parent},
    config::AnimationChoice,
};
use glam::{DAffine3, DVec4};
use gltf::json::{
    Root,
    accessor::Type,
    animation::{Animation, Interpolation, Property, Sampler},
    validation::Checked,
};
use std::collections::BTreeMap;

/// Most values of all channels together, 2²²: their accessors may share bytes.
const MAX_VALUES: usize = 1 << 22;

/// The animation of a file that is played.
#[derive(Debug)]
pub(crate) struct Played {
    pub(crate) hierarchy: Hierarchy,
    /// The joint of each node that moves, by its name.
    pub(crate) joints: BTreeMap<String, usize>,
}

/// Names of the animations of a file, in its order.
pub(super) fn names(root: &Root) -> Vec<String> {
    names::unique(root.animations.iter().map(|animation| animation.name.as_deref()), "animation")
}

/// The animation that is asked for, the first where none is; `None` where there is no such one, or it moves nothing.
///
/// # Errors
/// A sentence on what is wrong with it.
pub(super) fn read(
    root: &Root,
    accessors: &Accessors<'_>,
    nodes: &[Placed],
    choice: Option<&AnimationChoice>,
    notices: &mut Vec<String>,
) -> Result<Option<Played>, String> {
    let index = match choice {
        None => 0,
        Some(AnimationChoice::None) => return Ok(None),
        Some(AnimationChoice::Named(name)) => match names(root).iter().position(|known| known == name) {
            Some(index) => index,
            None => return Ok(None),
        },
    };
    let Some(animation) = root.animations.get(index) else { return Ok(None) };
    let name = &names(root)[index];
    let mut targets =
        targets(root, animation, accessors).map_err(|e| format!("animation \"{name}\", {e}"))?;
    let end = |channel: &Option<Channel>| channel.as_ref().map_or(0.0, Channel::end);
    let duration_s =
        targets.values().flat_map(|t| [&t.translation, &t.rotation, &t.scale]).map(end).fold(0.0, f64::max);
    let is_weights = |path: &Checked<Property>| *path == Checked::Valid(Property::MorphTargetWeights);
    if animation.channels.iter().any(|channel| is_weights(&channel.target.path)) {
        notices.push(format!("animation \"{name}\": morph targets do not move"));
    }

    let mut joints: Vec<Joint> = Vec::new();
    let mut joint_of: Vec<Option<usize>> = Vec::with_capacity(nodes.len());
    let mut by_name = BTreeMap::new();
    for node in nodes {
        let own = targets.remove(&node.index).unwrap_or_default();
        let parent_joint = node.parent.and_then(|parent| joint_of[parent]);
        if own.is_empty() && parent_joint.is_none() {
            joint_of.push(None);
            continue;
        }
        if !own.is_empty() && root.nodes[node.index].matrix.is_some() {
            notices.push(format!(
                "animation \"{name}\": node \"{}\" does not move by itself: it has a matrix",
                node.name
            ));
        }
        let still = node.parent.map_or(DAffine3::IDENTITY, |parent| nodes[parent].world);
        by_name.insert(node.name.clone(), joints.len());
        joint_of.push(Some(joints.len()));
        let Target { translation, rotation, scale } = own;
        let parent = parent_joint.map_or(Parent::Still(still), Parent::Joint);
        joints.push(Joint { parent, local: node.local, translation, rotation, scale });
    }
    let played = Played { hierarchy: Hierarchy { joints, duration_s }, joints: by_name };
    Ok((!played.joints.is_empty()).then_some(played))
}

/// What changes of a node.
#[derive(Debug, Default)]
struct Target {
    translation: Option<Channel>,
    rotation: Option<Channel>,
    scale: Option<Channel>,
}

impl Target {
    fn is_empty(&self) -> bool {
        self.translation.is_none() && self.rotation.is_none() && self.scale.is_none()
    }
}

/// What changes, by the index of the node.
fn targets(
    root: &Root,
    animation: &Animation,
    accessors: &Accessors<'_>,
) -> Result<BTreeMap<usize, Target>, String> {
    let mut targets: BTreeMap<usize, Target> = BTreeMap::new();
    let mut left = MAX_VALUES;
    for (number, channel) in animation.channels.iter().enumerate() {
        let at = |problem: String| format!("channel {number}: {problem}");
        // Neither is checked by the crate's own validation.
        let Checked::Valid(path) = channel.target.path else {
            return Err(at("its path is none of translation, rotation, scale and weights".into()));
        };
        if path == Property::MorphTargetWeights {
            continue;
        }
        let node = channel.target.node.value();
        if node >= root.nodes.len() {
            return Err(at(format!("it moves node {node}, of {}", root.nodes.len())));
        }
        let sampler = &animation.samplers[channel.sampler.value()];
        let read = read_channel(sampler, path, accessors, &mut left).map_err(at)?;
        let target = targets.entry(node).or_default();
        let place = match path {
            Property::Translation => &mut target.translation,
            Property::Rotation => &mut target.rotation,
            _ => &mut target.scale,
        };
        if place.replace(read).is_some() {
            return Err(at("its property has a channel already".into()));
        }
    }
    Ok(targets)
}

fn read_channel(
    sampler: &Sampler,
    path: Property,
    accessors: &Accessors<'_>,
    left: &mut usize,
) -> Result<Channel, String> {
    let (between, each) = match sampler.interpolation.unwrap() {
        Interpolation::Linear => (Between::Linear, 1),
        Interpolation::Step => (Between::Step, 1),
        Interpolation::CubicSpline => (Between::Cubic, 3),
    };
    let input = accessors.elements::<1>(sampler.input, Type::Scalar)?;
    let (count, values): (usize, Box<dyn Fn(u32) -> DVec4>) = match path {
        Property::Rotation => {
            let output = accessors.elements::<4>(sampler.output, Type::Vec4)?;
            (output.count, Box::new(move |i| DVec4::from_array(output.get(i))))
        }
        _ => {
            let output = accessors.elements::<3>(sampler.output, Type::Vec3)?;
            (output.count, Box::new(move |i| glam::DVec3::from_array(output.get(i)).extend(0.0)))
        }
    };
    if input.count == 0 || input.count.checked_mul(each) != Some(count) {
        return Err(format!("{count} values for {} times, expected {each} for each", input.count));
    }
    *left =
        left.checked_sub(count).ok_or_else(|| format!("more than {MAX_VALUES} values in all channels"))?;
    let times: Vec<f64> = (0..input.count as u32).map(|i| input.get(i)[0]).collect();
    if !times.iter().all(|time| (0.0..=1e9).contains(time)) || !times.is_sorted() {
        return Err("its times are not within 0 to 1e9 s in order".into());
    }
    let values: Vec<DVec4> = (0..count as u32).map(values).collect();
    match values.iter().find(|value| !(value.abs().max_element() <= 1e9 && value.is_finite())) {
        Some(bad) => Err(format!("found a value {bad}, expected numbers within ±1e9")),
        None => Ok(Channel { times, values, between }),
    }
}
