//! Turns a set of VPLs, blockers and proxies, and the text of a config, into the text that says so: all else of it stays,
//! comments and order, too.

use super::{
    VplSet, VplTables,
    align::{Step, steps},
};
use crate::{
    SceneConfig, SceneError,
    config::{Field, ProxyConfig, Vector, VplConfig, VplsConfig},
    settings::PhantomSurfaces,
};
use serde::Serialize;
use std::{collections::BTreeMap, path::Path};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, Value};

impl VplSet {
    /// The text of a config with the tables of this set in the place of its own: entries that are the same stay as they are
    /// written, those that differ keep their comments.
    ///
    /// # Errors
    /// If `text`, which is that of `file`, is no config.
    pub fn written_into(&self, text: &str, file: &Path) -> Result<String, SceneError> {
        let config = SceneConfig::from_text(text, file)?;
        let unreadable = |error: toml_edit::TomlError| SceneError::WrongType {
            place: Field::root(&config.document).place(),
            problem: error.to_string(),
        };
        let mut document: DocumentMut = text.parse().map_err(unreadable)?;
        let VplTables { vpls, vpl, blocker, proxy } = &self.tables;
        if let Some(vpls) = vpls {
            let before = config.vpls.clone().unwrap_or_default();
            write_settings(&mut document, &before, vpls, &defaults(!proxy.is_empty()));
        }
        // What tells that an entry is as `place` has written it stays in it, whoever the tables come from.
        let unmarked = |list: &[VplConfig]| -> Vec<VplConfig> {
            list.iter().map(|vpl| VplConfig { placed: None, ..vpl.clone() }).collect()
        };
        write_list(&mut document, "vpl", &unmarked(&config.vpl), &unmarked(vpl));
        write_list(&mut document, "blocker", &config.blocker, blocker);
        let before: Vec<ProxyConfig> = config.proxy.iter().cloned().map(with_defaults).collect();
        write_list(&mut document, "proxy", &before, proxy);
        Ok(document.to_string())
    }
}

/// A proxy with what [`VplTables`] say where a config says nothing.
fn with_defaults(mut proxy: ProxyConfig) -> ProxyConfig {
    proxy.position_m.get_or_insert_with(Vector::default);
    proxy.rotation_deg.get_or_insert_with(Vector::default);
    if let Some(cuboid) = &mut proxy.cuboid {
        cuboid.centre_m.get_or_insert_with(Vector::default);
    }
    proxy
}

/// Settings that are neither what the text says nor, where it says nothing, the default.
fn write_settings(document: &mut DocumentMut, before: &VplsConfig, now: &VplsConfig, default: &VplsConfig) {
    let (before, now, default) = (table(before), table(now), table(default));
    let is_same = |key: &str, value: &Item| {
        let said = before.get(key).or_else(|| default.get(key));
        said.is_some_and(|said| said.to_string() == value.to_string())
    };
    let changed: Vec<_> = now.iter().filter(|(key, value)| !is_same(key, value)).collect();
    if changed.is_empty() {
        return;
    }
    let settings = document.entry("vpls").or_insert_with(|| Item::Table(Table::new()));
    if let Some(settings) = settings.as_table_like_mut() {
        changed.into_iter().for_each(|(key, value)| put(settings, key, value));
    }
}

/// What a config has that says nothing.
fn defaults(has_proxies: bool) -> VplsConfig {
    let surfaces = if has_proxies { PhantomSurfaces::Proxies } else { PhantomSurfaces::Scene };
    let settings = crate::settings::VplSettings::default();
    let widen = |x: f32| x.to_string().parse().ok();
    VplsConfig {
        area_per_weight_m2: widen(settings.area_per_weight),
        cull_intensity_w_sr: widen(settings.cull_intensity),
        weights: Some(settings.weights),
        visibility: Some(settings.visibility),
        phantom_surfaces: Some(surfaces),
        softening_m2: widen(settings.softening),
        smoothing_s: widen(settings.smoothing_s),
        second_bounce_albedo: widen(settings.second_bounce_albedo),
        second_bounce_distance_m: widen(settings.second_bounce_distance),
        photons: Some(settings.photons),
        placed: None,
    }
}

/// Entries of an array of tables: each becomes what it is most like, and keeps its comments; the others go and come.
fn write_list<T: Serialize + PartialEq>(document: &mut DocumentMut, name: &str, before: &[T], now: &[T]) {
    if before == now {
        return;
    }
    let list = document.entry(name).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    let Some(tables) = list.as_array_of_tables_mut() else {
        // A list in one line is written anew.
        let mut tables = ArrayOfTables::new();
        now.iter().for_each(|entry| tables.push(table(entry)));
        *list = Item::ArrayOfTables(tables);
        return;
    };
    let written: [Vec<Table>; 2] = [before, now].map(|list| list.iter().map(table).collect());
    let [before, now] = &written;
    let said = [before, now].map(|list| list.iter().map(Said::by).collect::<Vec<_>>());
    let steps = steps(before.len(), now.len(), |i, j| said[0][i].difference(&said[1][j]));
    let (mut there, mut old, mut new) = (std::mem::take(tables).into_iter(), before.iter(), now.iter());
    for step in steps {
        match step {
            Step::Keep => {
                if let (Some(mut entry), Some(before), Some(wanted)) = (there.next(), old.next(), new.next())
                {
                    change(&mut entry, before, wanted);
                    tables.push(entry);
                }
            }
            Step::Remove => drop((there.next(), old.next())),
            Step::Add => tables.extend(new.next().cloned()),
        }
    }
    if tables.is_empty() {
        document.remove(name);
    }
}

