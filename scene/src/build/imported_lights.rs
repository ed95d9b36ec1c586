//! Turns a light of an imported file into one of the scene, as if a table of the config described it.

use super::{Inputs, imported_motion::Motion, lights::read_plain};
use crate::{
    animation::light_at,
    config::{DirectionalConfig, Field, LightConfig, OneOrThree, PointConfig, SpotConfig},
    error::SceneError,
    import::{ImportedLight, ImportedLightKind},
    placement::Placement,
};
use glam::DVec3;

/// Adds `light`, where `placement` puts it, or the motion of its node. Its power stays what it is, whatever the scale.
///
/// # Errors
/// If a value is none that a config may have.
pub(super) fn add(
    name: String,
    light: ImportedLight,
    (placement, motion): (Placement, Option<&mut Motion>),
    field: &Field<'_>,
    inputs: &mut Inputs<'_>,
) -> Result<(), SceneError> {
    let ImportedLight { node, position, direction, kind } = light;
    let has = match kind {
        ImportedLightKind::Point { .. } => (true, false),
        ImportedLightKind::Spot { .. } => (true, true),
        ImportedLightKind::Directional { .. } => (false, true),
    };
    let (position, direction) = match motion.and_then(|motion| motion.carry(&node, &name, has)) {
        Some(world) => light_at(&world, &placement),
        None => {
            let direction = placement.rotation * (placement.scale * direction);
            (placement.apply(position), direction.normalize_or_zero())
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
    // Named as the light is, so that an error says which of the file it is.
    let plain = read_plain(&mut written, &field.key(&name))?;
    inputs.lights.insert(name.clone(), plain.expect("invariant: a light of a file has no surface"));
    inputs.written.insert(name, written);
    Ok(())
}
