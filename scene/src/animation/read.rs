//! Turns `[[animation]]` tables into validated tracks of the lights and objects they name.

use super::{
    Animation, Kind, Target,
    track::{Path, Track},
};
use crate::{
    build::not_one_of,
    config::{
        AnimatedProperty, AnimatedValue, AnimationConfig, Field, Interpolation, LightConfig, OneOrThree,
        OrbitConfig, SceneConfig, Vector,
    },
    error::{SceneError, nearest},
};
use glam::DVec3;
use std::collections::BTreeMap;

/// Longest time of an animation, s: 30 years.
const MAX_TIME_S: f64 = 1e9;

/// Directions between two keyframes stay at least this long, relative to the longer of them.
const SHORTEST_DIRECTION: f64 = 1e-6;

/// Reads the animations of a config, writes their defaults into it, and brings them into an order of their own.
///
/// # Errors
/// If a table names no light or object, a property it has not or that is animated already, or its numbers are not valid.
pub(crate) fn read(config: &mut SceneConfig, root: &Field<'_>) -> Result<Animation, SceneError> {
    let mut targets: BTreeMap<(bool, String), Target> = BTreeMap::new();
    let mut tables = std::mem::take(&mut config.animation);
    for (number, table) in tables.iter_mut().enumerate() {
        let field = root.key("animation").element(number);
        let (kind, name) = target(table, config, &field)?;
        let property = property(table, kind, &field)?;
        let repeat = *table.repeat.get_or_insert_default();
        let track = Track { path: path(table, kind, property, &field)?, repeat };
        let target = targets.entry((kind == Kind::Object, name.clone())).or_insert_with(|| Target {
            kind,
            name,
            tracks: Vec::new(),
        });
        check_single(target, property, &field)?;
        target.tracks.push((property, track));
    }
    tables.sort_by(|a, b| key(a).cmp(&key(b)));
    config.animation = tables;
    let mut targets: Vec<Target> = targets.into_values().collect();
    targets.iter_mut().for_each(|target| target.tracks.sort_by_key(|(property, _)| property.name()));
    Ok(Animation { targets, rigs: Vec::new() })
}

/// What tells animations apart: their order in the file has no effect.
fn key(table: &AnimationConfig) -> (Option<&str>, Option<&str>, Option<&str>) {
    (table.light.as_deref(), table.object.as_deref(), table.property.map(AnimatedProperty::name))
}

/// What a table changes, and its name.
fn target(
    table: &AnimationConfig,
    config: &SceneConfig,
    field: &Field<'_>,
) -> Result<(Kind, String), SceneError> {
    let unknown = |what: &'static str, found: &str, known: Vec<&str>| SceneError::UnknownName {
        place: field.key(what).place(),
        kind: what,
        found: found.to_owned(),
        nearest: nearest(found, known.iter().copied()),
        known: known.into_iter().map(str::to_owned).collect(),
    };
    match (&table.light, &table.object) {
        (Some(name), None) => {
            let Some(light) = config.light.get(name) else {
                return Err(unknown("light", name, config.light.keys().map(String::as_str).collect()));
            };
            // A light of several shapes or none is refused where lights are read.
            let kind = match light {
                LightConfig { spot: Some(_), .. } => Kind::Spot,
                LightConfig { directional: Some(_), .. } => Kind::Directional,
                LightConfig { rectangle: Some(_), .. } => Kind::Rectangle,
                LightConfig { sky: Some(_), .. } => Kind::Sky,
                _ => Kind::Point,
            };
            Ok((kind, name.clone()))
        }
        (None, Some(name)) if config.object.contains_key(name) => Ok((Kind::Object, name.clone())),
        (None, Some(name)) => {
            Err(unknown("object", name, config.object.keys().map(String::as_str).collect()))
        }
        (light, object) => {
            Err(not_one_of(field, &[("light", light.is_some()), ("object", object.is_some())]))
        }
    }
}

fn property(table: &AnimationConfig, kind: Kind, field: &Field<'_>) -> Result<AnimatedProperty, SceneError> {
    let property = table.property.ok_or_else(|| field.missing("property"))?;
    if kind.properties().contains(&property) {
        return Ok(property);
    }
    let names: Vec<_> = kind.properties().iter().map(|p| p.name()).collect();
    let what = match kind {
        Kind::Object => "an object",
        Kind::Rectangle => "a rectangle",
        Kind::Spot => "a spot",
        Kind::Point => "a point light",
        Kind::Directional => "a directional light",
        Kind::Sky => "a sky",
    };
    Err(field.key("property").invalid(
        format!("\"{}\"", property.name()),
        format!("what {what} has: {}", names.join(", ")),
        "choose one of these, or animate something else",
    ))
}

/// Refuses two animations that would contradict each other.
fn check_single(target: &Target, property: AnimatedProperty, field: &Field<'_>) -> Result<(), SceneError> {
    let is_axis = |p| matches!(p, AnimatedProperty::Direction | AnimatedProperty::Target);
    let contradicts = |p| p == property || is_axis(p) && is_axis(property);
    match target.tracks.iter().find(|(other, _)| contradicts(*other)) {
        None => Ok(()),
        Some((other, _)) => Err(field.key("property").invalid(
            format!("{} besides {} of \"{}\"", property.name(), other.name(), target.name),
            "one animation for each property",
            "join them, or leave one out",
        )),
    }
}

