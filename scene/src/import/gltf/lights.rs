//! Turns the lights of `KHR_lights_punctual`, in candela and lux, into lights in watts.

use super::{LUMENS_PER_WATT, nodes::Placed};
use crate::import::{Frame, ImportedLight, ImportedLightKind};
use glam::DVec3;
use gltf::json::{
    Root,
    extensions::scene::khr_lights_punctual::{Light, Type},
};
use std::f64::consts::PI;

/// The lights of all nodes.
///
/// A candela is 1/683 W sr⁻¹ and a lux 1/683 W m⁻² in each of the three channels. A spot has the file's intensity on its
/// axis, and from the inner to the outer angle the profile of the scene's own spots, not the file's.
///
/// # Errors
/// If a light's node is flat, or a spot's angles are not in order.
///
/// Source: Khronos Group, KHR_lights_punctual; deviates: the profile of spots, and `range` is passed over.
pub(super) fn read(
    root: &Root,
    nodes: &[Placed],
    frame: Frame,
    notices: &mut Vec<String>,
) -> Result<Vec<ImportedLight>, String> {
    let all = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let all = all.map_or(&[][..], |e| &e.lights);
    let mut lights = Vec::new();
    for node in nodes {
        let of_node = root.nodes[node.index].extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(light) = of_node.and_then(|e| all.get(e.light.value())) else { continue };
        let at = |problem: &str| format!("node \"{}\": its light {problem}", node.name);
        if light.range.is_some() {
            let notice = "ranges of lights are passed over: they reach as far as light does";
            if !notices.iter().any(|n| n == notice) {
                notices.push(notice.to_owned());
            }
        }
        let direction = (node.world.matrix3 * DVec3::NEG_Z).try_normalize();
        lights.push(ImportedLight {
            node: node.name.clone(),
            position: frame.apply(node.world.translation),
            direction: frame.turn(direction.ok_or_else(|| at("has no direction: its node is flat"))?),
            kind: kind(light).map_err(at)?,
        });
    }
    Ok(lights)
}

fn kind(light: &Light) -> Result<ImportedLightKind, &'static str> {
    let strength =
        DVec3::from_array(light.color.map(f64::from)) * f64::from(light.intensity) / LUMENS_PER_WATT;
    Ok(match light.type_.unwrap() {
        Type::Directional => ImportedLightKind::Directional { irradiance: strength },
        Type::Point => ImportedLightKind::Point { power: strength * (4.0 * PI) },
        Type::Spot => {
            let spot = light.spot.as_ref().ok_or("has no angles")?;
            let [inner, outer] = [spot.inner_cone_angle, spot.outer_cone_angle].map(f64::from);
            // Right angles in f32 are a little more than π/2.
            if !(0.0 <= inner && inner < outer && outer <= PI / 2.0 + 1e-6) {
                return Err("has angles other than 0 ≤ inner < outer ≤ π/2");
            }
            let [inner, outer] = [inner, outer].map(|angle| angle.min(PI / 2.0));
            // The profile's integral over the sphere.
            let steradians = PI * ((1.0 - inner.cos()) + (1.0 - outer.cos()));
            ImportedLightKind::Spot {
                power: strength * steradians,
                inner_deg: inner.to_degrees(),
                outer_deg: outer.to_degrees(),
            }
        }
    })
}
