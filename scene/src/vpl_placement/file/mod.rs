//! Turns a scene file and placed VPLs into the same scene file with them, and keeps what people made of it.

mod assets;
mod comments;
mod entry;
mod list;
mod merge;
mod tables;
#[cfg(test)]
mod tests;

use super::{VplPlacement, VplSite};
use crate::{
    error::{Place, SceneError},
    scene::Scene,
};
use entry::{Entry, Site};
use merge::Source;
pub use merge::VplMergeError;
use std::{collections::BTreeSet, path::Path};
use toml_edit::{DocumentMut, Item, Table};

/// A scene file in which VPLs are placed.
///
/// `[[vpl]]` entries without the key `placed` are made by hand. That key holds a hash of what an entry was written with:
/// where it still fits, and nobody wrote a comment at it, the entry is replaced; else someone has edited it, and it stays as
/// if made by hand. The table `[vpls.placed]` lists all that was written: what is there and has no entry any more was
/// deleted, and stays so. It says as well what the file was made from, for [`VplFile::merged`].
#[derive(Clone, Debug)]
pub struct VplFile {
    /// Without the entries that are replaced.
    document: DocumentMut,
    /// Whether lines end in CR and LF; in the document they end in LF.
    is_crlf: bool,
    /// Entries that stay.
    kept: Vec<Site>,
    /// Where edited entries stood once, and deleted ones.
    former: Marks,
    /// What the file was made from, where that is another.
    source: Option<Source>,
    /// What is in it.
    pub counts: VplFileCounts,
}

/// A place of a placed entry.
#[derive(Clone, Debug)]
struct Mark {
    hash: String,
    site: Site,
    /// The line that says so.
    line: String,
}

type Marks = Vec<Mark>;

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
        let is_crlf = text.contains("\r\n");
        let mut document: DocumentMut = text.replace("\r\n", "\n").parse().map_err(syntax)?;
        let mut replaced = BTreeSet::new();
        let mut counts = VplFileCounts::default();
        let mut problem = None;
        let mut number = 0;
        tables::entries(&mut document).retain(|table| {
            let field = format!("vpl[{number}]");
            number += 1;
            let written = entry::written_hash(table).map(str::to_owned);
            let is_as_written = written.as_ref().is_some_and(|written| *written == entry::hash(table));
            if is_as_written && !comments::are_at(table) {
                counts.replaced += 1;
                replaced.extend(written);
                return false;
            }
            if Site::of(table).is_none() {
                problem = Some(field);
            }
            true
        });
        if let Some(field) = problem {
            let problem = "found no position_m and normal of three numbers each".into();
            return Err(SceneError::WrongType { place: place(field), problem });
        }
        // The place of what is replaced is free, also where an edited copy of it is.
        let former = list::texts(&mut document, "sites").into_iter().filter_map(|line| {
            let (hash, site) = Site::of_line(&line)?;
            (!replaced.contains(&hash)).then_some(Mark { hash, site, line })
        });
        let former = former.collect();
        let source = Source::read(&mut document);
        let mut file = Self { document, is_crlf, kept: Vec::new(), former, source, counts };
        file.settle();
        Ok(file)
    }

    /// Finds what stays and what was deleted from the entries and marks.
    fn settle(&mut self) {
        let tables = tables::entries(&mut self.document);
        self.kept = tables.iter().filter_map(|table| Site::of(table)).collect();
        let edited: Vec<&str> = tables.iter().filter_map(|table| entry::written_hash(table)).collect();
        let deleted = self.former.iter().filter(|mark| !edited.contains(&mark.hash.as_str())).count();
        self.counts.edited = edited.len() as u32;
        self.counts.by_hand = (tables.len() - edited.len()) as u32;
        self.counts.deleted = deleted as u32;
    }

    /// Its text as it is, without what is replaced.
    pub fn text(&self) -> String {
        self.document.to_string()
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
        kept.chain(self.former.iter().map(|former| site(&former.site, false))).collect()
    }

    /// The file with what was placed in `scene`; `area_per_weight_m2` is the area that a weight of 1 stands for.
    pub fn with(mut self, scene: &Scene, placement: &VplPlacement, area_per_weight_m2: f64) -> String {
        // A thousandth of their distance.
        let decimals = (3.0 - f64::from(placement.spacing_m).log10().floor()).clamp(0.0, 9.0) as usize;
        let mut lines: Vec<String> = self.former.iter().map(|former| former.line.clone()).collect();
        let mut tables = Vec::new();
        for vpl in &placement.vpls {
            let object = &scene.objects[vpl.object.0 as usize];
            let material = &scene.materials[object.material.0 as usize].name;
            let entry = Entry {
                position: vpl.position.as_dvec3() + scene.origin_m,
                normal: vpl.normal,
                albedo: vpl.albedo,
                weight: vpl.area_m2.map(|area| f64::from(area) / area_per_weight_m2),
                object: vpl.is_attached.then_some(object.name.as_str()),
                comment: comments::of_entry(&object.name, material, vpl.population),
            };
            let table = entry.table(decimals);
            let hash = entry::written_hash(&table).unwrap_or_default().to_owned();
            let site = Site::of(&table).expect("invariant: a written entry has position and normal");
            lines.push(site.line(&hash));
            tables.push(table);
        }
        let mut position = last_position(self.document.as_table());
        let entries = tables::entries(&mut self.document);
        for mut table in tables {
            position += 1;
            table.set_position(Some(position));
            entries.push(table);
        }
        if entries.is_empty() {
            self.document.remove("vpl");
        }
        list::write(&mut self.document, self.source.as_ref(), lines, position + 1);
        let text = self.document.to_string();
        if self.is_crlf { text.replace('\n', "\r\n") } else { text }
    }
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
