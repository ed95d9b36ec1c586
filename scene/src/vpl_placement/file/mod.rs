//! Turns a scene file and placed VPLs into the same scene file with them, and keeps what people made of it.

mod assets;
mod entry;
#[cfg(test)]
mod tests;

use super::{VplPlacement, VplSite};
use crate::{
    error::{Place, SceneError},
    scene::Scene,
};
use entry::{Entry, Site};
use std::{collections::BTreeSet, path::Path};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

/// A scene file in which VPLs are placed.
///
/// `[[vpl]]` entries without the key `placed` are made by hand. That key holds a hash of what an entry was written with:
/// where it still fits, the entry is replaced; else someone has edited it, and it stays as if made by hand. The table
/// `[vpls.placed]` lists all that was written: what is there and has no entry any more was deleted, and stays so.
#[derive(Clone, Debug)]
pub struct VplFile {
    document: DocumentMut,
    /// Entries that stay.
    kept: Vec<Site>,
    /// Where edited entries stood once, and deleted ones, with the lines that say so.
    former: Vec<(Site, String)>,
    /// What is in it.
    pub counts: VplFileCounts,
}

/// Who made the VPLs of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VplFileCounts {
    /// Entries made by hand.
    pub by_hand: u32,
    /// Placed entries that were edited since.
    pub edited: u32,
    /// Placed entries that were deleted since.
    pub deleted: u32,
    /// Placed entries as they were written: they are replaced.
    pub replaced: u32,
}

const LIST_COMMENT: &str = "
# What `photonstream place` has written: hash, position, normal. It replaces its own entries, and keeps those that were made
# by hand or edited. What is listed here and has no entry any more was deleted, and stays so until its line is deleted, too.
";

impl VplFile {
    /// Reads a scene file; `path` names it in errors.
    ///
    /// # Errors
    /// If the text is not TOML, or an entry has no position and normal.
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let place = |field: String| Box::new(Place { file: path.to_owned(), line_column: None, field });
        let syntax = |e: toml_edit::TomlError| SceneError::Syntax {
            place: place(String::new()),
            problem: e.message().to_owned(),
        };
        let mut document: DocumentMut = text.parse().map_err(syntax)?;
        let listed = listed(&document);
        let mut counts = VplFileCounts::default();
        let (mut kept, mut edited, mut replaced) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
        let mut problem = None;
        let mut number = 0;
        entries(&mut document).retain(|table| {
            let field = format!("vpl[{number}]");
            number += 1;
            let written = entry::written_hash(table).map(str::to_owned);
            if written.as_ref().is_some_and(|written| *written == entry::hash(table)) {
                counts.replaced += 1;
                replaced.extend(written);
                return false;
            }
            match Site::of(table) {
                Some(site) => kept.push(site),
                None => problem = Some(field),
            }
            match written {
                Some(_) => counts.edited += 1,
                None => counts.by_hand += 1,
            }
            edited.extend(written);
            true
        });
        if let Some(field) = problem {
            let problem = "found no position_m and normal of three numbers each".into();
            return Err(SceneError::WrongType { place: place(field), problem });
        }
        let mut former = Vec::new();
        for line in listed {
            let Some((hash, site)) = Site::of_line(&line) else { continue };
            match (edited.contains(&hash), replaced.contains(&hash)) {
                (true, _) => {}
                (false, true) => continue,
                (false, false) => counts.deleted += 1,
            }
            former.push((site, line));
        }
        Ok(Self { document, kept, former, counts })
    }

    /// Makes the relative paths of assets of a scene file at `from` lead to the same files from `to`.
    pub fn rebase_assets(&mut self, from: &Path, to: &Path) {
        assets::rebase(&mut self.document, from, to);
    }

    /// Where no VPL is to be placed, in the space of `scene`, which was loaded from this file.
    pub fn taken(&self, scene: &Scene) -> Vec<VplSite> {
        let site = |site: &Site, takes_surface| VplSite {
            position: (site.position - scene.origin_m).as_vec3(),
            normal: site.normal.normalize_or_zero().as_vec3(),
            takes_surface,
        };
        let kept = self.kept.iter().map(|kept| site(kept, true));
        kept.chain(self.former.iter().map(|(former, _)| site(former, false))).collect()
    }

    /// The file with what was placed in `scene`; `area_per_weight_m2` is the area that a weight of 1 stands for.
    pub fn with(mut self, scene: &Scene, placement: &VplPlacement, area_per_weight_m2: f64) -> String {
        // A thousandth of their distance.
        let decimals = (3.0 - f64::from(placement.spacing_m).log10().floor()).clamp(0.0, 9.0) as usize;
        let mut lines: Vec<String> = self.former.iter().map(|(_, line)| line.clone()).collect();
        let mut tables = Vec::new();
        for vpl in &placement.vpls {
            let object = &scene.objects[vpl.object.0 as usize];
            let material = &scene.materials[object.material.0 as usize].name;
            let reflections = if vpl.population == 1 { "reflection" } else { "reflections" };
            let entry = Entry {
                position: vpl.position.as_dvec3() + scene.origin_m,
                normal: vpl.normal,
                albedo: vpl.albedo,
                weight: vpl.area_m2.map(|area| f64::from(area) / area_per_weight_m2),
                object: vpl.is_attached.then_some(object.name.as_str()),
                comment: format!("{}, {material}: {} {reflections}", object.name, vpl.population),
            };
            let table = entry.table(decimals);
            let hash = entry::written_hash(&table).unwrap_or_default().to_owned();
            let site = Site::of(&table).expect("invariant: a written entry has position and normal");
            lines.push(site.line(&hash));
            tables.push(table);
        }
        let mut position = last_position(self.document.as_table());
        let entries = entries(&mut self.document);
        for mut table in tables {
            position += 1;
            table.set_position(Some(position));
            entries.push(table);
        }
        if entries.is_empty() {
            self.document.remove("vpl");
        }
        write_list(&mut self.document, lines, position + 1);
        self.document.to_string()
    }
}

