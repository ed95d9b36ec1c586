//! Turns a scene into the changes of it that are measured: a light recoloured, a light moved, a body moved.

use glam::{DVec3, Vec3};
use photonstream_protocol::Request;
use photonstream_scene::{LightId, ObjectId, Scene, SceneConfig};
use photonstream_shading::LightShape;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The changes to measure: a name, and requests that go to and fro.
pub(super) fn changes(scene: &Scene) -> Vec<(String, [Request; 2])> {
    [recoloured_light(scene), moved_object(scene), moved_light(scene)].into_iter().flatten().collect()
}

fn values(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn brightest(scene: &Scene) -> Option<LightId> {
    let power = |i: &u32| {
        let light = &scene.lights[*i as usize].light;
        (light.power * light.shape.watts_per_power(scene.bounds)).element_sum()
    };
    (0..scene.lights.len() as u32).max_by(|a, b| power(a).total_cmp(&power(b))).map(LightId)
}

fn recoloured_light(scene: &Scene) -> Option<(String, [Request; 2])> {
    let light = &scene.lights[brightest(scene)?.0 as usize];
    let key = match light.light.shape {
        LightShape::Directional { .. } => "irradiance_w_m2",
        LightShape::Sky { .. } => "scale",
        _ => "power_w",
    };
    let power = match light.light.shape.sky() {
        Some(sky) => sky.scale_of(light.light.power),
        None => light.light.power,
    };
    let set = |power: Vec3| Request::SetLight {
        name: light.name.clone(),
        values: values(json!({ key: power.to_array() })),
    };
    Some((format!("{} recoloured", light.name), [set(power * Vec3::new(0.5, 0.8, 1.2)), set(power)]))
}

fn moved_light(scene: &Scene) -> Option<(String, [Request; 2])> {
    let light = &scene.lights[brightest(scene)?.0 as usize];
    let step = 0.1 * f64::from(scene.bounds.radius);
    let (key, from, to) = match light.light.shape {
        LightShape::Point { position } | LightShape::Spot { position, .. } => {
            let from = position.as_dvec3() + scene.origin_m;
            ("position_m", from, from - DVec3::X * step)
        }
        LightShape::Directional { direction } => {
            let from = direction.as_dvec3();
            ("direction", from, from + DVec3::X * 0.1)
        }
        LightShape::Parallelogram { .. }
        | LightShape::Triangle { .. }
        | LightShape::Mesh { .. }
        | LightShape::Sky { .. } => return None,
    };
    let set = |to: DVec3| Request::SetLight {
        name: light.name.clone(),
        values: values(json!({ key: to.to_array() })),
    };
    Some((format!("{} moved", light.name), [set(to), set(from)]))
}

/// The smallest body that can be moved, by its radius towards the middle of the scene.
pub(super) fn moved_object(scene: &Scene) -> Option<(String, [Request; 2])> {
    let config = SceneConfig::from_text(&scene.resolved_text, Path::new("")).ok()?;
    let half = |id: &u32| {
        let corners = scene.objects[*id as usize].triangles.clone().flat_map(|t| scene.geometry.triangle(t));
        let (low, high) =
            corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        0.5 * (high - low).as_dvec3()
    };
    let is_body = |id: &u32| {
        let object = &scene.objects[*id as usize];
        object.emitter.is_none() && config.object.contains_key(&object.name) && half(id).min_element() > 0.0
    };
    let id = (0..scene.objects.len() as u32)
        .filter(is_body)
        .min_by(|a, b| half(a).length().total_cmp(&half(b).length()))
        .map(ObjectId)?;
    let object = &scene.objects[id.0 as usize];
    let written = config.object[&object.name].position_m.map_or(DVec3::ZERO, |p| p.0.into());
    let radius = half(&id.0).x;
    let side = if object.world_from_rest.translation.x > 0.0 { -1.0 } else { 1.0 };
    let set = |to: DVec3| Request::MoveObject {
        name: object.name.clone(),
        values: values(json!({ "position_m": to.to_array() })),
    };
    let requests = [set(written + DVec3::X * side * radius), set(written)];
    Some((format!("{} moved by its radius", object.name), requests))
}
