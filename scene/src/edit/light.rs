//! Turns edits of a light by the keys of a config, or whole, into the light of the next version.

use super::{
    unknown_name,
    values::{Keys, Values},
};
use crate::{
    bake::Strength,
    build::{
        area_light,
        lights::{read_plain, read_power},
        sky::read_scale,
    },
    config::{Document, Field, LightConfig, MAX_LENGTH_M, MAX_POWER, OneOrThree, Vector},
    error::SceneError,
    scene::{LightId, Scene, SceneLight},
};
use glam::{DVec3, Vec3};
use photonstream_shading::{Light, LightShape};

const THREE: &str = "three numbers [x, y, z]";
const ONE_OR_THREE: &str = "a number or three numbers [r, g, b]";
const SPOT: &[&str] = &[
    "power_w",
    "enabled",
    "position_m",
    "target_m",
    "direction",
    "outer_half_angle_deg",
    "inner_half_angle_deg",
];
const POINT: &[&str] = &["power_w", "enabled", "position_m"];
const DIRECTIONAL: &[&str] = &["irradiance_w_m2", "enabled", "direction"];
const AREA: &[&str] = &["power_w", "enabled"];
const SKY: &[&str] = &["scale", "enabled"];

pub(super) fn set(scene: &mut Scene, name: &str, values: &Values) -> Result<LightId, SceneError> {
    let document = Document::default();
    let table = Field::root(&document).key("light");
    let field = table.key(name);
    let Some(id) = scene.light(name) else {
        return Err(unknown_name(&table, "light", name, scene.lights.iter().map(|l| l.name.as_str())));
    };
    let light = &scene.lights[id.0 as usize];
    if light.name != name_of_surface(scene, light) {
        return Err(field.invalid(
            "one face of an emitter of several",
            "a light with an object of its own",
            "edit its file, or show it by rectangles",
        ));
    }
    let edited = edited(light, values, scene.origin_m, &field)?;
    scene.lights[id.0 as usize] = edited;
    Ok(id)
}

/// The name of the object that shows a light, or its own.
fn name_of_surface<'s>(scene: &'s Scene, light: &'s SceneLight) -> &'s str {
    light.object.map_or(&light.name, |object| &scene.objects[object.0 as usize].name)
}

fn edited(
    light: &SceneLight,
    values: &Values,
    origin: DVec3,
    field: &Field<'_>,
) -> Result<SceneLight, SceneError> {
    let mut edited = light.clone();
    let (shape, valid) = match light.light.shape {
        LightShape::Spot { .. } => (Some("spot"), SPOT),
        LightShape::Point { .. } => (Some("point"), POINT),
        LightShape::Directional { .. } => (Some("directional"), DIRECTIONAL),
        LightShape::Parallelogram { .. } | LightShape::Triangle { .. } | LightShape::Mesh { .. } => {
            (Some("rectangle"), AREA)
        }
        LightShape::Sky { .. } => (Some("sky"), SKY),
    };
    let mut keys = Keys::read(values, shape, valid, field)?;
    edited.enabled = keys.take("enabled", "true or false", field)?.unwrap_or(light.enabled);
    let power: Option<OneOrThree> = keys.take("power_w", ONE_OR_THREE, field)?;
    edited.light = if let Some((_, strength)) = &mut edited.face {
        if let Some(power) = power {
            *strength = Strength::Power(read_power(Some(power), None, false, field)?);
        }
        area_light(light.light.shape.clone(), *strength)
    } else if let (Some(sky), Some(written)) =
        (light.light.shape.sky(), edited.written.as_mut().and_then(|written| written.sky.as_mut()))
    {
        written.scale = keys.take("scale", ONE_OR_THREE, field)?.or(written.scale);
        let scale = written.scale.unwrap_or(OneOrThree([1.0; 3]));
        let power = read_scale(scale, &field.key("sky"))? * sky.mean().as_dvec3();
        Light { shape: light.light.shape.clone(), power: power.as_vec3() }
    } else {
        let written =
            edited.written.as_mut().expect("invariant: lights without a surface come from a config");
        let irradiance = keys.take("irradiance_w_m2", ONE_OR_THREE, field)?;
        written.power_w = power.or(written.power_w);
        written.irradiance_w_m2 = irradiance.or(written.irradiance_w_m2);
        merge(written, &mut keys, &field.key(shape.unwrap_or_default()))?;
        let plain = read_plain(written, field)?;
        plain.expect("invariant: a light without a surface is no rectangle").around(origin)
    };
    if !edited.enabled {
        edited.light.power = Vec3::ZERO;
    }
    Ok(edited)
}

