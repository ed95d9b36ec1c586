//! Turns tables that are written inline into tables with headers, and keeps the comments at them.

use super::comments::{lines, split, text};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

/// Place of what was inline: before all tables.
const FIRST: isize = 0;

/// The `[[vpl]]` tables.
pub(super) fn entries(document: &mut DocumentMut) -> &mut ArrayOfTables {
    if document.get("vpl").is_some_and(Item::is_value) {
        let above = take_above(document, "vpl");
        let (tables, left) = match document.get_mut("vpl").map(std::mem::take) {
            Some(Item::Value(Value::Array(array))) => tables_of(&above, &array),
            _ => Default::default(),
        };
        if !left.is_empty() {
            let after = text(Some(document.trailing())).to_owned();
            document.set_trailing(format!("{}\n{after}", left.join("\n")));
        }
        document.insert("vpl", Item::ArrayOfTables(tables));
    }
    let item = document.entry("vpl").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    if !item.is_array_of_tables() {
        *item = Item::ArrayOfTables(ArrayOfTables::new());
    }
    item.as_array_of_tables_mut().expect("invariant: made an array of tables")
}

/// The tables of an array of inline ones, and comments for which there is none. What stands beside a table goes beside its
/// header, as does what stands below the last one; what stands above one, above.
fn tables_of(above: &[String], array: &Array) -> (ArrayOfTables, Vec<String>) {
    let mut tables: Vec<(Table, Vec<String>)> = Vec::new();
    let mut above = above.to_vec();
    for (number, value) in array.iter().enumerate() {
        let before = text(value.decor().prefix());
        match tables.last_mut().filter(|_| number > 0) {
            Some((_, beside)) => {
                let (same_line, own) = split(before);
                beside.extend(same_line.map(str::to_owned));
                above.extend(own.into_iter().map(str::to_owned));
            }
            None => above.extend(lines(before).map(str::to_owned)),
        }
        let Some(inline) = value.as_inline_table() else { continue };
        let mut table = inline.clone().into_table();
        table.set_position(Some(FIRST));
        if !above.is_empty() {
            table.decor_mut().set_prefix(format!("\n{}\n", above.join("\n")));
        }
        above.clear();
        let beside = lines(text(value.decor().suffix())).map(str::to_owned).collect();
        tables.push((table, beside));
    }
    let below = [text(Some(array.trailing())), text(array.decor().suffix())];
    above.extend(below.into_iter().flat_map(lines).map(str::to_owned));
    if let Some((_, beside)) = tables.last_mut() {
        beside.append(&mut above);
    }
    let with_comments = tables.into_iter().map(|(mut table, beside)| {
        if !beside.is_empty() {
            table.decor_mut().set_suffix(format!(" {}", beside.join("\n")));
        }
        table
    });
    (with_comments.collect(), above)
}

/// The table `key` of `parent`, with a header of its own; `None` where there is none.
pub(super) fn with_header<'a>(parent: &'a mut Table, key: &str) -> Option<&'a mut Table> {
    if parent.get(key).is_some_and(Item::is_inline_table) {
        let above = take_above(parent, key);
        let item = parent.get_mut(key).map(std::mem::take);
        let Some(Item::Value(Value::InlineTable(inline))) = item else { return None };
        let beside = lines(text(inline.decor().suffix())).next().map(|line| format!(" {line}"));
        let mut table = inline.into_table();
        table.set_position(Some(FIRST));
        if !above.is_empty() {
            table.decor_mut().set_prefix(format!("\n{}\n", above.join("\n")));
        }
        if let Some(beside) = beside {
            table.decor_mut().set_suffix(beside);
        }
        parent.insert(key, Item::Table(table));
    }
    parent.get_mut(key)?.as_table_mut()
}

/// Takes the comments above a key, and the spaces around it, which are not those of a header.
fn take_above(table: &mut Table, key: &str) -> Vec<String> {
    let Some(mut key) = table.key_mut(key) else { return Vec::new() };
    let above = lines(text(key.leaf_decor().prefix())).map(str::to_owned).collect();
    key.fmt();
    above
}
