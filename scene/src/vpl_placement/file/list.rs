//! Turns what was placed into the table `[vpls.placed]`, and keeps the comments in it.

use super::{
    comments::{lines, split, text},
    merge::Source,
    tables,
};
use toml_edit::{Array, DocumentMut, Item, Table, Value};

const COMMENT: &str = "
# What `photonstream place` has written: hash, position, normal. It replaces its own entries, and keeps those that were made
# by hand or edited. What is listed here and has no entry any more was deleted, and stays so until its line is deleted, too.
";

/// A line of an array, with the comments above and beside it.
struct Line {
    text: String,
    above: Vec<String>,
    beside: Option<String>,
}

/// The table `[vpls.placed]`, with a header of its own.
fn placed(document: &mut DocumentMut) -> Option<&mut Table> {
    tables::with_header(tables::with_header(document, "vpls")?, "placed")
}

/// The texts of an array of it.
pub(super) fn texts(document: &mut DocumentMut, key: &str) -> Vec<String> {
    let array = placed(document).and_then(|table| table.get(key)?.as_array());
    array.into_iter().flatten().filter_map(|text| text.as_str().map(str::to_owned)).collect()
}

/// The text that it has of `key`.
pub(super) fn text_of(document: &mut DocumentMut, key: &str) -> Option<String> {
    placed(document)?.get(key)?.as_str().map(str::to_owned)
}

/// Takes the table out of the file.
pub(super) fn take(document: &mut DocumentMut) -> Option<Table> {
    let vpls = tables::with_header(document, "vpls")?;
    tables::with_header(vpls, "placed");
    let table = vpls.remove("placed")?.into_table().ok();
    if vpls.is_implicit() && vpls.is_empty() {
        document.remove("vpls");
    }
    table
}

/// Puts a table there.
pub(super) fn put(document: &mut DocumentMut, table: Table) {
    let mut implicit = Table::new();
    implicit.set_implicit(true);
    tables::with_header(document, "vpls");
    let vpls = document.entry("vpls").or_insert(Item::Table(implicit));
    if let Some(vpls) = vpls.as_table_mut() {
        vpls.insert("placed", Item::Table(table));
    }
}

/// Writes the table at `position`: its comments stay, those of a line that goes at the end of the lines. A table of no lines
/// goes where nobody wrote into it.
pub(super) fn write(
    document: &mut DocumentMut,
    source: Option<&Source>,
    lines: Vec<String>,
    position: isize,
) {
    let mut table = take(document).unwrap_or_default();
    let foreign = foreign_above(&table);
    let is_needed = !lines.is_empty() || source.is_some();
    if let Some(source) = source {
        table.insert("from", toml_edit::value(source.line()));
        renew(&mut table, "given", source.given.iter().cloned().collect());
    }
    renew(&mut table, "sites", lines);
    let beside = text(table.decor().suffix());
    if !is_needed && foreign.is_empty() && ![beside, &table.to_string()].iter().any(|text| text.contains('#'))
    {
        return;
    }
    let above = if foreign.is_empty() { COMMENT.to_owned() } else { format!("\n{foreign}\n{COMMENT}") };
    table.decor_mut().set_prefix(above);
    table.set_position(Some(position));
    put(document, table);
}

/// What people wrote above the table.
fn foreign_above(table: &Table) -> String {
    let own: Vec<&str> = COMMENT.lines().collect();
    let above =
        text(table.decor().prefix()).lines().filter(|line| line.trim().is_empty() || !own.contains(line));
    above.collect::<Vec<_>>().join("\n").trim().to_owned()
}

/// Replaces an array of texts.
fn renew(table: &mut Table, key: &str, wanted: Vec<String>) {
    let old = table.get(key).and_then(Item::as_array);
    let (mut known, mut left) = old.map(lines_of).unwrap_or_default();
    let decor = old.map(|array| array.decor().clone());
    let mut array = Array::new();
    let mut beside = String::new();
    let mut before = |above: &[String], next: Option<String>| {
        let above: String = above.iter().map(|line| format!("\n    {line}")).collect();
        let beside = std::mem::replace(&mut beside, next.map(|next| format!(" {next}")).unwrap_or_default());
        format!("{beside}{above}\n")
    };
    for text in wanted {
        let line = known.iter().position(|line| line.text == text).map(|found| known.remove(found));
        let mut value = Value::from(text);
        let (above, next) = line.map_or((Vec::new(), None), |line| (line.above, line.beside));
        value.decor_mut().set_prefix(before(&above, next) + "    ");
        array.push_formatted(value);
    }
    let lost = known.into_iter().flat_map(|line| line.above.into_iter().chain(line.beside));
    let left: Vec<String> = lost.chain(std::mem::take(&mut left)).collect();
    if !array.is_empty() || !left.is_empty() {
        array.set_trailing(before(&left, None));
        array.set_trailing_comma(true);
    }
    if let Some(decor) = decor {
        *array.decor_mut() = decor;
    }
    match table.get_mut(key) {
        Some(item) => *item = toml_edit::value(array),
        None => drop(table.insert(key, toml_edit::value(array))),
    }
}

/// The lines of an array, and the comments below the last one.
fn lines_of(array: &Array) -> (Vec<Line>, Vec<String>) {
    let owned = |lines: Vec<&str>| lines.into_iter().map(str::to_owned).collect::<Vec<_>>();
    let mut found: Vec<Line> = Vec::new();
    for value in array {
        let before = text(value.decor().prefix());
        let above = match found.last_mut() {
            Some(last) => beside_and_below(last, before),
            None => owned(lines(before).collect()),
        };
        let beside = lines(text(value.decor().suffix())).next().map(str::to_owned);
        found.push(Line { text: value.as_str().unwrap_or_default().to_owned(), above, beside });
    }
    let below = text(Some(array.trailing()));
    let left = match found.last_mut() {
        Some(last) => beside_and_below(last, below),
        None => owned(lines(below).collect()),
    };
    (found, left)
}

/// Gives the line what stands beside it, and returns what stands below.
fn beside_and_below(line: &mut Line, text: &str) -> Vec<String> {
    let (beside, below) = split(text);
    if let Some(beside) = beside {
        line.beside = Some(beside.to_owned());
    }
    below.into_iter().map(str::to_owned).collect()
}