/// The `[[vpl]]` tables, also where they are written as an array of inline tables.
fn entries(document: &mut DocumentMut) -> &mut ArrayOfTables {
    let item = document.entry("vpl").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    if !item.is_array_of_tables() {
        *item = match std::mem::take(item).into_array_of_tables() {
            Ok(tables) => Item::ArrayOfTables(tables),
            Err(_) => Item::ArrayOfTables(ArrayOfTables::new()),
        };
    }
    item.as_array_of_tables_mut().expect("invariant: made an array of tables")
}

/// The lines of `[vpls.placed]`.
fn listed(document: &DocumentMut) -> Vec<String> {
    let list =
        document.get("vpls").and_then(|vpls| vpls.get("placed")).and_then(|placed| placed.get("sites"));
    let list = list.and_then(Item::as_array).into_iter().flatten();
    list.filter_map(|line| line.as_str().map(str::to_owned)).collect()
}

/// Writes `[vpls.placed]`, at the end of a file that has none.
fn write_list(document: &mut DocumentMut, lines: Vec<String>, position: isize) {
    let mut implicit = Table::new();
    implicit.set_implicit(true);
    let vpls = document.entry("vpls").or_insert(Item::Table(implicit));
    if vpls.is_inline_table() {
        *vpls = std::mem::take(vpls).into_table().map_or(Item::None, Item::Table);
    }
    let Some(vpls) = vpls.as_table_mut() else { return };
    vpls.remove("placed");
    if lines.is_empty() {
        if vpls.is_empty() {
            document.remove("vpls");
        }
        return;
    }
    let mut sites = Array::new();
    for line in lines {
        let mut line = Value::from(line);
        line.decor_mut().set_prefix("\n    ");
        sites.push_formatted(line);
    }
    sites.set_trailing("\n");
    sites.set_trailing_comma(true);
    let mut table = Table::new();
    table.insert("sites", toml_edit::value(sites));
    table.decor_mut().set_prefix(LIST_COMMENT);
    table.set_position(Some(position));
    vpls.insert("placed", Item::Table(table));
}

/// The last place that any table of a file has.
fn last_position(table: &Table) -> isize {
    let own = table.position().unwrap_or(0);
    let inner = table.iter().map(|(_, item)| match item {
        Item::Table(table) => last_position(table),
        Item::ArrayOfTables(tables) => tables.iter().map(last_position).max().unwrap_or(0),
        _ => 0,
    });
    inner.fold(own, isize::max)
}