/// An entry as it is compared: key by key its text, and its numbers if it is one, or a list of some.
struct Said(BTreeMap<String, (String, Option<Vec<f64>>)>);

impl Said {
    fn by(entry: &Table) -> Self {
        let said = |item: &Item| (item.to_string(), numbers(item));
        Self(entry.iter().map(|(key, item)| (key.to_owned(), said(item))).collect())
    }

    /// How unlike two entries are, 0 to 1: the mean over all keys of how far numbers are apart, x/(1 + x), and 1 for other
    /// values.
    fn difference(&self, other: &Self) -> f32 {
        let apart = |key: &String, (text, numbers): &(String, Option<Vec<f64>>)| match other.0.get(key) {
            Some((other, _)) if text == other => 0.0,
            Some((_, others)) => match (numbers, others) {
                (Some(a), Some(b)) if a.len() == b.len() => {
                    let x = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>();
                    // Other digits of the same number are another text.
                    (x / (1.0 + x)).max(1e-6) as f32
                }
                _ => 1.0,
            },
            None => 1.0,
        };
        let own: f32 = self.0.iter().map(|(key, said)| apart(key, said)).sum();
        let others = other.0.keys().filter(|key| !self.0.contains_key(*key)).count();
        (own + others as f32) / (self.0.len() + others).max(1) as f32
    }
}

/// The numbers of a value that is one, or a list of some.
fn numbers(item: &Item) -> Option<Vec<f64>> {
    let number = |value: &Value| value.as_float().or(value.as_integer().map(|n| n as f64));
    match item.as_value()? {
        Value::Array(list) => list.iter().map(number).collect(),
        value => Some(vec![number(value)?]),
    }
}

/// Changes what an entry says from `before` to `wanted`; what says the same stays as it is written.
fn change(entry: &mut Table, before: &Table, wanted: &Table) {
    entry.retain(|key, _| wanted.contains_key(key) || !before.contains_key(key));
    let is_other = |key: &str, value: &Item| {
        before.get(key).is_none_or(|before| before.to_string() != value.to_string())
    };
    let changed = wanted.iter().filter(|(key, value)| is_other(key, value));
    changed.for_each(|(key, value)| put(entry, key, value));
}

/// Puts a value in the place of another one, whose comments stay.
fn put(table: &mut (impl toml_edit::TableLike + ?Sized), key: &str, item: &Item) {
    match (table.get_mut(key).and_then(Item::as_value_mut), item.as_value()) {
        (Some(there), Some(value)) => {
            let decor = there.decor().clone();
            *there = value.clone();
            *there.decor_mut() = decor;
        }
        _ => {
            table.insert(key, item.clone());
        }
    }
}