fn path(
    table: &mut AnimationConfig,
    kind: Kind,
    property: AnimatedProperty,
    field: &Field<'_>,
) -> Result<Path, SceneError> {
    let remedy = "give times_s and values, or an orbit";
    let expected = "times_s with values, or an orbit";
    match (&table.times_s, &mut table.values, &mut table.orbit) {
        (Some(times), Some(values), None) => {
            let interpolation = *table.interpolation.get_or_insert_default();
            // The scale of a sky is a strength: none is the factor 0.
            let as_read = match (kind, property) {
                (Kind::Sky, AnimatedProperty::Scale) => AnimatedProperty::Power,
                _ => property,
            };
            keyframes(times, values, interpolation, as_read, field)
        }
        (None, None, Some(orbit)) => {
            if table.interpolation.is_some() {
                let field = field.key("interpolation");
                return Err(field.invalid("interpolation of an orbit", expected, "leave it out"));
            }
            read_orbit(orbit, property, &field.key("orbit"))
        }
        (None, None, None) => Err(field.invalid("neither", expected, remedy)),
        (_, _, Some(_)) => Err(field.key("orbit").invalid("an orbit and keyframes", expected, remedy)),
        (None, Some(_), None) => Err(field.missing("times_s")),
        (Some(_), None, None) => Err(field.missing("values")),
    }
}

fn read_orbit(
    orbit: &mut OrbitConfig,
    property: AnimatedProperty,
    field: &Field<'_>,
) -> Result<Path, SceneError> {
    if !matches!(property, AnimatedProperty::Position | AnimatedProperty::Target) {
        let found = format!("an orbit of {}", property.name());
        return Err(field.invalid(found, "position_m or target_m", "give times_s and values instead"));
    }
    let phase = *orbit.phase_deg.get_or_insert(0.0);
    let phase =
        field.key("phase_deg").number(phase, "an angle within ±36000 degrees", |x| x.abs() <= 36_000.0)?;
    let period = field
        .key("period_s")
        .number(orbit.period_s, "a time of 0.001 to 1e9 s", |x| (1e-3..=MAX_TIME_S).contains(&x))?;
    Ok(Path::orbit(
        field.key("centre_m").metres(orbit.centre_m)?,
        field.key("axis").direction(orbit.axis)?,
        field.key("radius_m").length(orbit.radius_m)?,
        period,
        phase / 360.0,
    ))
}

fn keyframes(
    times: &[f64],
    written: &mut [AnimatedValue],
    interpolation: Interpolation,
    property: AnimatedProperty,
    field: &Field<'_>,
) -> Result<Path, SceneError> {
    check_times(times, &field.key("times_s"))?;
    let field = field.key("values");
    if written.len() != times.len() {
        let expected = format!("as many as times_s: {}", times.len());
        return Err(field.invalid(format!("{} values", written.len()), expected, "give one for each time"));
    }
    let mut values = Vec::with_capacity(written.len());
    for (number, value) in written.iter_mut().enumerate() {
        let field = field.element(number);
        let (read, three) = read_value(*value, property, &field)?;
        // One way to write each value: what says the same has the same hash.
        *value = AnimatedValue::Three(three);
        if let Some(&before) = values.last()
            && interpolation != Interpolation::Step
        {
            check_between(before, read, property, &field)?;
        }
        values.push(read);
    }
    Ok(Path::Keyframes { times: times.to_vec(), values, interpolation })
}

fn check_times(times: &[f64], field: &Field<'_>) -> Result<(), SceneError> {
    if times.is_empty() {
        return Err(field.invalid("no time", "at least one", "give a time for each value"));
    }
    for (number, &time) in times.iter().enumerate() {
        let field = field.element(number);
        field.number(time, "a time from 0 to 1e9 s", |x| (0.0..=MAX_TIME_S).contains(&x))?;
        if number > 0 && time <= times[number - 1] {
            let found = format!("{time} after {}", times[number - 1]);
            return Err(field.invalid(found, "times that increase", "put the keyframes in order"));
        }
    }
    Ok(())
}

/// A value of a property: as it is written, for f64 to interpolate, and as three numbers.
fn read_value(
    value: AnimatedValue,
    property: AnimatedProperty,
    field: &Field<'_>,
) -> Result<(DVec3, [f64; 3]), SceneError> {
    use AnimatedProperty as P;
    let three = match value {
        AnimatedValue::Three(three) => three,
        AnimatedValue::One(one) if matches!(property, P::Scale | P::Power | P::Irradiance) => [one; 3],
        AnimatedValue::One(one) => {
            return Err(field.invalid(one, "three numbers [x, y, z]", "write all three"));
        }
    };
    match property {
        P::Position | P::Target => field.metres(Vector(three))?,
        P::Rotation => field.degrees(Vector(three))?,
        P::Scale => field.scale(OneOrThree(three))?,
        P::Power | P::Irradiance => field.power(OneOrThree(three))?,
        P::Direction => field.direction(Vector(three))?,
    };
    Ok((DVec3::from_array(three), three))
}

/// Refuses what is valid at two keyframes and not between them.
fn check_between(
    before: DVec3,
    after: DVec3,
    property: AnimatedProperty,
    field: &Field<'_>,
) -> Result<(), SceneError> {
    let found = || format!("{after} after {before}");
    match property {
        AnimatedProperty::Scale if (before * after).min_element() <= 0.0 => Err(field.invalid(
            found(),
            "factors of one sign: a scale of 0 on the way has no shape",
            "keep the sign, or use interpolation = \"step\"",
        )),
        AnimatedProperty::Direction => {
            let way = after - before;
            let nearest = (-before.dot(way) / way.length_squared()).clamp(0.0, 1.0);
            let shortest = (before + way * nearest).length();
            // No way at all: NaN, and nothing on it.
            if shortest >= SHORTEST_DIRECTION * before.length().max(after.length()) || way == DVec3::ZERO {
                return Ok(());
            }
            Err(field.invalid(
                found(),
                "a direction that is not the opposite of the one before",
                "add a keyframe between them, or use interpolation = \"step\"",
            ))
        }
        _ => Ok(()),
    }
}
