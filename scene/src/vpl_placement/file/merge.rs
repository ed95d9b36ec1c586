//! Turns a scene file, and the one with placed virtual point lights that was made from it before, into one.

#[cfg(test)]
mod tests;

use super::{Marks, VplFile, comments, entry, last_position, list, tables};
use std::collections::BTreeSet;
use toml_edit::{DocumentMut, Table};

/// What is known of the file that this one was made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Source {
    /// Its name, without folders.
    name: String,
    /// Hash of what it said apart from VPLs.
    rest: String,
    /// Hashes of the entries that people had made there.
    pub(super) given: BTreeSet<String>,
}

impl Source {
    pub(super) fn read(document: &mut DocumentMut) -> Option<Self> {
        let line = list::text_of(document, "from")?;
        let (rest, name) = line.split_once(' ')?;
        let given = list::texts(document, "given").into_iter().collect();
        Some(Self { name: name.to_owned(), rest: rest.to_owned(), given })
    }

    pub(super) fn line(&self) -> String {
        format!("{} {}", self.rest, self.name)
    }
}

/// Why two files cannot be made one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VplMergeError {
    /// The file that is there was not made from this one, and says other things.
    #[error("it was not made from that file, and says other things apart from VPLs")]
    OtherScene,
    /// Apart from VPLs, people changed both since one was made from the other.
    #[error("apart from VPLs, both were changed since one was made from the other")]
    BothChanged,
}

impl VplFile {
    /// Notes that this is made from the scene file `name`, as that is now.
    pub fn made_from(&mut self, name: &str) {
        let given = self.entries().into_iter().map(|(hash, _)| hash).collect();
        self.source = Some(Source { name: name.to_owned(), rest: rest_of(&self.document), given });
    }

    /// This file, which is called `name`, with what `there`, which was made from it before, says of VPLs; and whether the
    /// rest is that of `there`, because it was changed there and not here.
    ///
    /// Entries that people made, edited or deleted on either side since are so in what comes of it; where both sides have
    /// one at one place, that of `there` stays.
    ///
    /// # Errors
    /// If the rest was changed on both sides, or `there` was made from another file, and says other things.
    pub fn merged(mut self, mut there: Self, name: &str) -> Result<(Self, bool), VplMergeError> {
        self.made_from(name);
        let source = self.source.take().expect("invariant: made above");
        let is_there = rest_of(&there.document);
        let keeps_there = match &there.source {
            _ if is_there == source.rest => false,
            Some(before) if before.name != name => return Err(VplMergeError::OtherScene),
            Some(before) if before.rest == is_there => false,
            Some(before) if before.rest == source.rest => true,
            Some(_) => return Err(VplMergeError::BothChanged),
            None => return Err(VplMergeError::OtherScene),
        };
        let given = there.source.take().map(|before| before.given).unwrap_or_default();
        let entries = merged_entries(self.entries(), there.entries(), &given, keeps_there);
        let of_here = std::mem::take(&mut self.former);
        let mut merged = if keeps_there {
            there
        } else {
            list::take(&mut self.document);
            if let Some(list) = list::take(&mut there.document) {
                list::put(&mut self.document, list);
            }
            Self { document: self.document, is_crlf: there.is_crlf, ..there }
        };
        let known: BTreeSet<&str> = merged.former.iter().map(|mark| mark.hash.as_str()).collect();
        let new: Marks = of_here.into_iter().filter(|mark| !known.contains(mark.hash.as_str())).collect();
        merged.former.extend(new);
        merged.source = Some(source);
        merged.set_entries(entries);
        Ok((merged, keeps_there))
    }

    /// The entries that people made, by the hash of their values.
    fn entries(&mut self) -> Vec<(String, Table)> {
        let tables = tables::entries(&mut self.document).iter();
        tables.map(|table| (entry::hash(table), table.clone())).collect()
    }

    /// Makes these the entries; those without a place come last.
    fn set_entries(&mut self, entries: Vec<Table>) {
        let mut last = last_position(self.document.as_table());
        let tables = tables::entries(&mut self.document);
        tables.clear();
        for mut table in entries {
            if table.position().is_none() {
                last += 1;
                table.set_position(Some(last));
            }
            tables.push(table);
        }
        self.settle();
    }
}

/// Entries of a file (`here`) and of one made from it (`there`) when it had those that are `given`: first those of the one
/// into whose text they come, at their places.
fn merged_entries(
    here: Vec<(String, Table)>,
    there: Vec<(String, Table)>,
    given: &BTreeSet<String>,
    keeps_there: bool,
) -> Vec<Table> {
    let hashes = |entries: &[(String, Table)]| entries.iter().map(|e| e.0.clone()).collect::<BTreeSet<_>>();
    let (are_here, are_there) = (hashes(&here), hashes(&there));
    let site = |table: &Table| entry::Site::of(table);
    let made_there: Vec<_> = there.iter().filter(|e| !given.contains(&e.0)).map(|e| site(&e.1)).collect();
    let stays_here = |(hash, table): &(String, Table)| {
        are_there.contains(hash) || !(given.contains(hash) || made_there.contains(&site(table)))
    };
    let stays_there = |(hash, _): &(String, Table)| are_here.contains(hash) || !given.contains(hash);
    let here: Vec<_> = here.into_iter().filter(stays_here).collect();
    let there: Vec<_> = there.into_iter().filter(stays_there).collect();
    let (first, second) = if keeps_there { (there, here) } else { (here, there) };
    let in_first = hashes(&first);
    let mut merged = Vec::new();
    for (hash, table) in first {
        // The same entry there may have comments.
        let other = second.iter().find(|other| !keeps_there && other.0 == hash && comments::are_at(&other.1));
        let position = table.position();
        let mut table = other.map_or(table, |other| other.1.clone());
        table.set_position(position);
        merged.push(table);
    }
    for (_, mut table) in second.into_iter().filter(|other| !in_first.contains(&other.0)) {
        table.set_position(None);
        merged.push(table);
    }
    merged
}

/// Hash of what a file says apart from VPLs, empty lines and spaces at the ends of lines.
fn rest_of(document: &DocumentMut) -> String {
    let mut rest = document.clone();
    list::take(&mut rest);
    rest.remove("vpl");
    let mut hasher = blake3::Hasher::new();
    for line in comments::lines(&rest.to_string()) {
        hasher.update(line.as_bytes());
        hasher.update(b"\n");
    }
    hasher.finalize().to_hex()[..16].to_owned()
}