/// Writes what is given of a shape into its table.
fn merge(written: &mut LightConfig, keys: &mut Keys<'_>, field: &Field<'_>) -> Result<(), SceneError> {
    let position: Option<Vector> = keys.take("position_m", THREE, field)?;
    let direction: Option<Vector> = keys.take("direction", THREE, field)?;
    if let Some(point) = &mut written.point {
        point.position_m = position.unwrap_or(point.position_m);
    }
    if let Some(directional) = &mut written.directional {
        directional.direction = direction.unwrap_or(directional.direction);
    }
    if let Some(spot) = &mut written.spot {
        spot.position_m = position.unwrap_or(spot.position_m);
        let target = keys.take("target_m", THREE, field)?;
        if target.is_some() || direction.is_some() {
            (spot.target_m, spot.direction) = (target, direction);
        }
        let outer = keys.take("outer_half_angle_deg", "a number", field)?;
        let inner = keys.take("inner_half_angle_deg", "a number", field)?;
        // An inner angle left to its default follows the outer one.
        let is_default = spot.inner_half_angle_deg == Some(0.9 * spot.outer_half_angle_deg);
        spot.outer_half_angle_deg = outer.unwrap_or(spot.outer_half_angle_deg);
        if inner.is_some() || is_default {
            spot.inner_half_angle_deg = inner;
        }
    }
    Ok(())
}

pub(super) fn replace(scene: &mut Scene, id: LightId, light: Light) -> Result<(), SceneError> {
    let document = Document::default();
    let field = Field::root(&document).key("light");
    let Some(target) = scene.lights.get_mut(id.0 as usize) else {
        let expected = format!("a number below {}", scene.lights.len());
        return Err(field.invalid(format!("light {}", id.0), expected, "choose another light"));
    };
    let field = field.key(&target.name);
    if std::mem::discriminant(&target.light.shape) != std::mem::discriminant(&light.shape) {
        return Err(field.invalid(
            format!("{:?}", light.shape),
            "a light of the same kind",
            "load another config to change its kind",
        ));
    }
    check(&light, &field)?;
    if let Some((_, strength)) = &mut target.face {
        *strength = Strength::Power(light.power.as_dvec3());
    }
    target.light = light;
    Ok(())
}

fn check(light: &Light, field: &Field<'_>) -> Result<(), SceneError> {
    let wrong = |key: &str, found: String, expected: &str| {
        Err(field.key(key).invalid(found, expected, "change the value"))
    };
    let power = light.power;
    if !(power.is_finite() && power.min_element() >= 0.0 && f64::from(power.max_element()) <= MAX_POWER) {
        return wrong("power", power.to_string(), "values within [0, 1e15]");
    }
    let (positions, direction): (&[Vec3], Option<Vec3>) = match &light.shape {
        LightShape::Point { position } => (&[*position], None),
        LightShape::Spot { position, direction, .. } => (&[*position], Some(*direction)),
        LightShape::Directional { direction } => (&[], Some(*direction)),
        LightShape::Parallelogram { corner, edge_u, edge_v }
        | LightShape::Triangle { corner, edge_u, edge_v } => (&[*corner, *edge_u, *edge_v], None),
        LightShape::Sky { .. } | LightShape::Mesh { .. } => (&[], None),
    };
    for position in positions {
        if !(position.is_finite() && f64::from(position.abs().max_element()) <= MAX_LENGTH_M) {
            return wrong("position", position.to_string(), "numbers within ±1e9 m");
        }
    }
    if let Some(direction) = direction
        && (direction.is_nan() || (direction.length_squared() - 1.0).abs() > 1e-4)
    {
        return wrong("direction", direction.to_string(), "unit length");
    }
    if let LightShape::Spot { versine_inner: inner, versine_outer: outer, .. } = light.shape
        && !(outer > 0.0 && outer <= 2.0 && (0.0..=outer).contains(&inner))
    {
        return wrong("versine", format!("{inner} and {outer}"), "0 <= inner <= outer, 0 < outer <= 2");
    }
    Ok(())
}
