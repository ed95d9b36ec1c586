//! Turns an edit of VPLs, blockers and proxies by the tables of a config into those of the next version.

use super::values::{Keys, Values};
use crate::{
    build::vpls::{Anchors, read},
    config::{Document, Field, VplsConfig},
    error::SceneError,
    scene::Scene,
    settings::PhantomSurfaces,
};
use serde_json::Value;
use std::sync::Arc;

const KEYS: [&str; 4] = ["vpls", "vpl", "blocker", "proxy"];

/// Replaces the tables that are given; of the settings, those that are.
pub(super) fn set(scene: &mut Scene, values: &Values) -> Result<(), SceneError> {
    let document = Document::default();
    let root = Field::root(&document);
    let mut keys = Keys::read(values, None, &KEYS, &root)?;
    let mut tables = scene.vpls.tables.clone();
    let surfaces =
        |has_proxies: bool| if has_proxies { PhantomSurfaces::Proxies } else { PhantomSurfaces::Scene };
    if let Some(vpls) = &mut tables.vpls
        && vpls.phantom_surfaces == Some(surfaces(!tables.proxy.is_empty()))
    {
        // The default goes with the proxies that come or go.
        vpls.phantom_surfaces = None;
    }
    if let Some(given) = keys.take::<Values>("vpls", "a table of settings", &root)? {
        tables.vpls = Some(merged(tables.vpls.unwrap_or_default(), given, &root.key("vpls"))?);
    }
    tables.vpl = keys.take("vpl", "a list of tables as [[vpl]]", &root)?.unwrap_or(tables.vpl);
    tables.blocker =
        keys.take("blocker", "a list of tables as [[blocker]]", &root)?.unwrap_or(tables.blocker);
    tables.proxy = keys.take("proxy", "a list of tables as [[proxy]]", &root)?.unwrap_or(tables.proxy);
    let anchors =
        Anchors { objects: &scene.objects, rest_meshes: &scene.rest_meshes, origin: scene.origin_m };
    let set = read(tables, &root, scene.streaming.method, &anchors)?;
    scene.vpls = Arc::new(set);
    Ok(())
}

/// Settings with those that are `given` in their place.
fn merged(settings: VplsConfig, given: Values, field: &Field<'_>) -> Result<VplsConfig, SceneError> {
    let mut all = match serde_json::to_value(&settings) {
        Ok(Value::Object(all)) => all,
        _ => Values::new(),
    };
    // What is not set is told by its absence.
    all.retain(|_, value| !value.is_null());
    all.extend(given);
    serde_json::from_value(Value::Object(all))
        .map_err(|error| SceneError::WrongType { place: field.place(), problem: error.to_string() })
}
