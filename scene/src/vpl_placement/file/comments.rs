//! Turns the text around keys, values and tables into the comments that people wrote there.

use toml_edit::{Decor, Key, RawString, Table, Value};

/// The text of a decor's side, empty where there is none.
pub(super) fn text(raw: Option<&RawString>) -> &str {
    raw.and_then(RawString::as_str).unwrap_or_default()
}

/// The comments in a text between keys, values or tables, one a line.
pub(super) fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).filter(|line| !line.is_empty())
}

/// The comment that goes on with the line where `text` begins, and those on lines of their own.
pub(super) fn split(text: &str) -> (Option<&str>, Vec<&str>) {
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    (lines(first).next(), lines(rest).collect())
}

/// What an entry says of itself, for people.
pub(super) fn of_entry(object: &str, material: &str, population: u32) -> String {
    let reflections = if population == 1 { REFLECTION } else { REFLECTIONS };
    format!("# {object}, {material}: {population}{reflections}")
}

const REFLECTION: &str = " reflection";
const REFLECTIONS: &str = " reflections";

/// Whether a line may be [that of an entry](of_entry).
fn is_of_entry(line: &str) -> bool {
    let count = line.rsplit_once(": ").map_or("", |(_, count)| count);
    let number = count.strip_suffix(REFLECTIONS).or_else(|| count.strip_suffix(REFLECTION));
    number.is_some_and(|number| number.parse::<u32>().is_ok())
}

/// Whether people wrote a comment at an entry: above it, beside or within it.
pub(super) fn are_at(entry: &Table) -> bool {
    let decor = entry.decor();
    let mut above = lines(text(decor.prefix()));
    let is_above = above.next().is_some_and(|line| !is_of_entry(line)) || above.next().is_some();
    let at_key = |key: &Key| in_decor(key.leaf_decor());
    is_above
        || text(decor.suffix()).contains('#')
        || entry
            .iter()
            .any(|(key, item)| entry.key(key).is_some_and(at_key) || item.as_value().is_some_and(in_value))
}

fn in_decor(decor: &Decor) -> bool {
    [decor.prefix(), decor.suffix()].into_iter().any(|raw| text(raw).contains('#'))
}

fn in_value(value: &Value) -> bool {
    let inside =
        |array: &toml_edit::Array| array.iter().any(in_value) || text(Some(array.trailing())).contains('#');
    in_decor(value.decor()) || value.as_array().is_some_and(inside)
}