/// A config's table, tables within it in one line.
fn table(entry: &impl Serialize) -> Table {
    let written = toml_edit::ser::to_document(entry);
    let written = written.expect("invariant: a config has only values that TOML can hold");
    let mut table = written.into_table();
    for (_, item) in table.iter_mut() {
        if let Item::Table(inner) = item {
            *item = Item::Value(Value::InlineTable(inner.clone().into_inline_table()));
        }
    }
    table
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use serde_json::json;

    const TEXT: &str = "# A room.\n\
        camera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }\n\
        material.m.albedo = 0.5\n\
        object.b = { material = \"m\", sphere = { radius_m = 1 } }\n\
        [vpls]\nsmoothing_s = 0.1 # slow\n\n\
        # First.\n[[vpl]]\nposition_m = [1, 0, 0] # here\nnormal = [0, 1, 0]\nalbedo = 0.5\n\n\
        # Second.\n[[vpl]]\nposition_m = [2, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\nweight = 3\n\n\
        # Third.\n[[vpl]]\nposition_m = [3, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n\n\
        [[proxy]]\nbox = { size_m = [1, 1, 1] }\n";

    fn edited(values: serde_json::Value) -> String {
        let file = Path::new("scene.toml");
        let scene = SceneConfig::from_text(TEXT, file).unwrap().build().unwrap();
        let mut edit = scene.edit();
        edit.set_vpls(values.as_object().unwrap()).unwrap();
        let edited = edit.finish();
        let text = edited.vpls.written_into(TEXT, file).unwrap();
        let again = SceneConfig::from_text(&text, file).unwrap().build().unwrap();
        assert_eq!(again.vpls, edited.vpls, "{text}");
        text
    }

    fn vpl(x: f64) -> serde_json::Value {
        json!({ "position_m": [x, 0, 0], "normal": [0, 1, 0], "albedo": 0.5 })
    }

    /// What has not changed leaves the text as it is, bit for bit.
    #[test]
    fn nothing_changes_where_nothing_has() {
        let scene = SceneConfig::from_text(TEXT, Path::new("scene.toml")).unwrap().build().unwrap();
        assert_eq!(scene.vpls.written_into(TEXT, Path::new("scene.toml")).unwrap(), TEXT);
    }

    #[test]
    fn a_moved_vpl_keeps_its_comments() {
        let mut second = vpl(2.0);
        second["weight"] = json!(3);
        let text = edited(json!({ "vpl": [vpl(1.5), second, vpl(3.0)] }));
        assert_eq!(text, TEXT.replace("[1, 0, 0] # here", "[1.5, 0.0, 0.0] # here"));
    }

    #[test]
    fn a_removed_vpl_goes_with_its_comment_and_a_new_one_comes_last() {
        let text = edited(json!({ "vpl": [vpl(1.0), vpl(3.0)] }));
        assert!(
            text.contains("# First.") && !text.contains("# Second.") && text.contains("# Third."),
            "{text}"
        );
        let mut second = vpl(2.0);
        second["weight"] = json!(3);
        let text = edited(json!({ "vpl": [vpl(1.0), second, vpl(3.0), vpl(4.0)] }));
        assert!(text.starts_with(TEXT.split("[[proxy]]").next().unwrap()), "{text}");
        assert_eq!(edited(json!({ "vpl": [] })).matches("[[vpl]]").count(), 0);
    }

    /// The first one is moved, the second one taken away, another one put before the third: each keeps its own comment.
    #[test]
    fn comments_stay_with_their_vpls() {
        let text = edited(json!({ "vpl": [vpl(1.25), vpl(3.0)] }));
        let expected = TEXT.replace("[1, 0, 0] # here", "[1.25, 0.0, 0.0] # here");
        let (head, rest) = expected.split_once("# Second.").unwrap();
        assert_eq!(text, format!("{head}# Third.{}", rest.split_once("# Third.").unwrap().1));
        let mut second = vpl(2.0);
        second["weight"] = json!(3);
        let text = edited(json!({ "vpl": [vpl(1.0), second, vpl(9.0), vpl(3.0)] }));
        let (head, tail) = TEXT.split_once("# Third.").unwrap();
        assert!(text.starts_with(head) && text.ends_with(&format!("# Third.{tail}")), "{text}");
    }

    /// What `place` has marked stays marked, moved or not: that it was edited is seen by the mark.
    #[test]
    fn marks_of_placed_vpls_stay() {
        let text = TEXT.replace("# here", "# here\nplaced = \"0123456789abcdef\"");
        let file = Path::new("scene.toml");
        let scene = SceneConfig::from_text(&text, file).unwrap().build().unwrap();
        let mut second = vpl(2.0);
        second["weight"] = json!(3);
        for (x, expected) in [(1.0, text.clone()), (1.5, text.replace("[1, 0, 0] #", "[1.5, 0.0, 0.0] #"))] {
            let mut edit = scene.edit();
            let values = json!({ "vpl": [vpl(x), second, vpl(3.0)] });
            edit.set_vpls(values.as_object().unwrap()).unwrap();
            assert_eq!(edit.finish().vpls.written_into(&text, file).unwrap(), expected);
        }
    }

    /// What was said of nobody changes with what it follows from: without proxies, axes meet the scene.
    #[test]
    fn defaults_go_with_proxies() {
        let text = edited(json!({ "proxy": [] }));
        assert!(!text.contains("phantom_surfaces") && !text.contains("[[proxy]]"), "{text}");
        let scene = SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap().build().unwrap();
        assert_eq!(scene.vpls.settings.phantom_surfaces, PhantomSurfaces::Scene);
    }

    /// A key that is gone goes, settings change or come, and other lists are begun.
    #[test]
    fn keys_settings_and_lists_come_and_go() {
        let text = edited(json!({
            "vpl": [vpl(1.0), vpl(2.0), vpl(3.0)],
            "vpls": { "smoothing_s": 0.2, "photons": 5 },
            "blocker": [{ "position_m": [0, 1, 0], "radius_m": 0.25 }],
            "proxy": [{ "position_m": [0, 0, 1], "rotation_deg": [0, 0, 0], "box": { "size_m": [2, 2, 2], "centre_m": [0, 0, 0] } }],
        }));
        assert!(!text.contains("weight") && text.contains("smoothing_s = 0.2 # slow"), "{text}");
        assert!(text.contains("photons = 5") && text.contains("[[blocker]]"), "{text}");
        assert!(!text.contains("softening_m2"), "defaults are not written: {text}");
    }
}
