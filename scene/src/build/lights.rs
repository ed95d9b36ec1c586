//! Turns `[light.NAME]` tables into lights, and area lights into objects that show them.

use super::{Inputs, check_name, materials::Materials, sky};
use crate::{
    bake::{Emitter, EmitterFace, Part, Strength},
    config::{
        DirectionalConfig, Field, LightConfig, OneOrThree, PointConfig, RectangleConfig, SpotConfig, Vector,
    },
    error::SceneError,
    import::AssetRoots,
    placement::Placement,
    primitives::quad,
    scene::Sides,
};
use glam::DVec3;
use photonstream_shading::{Light, LightShape, Sky};
use std::{collections::BTreeMap, sync::Arc};

/// Smallest half angle of a spot: below, f32 directions in the cone are too few to tell apart.
const MIN_HALF_ANGLE_DEG: f64 = 0.01;

/// A light without a surface, in the config's coordinates.
#[derive(Clone, Debug)]
pub(crate) struct PlainLight {
    pub(super) power: DVec3,
    pub(super) shape: PlainShape,
}

#[derive(Clone, Debug)]
pub(super) enum PlainShape {
    Point { position: DVec3 },
    Spot { position: DVec3, direction: DVec3, inner_deg: f64, outer_deg: f64 },
    Directional { direction: DVec3 },
    Sky(Arc<Sky>),
}

impl PlainLight {
    /// The light in the space of a scene around `origin`.
    pub(crate) fn around(self, origin: DVec3) -> Light {
        let shape = match self.shape {
            PlainShape::Point { position } => LightShape::Point { position: (position - origin).as_vec3() },
            PlainShape::Spot { position, direction, inner_deg, outer_deg } => LightShape::Spot {
                position: (position - origin).as_vec3(),
                direction: direction.as_vec3().normalize(),
                versine_inner: versine(inner_deg),
                versine_outer: versine(outer_deg),
            },
            PlainShape::Directional { direction } => {
                LightShape::Directional { direction: direction.as_vec3().normalize() }
            }
            PlainShape::Sky(sky) => LightShape::Sky { sky },
        };
        Light { shape, power: self.power.as_vec3() }
    }
}

/// 1 - cos of an angle, without the cancellation.
fn versine(degrees: f64) -> f32 {
    (2.0 * (degrees.to_radians() * 0.5).sin().powi(2)) as f32
}

pub(super) fn read<'a>(
    table: &mut BTreeMap<String, LightConfig>,
    field: &Field<'a>,
    roots: &AssetRoots,
    materials: &mut Materials,
    inputs: &mut Inputs<'a>,
) -> Result<(), SceneError> {
    let mut sky_name: Option<&str> = None;
    for (name, light) in table {
        let field = field.key(name);
        check_name(name, &field)?;
        if light.sky.is_some() {
            if let Some(other) = sky_name.replace(name) {
                let found = format!("a second sky besides \"{other}\"");
                return Err(field.key("sky").invalid(
                    found,
                    "one sky in a scene",
                    "join them, or leave one out",
                ));
            }
            let sky = sky::read(light, &field, roots, inputs)?;
            inputs.lights.insert(name.clone(), sky);
            inputs.written.insert(name.clone(), light.clone());
            continue;
        }
        let Some(plain) = read_plain(light, &field)? else {
            let LightConfig { power_w, irradiance_w_m2, rectangle, .. } = light;
            let rectangle = rectangle.as_mut().expect("invariant: a light that is not plain is a rectangle");
            let power = read_power(*power_w, *irradiance_w_m2, false, &field)?;
            let part = read_rectangle(name, rectangle, power, &field, materials)?;
            if inputs.parts.contains_key(name) {
                return Err(field.invalid(
                    format!("the name \"{name}\" twice, for an object and for this rectangle"),
                    "different names: the object that shows a rectangle is called like its light",
                    "rename one of them",
                ));
            }
            inputs.parts.insert(name.clone(), part);
            continue;
        };
        inputs.lights.insert(name.clone(), plain);
        inputs.written.insert(name.clone(), light.clone());
    }
    Ok(())
}

/// A light without a surface, but a sky; `None` for a rectangle. Fills in the defaults.
///
/// # Errors
/// If it has not exactly one shape, or a value is not valid.
pub(crate) fn read_plain(
    light: &mut LightConfig,
    field: &Field<'_>,
) -> Result<Option<PlainLight>, SceneError> {
    let LightConfig { power_w, irradiance_w_m2, spot, point, directional, rectangle, sky: _ } = light;
    let shape = match (spot, point, directional, rectangle) {
        (Some(spot), None, None, None) => read_spot(spot, &field.key("spot"))?,
        (None, Some(point), None, None) => read_point(point, &field.key("point"))?,
        (None, None, Some(directional), None) => read_directional(directional, &field.key("directional"))?,
        (None, None, None, Some(_)) => return Ok(None),
        (spot, point, directional, rectangle) => {
            let given = [
                ("spot", spot.is_some()),
                ("point", point.is_some()),
                ("directional", directional.is_some()),
                ("rectangle", rectangle.is_some()),
                ("sky", false),
            ];
            return Err(not_one_of(field, &given));
        }
    };
    let irradiance = matches!(shape, PlainShape::Directional { .. });
    let power = read_power(*power_w, *irradiance_w_m2, irradiance, field)?;
    Ok(Some(PlainLight { power, shape }))
}

