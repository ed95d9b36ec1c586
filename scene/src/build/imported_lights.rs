//! Turns a light of an imported file into one of the scene, as if a table of the config described it.

use super::{Inputs, imported_motion::Motion, lights::read_plain};
use crate::{
    animation::light_at,
    config::{DirectionalConfig, Field, LightConfig, LightOverride, OneOrThree, PointConfig, SpotConfig},
    error::{SceneError, nearest},
    import::{ImportedLight, ImportedLightKind},
    placement::Placement,
    scene::StillLight,
};
use glam::DVec3;
use std::collections::BTreeMap;

/// What of the lights of an import is otherwise than in its file, by node.
pub(super) struct Overrides<'c, 'a> {
    by_node: Option<&'c BTreeMap<String, LightOverride>>,
    /// The table of these.
    field: Field<'a>,
}

impl<'c, 'a> Overrides<'c, 'a> {
    /// # Errors
    /// If a node that is named has no light.
    pub(super) fn new(
        by_node: Option<&'c BTreeMap<String, LightOverride>>,
        lights: &[ImportedLight],
        field: Field<'a>,
    ) -> Result<Self, SceneError> {
        let known = || lights.iter().map(|light| light.node.as_str());
        let is_unknown = |name: &&String| !known().any(|node| node == name.as_str());
        match by_node.and_then(|by_node| by_node.keys().find(is_unknown)) {
            None => Ok(Self { by_node, field }),
            Some(name) => Err(SceneError::UnknownName {
                place: field.key(name).place(),
                kind: "node with a light",
                found: name.clone(),
                nearest: nearest(name, known()),
                known: known().map(str::to_owned).collect(),
            }),
        }
    }

    fn of(&self, node: &str) -> Option<&'c LightOverride> {
        self.by_node?.get(node)
    }
}

/// Adds `light` of the import called `import`, where `placement` puts it, or the motion of its node. Its power stays what it
/// is, whatever the scale.
///
/// # Errors
/// If a value is none that a config may have.
pub(super) fn add(
    import: &str,
    light: ImportedLight,
    (placement, motion): (Placement, Option<&mut Motion>),
    overrides: &Overrides<'_, '_>,
    inputs: &mut Inputs<'_>,
) -> Result<(), SceneError> {
    let ImportedLight { node, position, direction, kind } = light;
    let changed = overrides.of(&node);
    if changed.is_some_and(|changed| changed.exclude == Some(true)) {
        return Ok(());
    }
    let name = format!("{import}/{node}");
    let has = match kind {
        ImportedLightKind::Point { .. } => (true, false),
        ImportedLightKind::Spot { .. } => (true, true),
        ImportedLightKind::Directional { .. } => (false, true),
    };
    let (position, direction) = match motion.and_then(|motion| motion.carry(&node, &name, has)) {
        Some(world) => light_at(&world, &placement),
        None => {
            let still = StillLight {
                import: import.to_owned(),
                light: name.clone(),
                position: has.0.then_some(position),
                direction: has.1.then_some(direction),
            };
            inputs.still_lights.push(still);
            (placement.apply(position), placement.turn(direction))
        }
    };
    let (position_m, direction) = (position.into(), direction.into());
    let colour = |c: DVec3| Some(OneOrThree(c.to_array()));
    let mut written = match kind {
        ImportedLightKind::Point { power } => LightConfig {
            power_w: colour(power),
            point: Some(PointConfig { position_m }),
            ..Default::default()
        },
        ImportedLightKind::Spot { power, inner_deg, outer_deg } => LightConfig {
            power_w: colour(power),
            spot: Some(SpotConfig {
                position_m,
                target_m: None,
                direction: Some(direction),
                outer_half_angle_deg: outer_deg,
                inner_half_angle_deg: Some(inner_deg),
            }),
            ..Default::default()
        },
        ImportedLightKind::Directional { irradiance } => LightConfig {
            irradiance_w_m2: colour(irradiance),
            directional: Some(DirectionalConfig { direction }),
            ..Default::default()
        },
    };
    if let Some(LightOverride { power_w, irradiance_w_m2, .. }) = changed {
        written.power_w = power_w.or(written.power_w);
        written.irradiance_w_m2 = irradiance_w_m2.or(written.irradiance_w_m2);
    }
    // Named as its node is, so that an error says which of the file it is.
    let plain = read_plain(&mut written, &overrides.field.key(&node))?;
    inputs.lights.insert(name.clone(), plain.expect("invariant: a light of a file has no surface"));
    inputs.written.insert(name, written);
    Ok(())
}
