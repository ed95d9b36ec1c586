//! Turns a config with animations into the config without them of what it shows at one moment.

use super::{Animation, Kind, check_time, read::read};
use crate::{
    config::{AnimatedProperty, Field, LightConfig, OneOrThree, SceneConfig, Vector},
    error::SceneError,
};
use glam::DVec3;

impl SceneConfig {
    /// The config of the scene as it is at `time_s`, without animations: what it is built to equals the animated scene at
    /// that time bit for bit.
    ///
    /// A config without `origin_m` is built once for the origin that its scene has; that of a resolved text is not.
    ///
    /// # Errors
    /// If the time is not finite, an animation is not valid, or the origin is needed and the config cannot be built.
    pub fn at(&self, time_s: f64) -> Result<Self, SceneError> {
        check_time(time_s)?;
        let mut frozen = self.clone();
        let has_files = frozen.object.values().any(|object| object.gltf.is_some());
        // They are built once, too.
        let has_files = has_files || frozen.has_attached();
        if (has_files || !frozen.animation.is_empty()) && frozen.origin_m.is_none() {
            frozen.origin_m = Some(self.clone().build()?.origin_m.into());
        }
        if time_s != 0.0 {
            frozen.carry_attached(time_s)?;
        }
        let document = std::mem::take(&mut frozen.document);
        let animation = read(&mut frozen, &Field::root(&document))?;
        animation.write(time_s, &mut frozen);
        frozen.animation.clear();
        for gltf in frozen.object.values_mut().filter_map(|object| object.gltf.as_mut()) {
            gltf.animation_time_s.get_or_insert(time_s);
        }
        frozen.document = document;
        Ok(frozen)
    }
}

impl Animation {
    /// Writes the values at a finite time into the tables of the config it was read from.
    pub(crate) fn write(&self, time_s: f64, config: &mut SceneConfig) {
        for target in &self.targets {
            for (property, track) in &target.tracks {
                let value = track.at(time_s);
                if target.kind == Kind::Object {
                    if let Some(object) = config.object.get_mut(&target.name) {
                        let places = (&mut object.position_m, &mut object.rotation_deg, &mut object.scale);
                        write_placement(*property, value, places);
                    }
                } else if let Some(light) = config.light.get_mut(&target.name) {
                    write_light(*property, value, light);
                }
            }
        }
    }
}

fn write_placement(
    property: AnimatedProperty,
    value: DVec3,
    (position, angles, scale): (&mut Option<Vector>, &mut Option<Vector>, &mut Option<OneOrThree>),
) {
    match property {
        AnimatedProperty::Position => *position = Some(value.into()),
        AnimatedProperty::Rotation => *angles = Some(value.into()),
        AnimatedProperty::Scale => *scale = Some(OneOrThree(value.to_array())),
        _ => {}
    }
}

fn write_light(property: AnimatedProperty, value: DVec3, light: &mut LightConfig) {
    let vector = Vector::from(value);
    match property {
        AnimatedProperty::Power => light.power_w = Some(OneOrThree(value.to_array())),
        AnimatedProperty::Irradiance => light.irradiance_w_m2 = Some(OneOrThree(value.to_array())),
        _ => {}
    }
    if let Some(point) = &mut light.point
        && property == AnimatedProperty::Position
    {
        point.position_m = vector;
    }
    if let Some(directional) = &mut light.directional
        && property == AnimatedProperty::Direction
    {
        directional.direction = vector;
    }
    if let Some(spot) = &mut light.spot {
        match property {
            AnimatedProperty::Position => spot.position_m = vector,
            AnimatedProperty::Target => (spot.target_m, spot.direction) = (Some(vector), None),
            AnimatedProperty::Direction => (spot.target_m, spot.direction) = (None, Some(vector)),
            _ => {}
        }
    }
    if let Some(sky) = &mut light.sky
        && property == AnimatedProperty::Scale
    {
        sky.scale = Some(OneOrThree(value.to_array()));
    }
    if let Some(shape) = &mut light.rectangle {
        write_placement(property, value, (&mut shape.position_m, &mut shape.rotation_deg, &mut shape.scale));
    }
}