/// The error of a table that should have exactly one of some keys.
pub(crate) fn not_one_of(field: &Field<'_>, keys: &[(&str, bool)]) -> SceneError {
    let given: Vec<_> = keys.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
    let all: Vec<_> = keys.iter().map(|(key, _)| *key).collect();
    let found = if given.is_empty() { "none".to_owned() } else { given.join(" and ") };
    let remedy =
        if given.is_empty() { "add one" } else { "keep one and move the others to tables of their own" };
    field.invalid(found, format!("exactly one of {}", all.join(", ")), remedy)
}

pub(crate) fn read_power(
    power: Option<OneOrThree>,
    irradiance: Option<OneOrThree>,
    wants_irradiance: bool,
    field: &Field<'_>,
) -> Result<DVec3, SceneError> {
    let (wanted, other, value, unwanted) = if wants_irradiance {
        ("irradiance_w_m2", "power_w", irradiance, power)
    } else {
        ("power_w", "irradiance_w_m2", power, irradiance)
    };
    if unwanted.is_some() {
        return Err(field.key(other).invalid(
            other,
            wanted,
            "directional lights take irradiance_w_m2, all others power_w",
        ));
    }
    let value = value.ok_or_else(|| field.missing(wanted))?;
    field.key(wanted).power(value)
}

fn read_point(point: &PointConfig, field: &Field<'_>) -> Result<PlainShape, SceneError> {
    Ok(PlainShape::Point { position: field.key("position_m").metres(point.position_m)? })
}

fn read_directional(directional: &DirectionalConfig, field: &Field<'_>) -> Result<PlainShape, SceneError> {
    Ok(PlainShape::Directional { direction: field.key("direction").direction(directional.direction)? })
}

fn read_spot(spot: &mut SpotConfig, field: &Field<'_>) -> Result<PlainShape, SceneError> {
    let position = field.key("position_m").metres(spot.position_m)?;
    let direction = match (spot.target_m, spot.direction) {
        (Some(target), None) => {
            let field = field.key("target_m");
            let axis = field.metres(target)? - position;
            axis.try_normalize().ok_or_else(|| {
                field.invalid("the light's own position", "a point apart from position_m", "move target_m")
            })?
        }
        (None, Some(direction)) => field.key("direction").direction(direction)?,
        (target, direction) => {
            let given = [("target_m", target.is_some()), ("direction", direction.is_some())];
            return Err(not_one_of(field, &given));
        }
    };
    let outer_deg = field.key("outer_half_angle_deg").number(
        spot.outer_half_angle_deg,
        "half an opening angle from 0.01 to 180 degrees",
        |x| (MIN_HALF_ANGLE_DEG..=180.0).contains(&x),
    )?;
    let inner = *spot.inner_half_angle_deg.get_or_insert(0.9 * outer_deg);
    let expected = format!("an angle from 0 to outer_half_angle_deg = {outer_deg}");
    let inner_deg =
        field.key("inner_half_angle_deg").number(inner, &expected, |x| (0.0..=outer_deg).contains(&x))?;
    Ok(PlainShape::Spot { position, direction, inner_deg, outer_deg })
}

fn read_rectangle<'a>(
    name: &str,
    rectangle: &mut RectangleConfig,
    power: DVec3,
    field: &Field<'a>,
    materials: &mut Materials,
) -> Result<Part<'a>, SceneError> {
    let field = field.key("rectangle");
    let albedo = *rectangle.albedo.get_or_insert(OneOrThree([0.0; 3]));
    let albedo = field.key("albedo").albedo(albedo)?;
    let material = format!("{name}/emitter");
    materials.add(material.clone(), albedo, None);
    let RectangleConfig { position_m, rotation_deg, scale, .. } = rectangle;
    let placement = Placement::resolve(position_m, rotation_deg, scale, &field)?;
    let mesh = read_quad([rectangle.corner_m, rectangle.edge_u_m, rectangle.edge_v_m], &field)?;
    Ok(Part {
        name: name.to_owned(),
        field,
        material,
        sides: Sides::Front,
        mesh,
        placement,
        is_imported: false,
        moves: false,
        emitter: Some(Emitter {
            strength: Strength::Power(power),
            faces: vec![EmitterFace::Parallelogram([0, 1, 3])],
        }),
    })
}

/// The mesh of a quad given by corner and edges.
pub(super) fn read_quad(
    [corner, edge_u, edge_v]: [Vector; 3],
    field: &Field<'_>,
) -> Result<crate::primitives::Mesh, SceneError> {
    let corner = field.key("corner_m").metres(corner)?;
    let edge_u = field.key("edge_u_m").metres(edge_u)?;
    let edge_v = field.key("edge_v_m").metres(edge_v)?;
    if edge_u.cross(edge_v).length() == 0.0 {
        return Err(field.key("edge_v_m").invalid(
            "edges that are parallel or zero",
            "two edges that span an area",
            "change edge_u_m or edge_v_m",
        ));
    }
    Ok(quad(corner, edge_u, edge_v))
}
