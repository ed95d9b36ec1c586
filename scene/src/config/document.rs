//! Turns the dotted name of a field into its place in the text of a scene file, and a bad value into an error there.

use crate::error::{Place, SceneError};
use std::{ops::Range, path::PathBuf};
use toml::de::{DeTable, DeValue};

/// The text a config was read from, kept to say where a value stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Document {
    pub(crate) file: PathBuf,
    pub(crate) text: String,
}

impl Document {
    /// The place of a byte offset.
    pub(crate) fn place_at(&self, offset: Option<usize>, field: String) -> Box<Place> {
        let line_column = offset.and_then(|offset| {
            let before = self.text.get(..offset)?;
            let line_start = before.rfind('\n').map_or(0, |i| i + 1);
            Some((before.matches('\n').count() + 1, before[line_start..].chars().count() + 1))
        });
        Box::new(Place { file: self.file.clone(), line_column, field })
    }

    /// The place of the value called `keys`, or of the deepest of the tables around it that the text holds.
    pub(crate) fn place(&self, keys: &[String]) -> Box<Place> {
        self.place_at(self.offset(keys), keys.join("."))
    }

    fn offset(&self, keys: &[String]) -> Option<usize> {
        let root = DeTable::parse(&self.text).ok()?;
        let mut table = root.get_ref();
        let mut offset = None;
        for key in keys {
            let find = |key: &str| table.iter().find(|(name, _)| name.get_ref() == key);
            if let Some((name, value)) = find(key) {
                match value.get_ref() {
                    DeValue::Table(inner) => {
                        offset = Some(name.span().start);
                        table = inner;
                    }
                    _ => return Some(value.span().start),
                }
                continue;
            }
            let Some((name, index)) = element(key) else { break };
            let Some((_, array)) = find(name) else { break };
            let Some(value) = array.get_ref().as_array().and_then(|array| array.get(index)) else { break };
            offset = Some(value.span().start);
            let Some(inner) = value.get_ref().as_table() else { break };
            table = inner;
        }
        offset
    }

    /// The dotted name of the value or key that has exactly this `span`.
    pub(crate) fn field_at(&self, span: &Range<usize>) -> Option<Vec<String>> {
        let root = DeTable::parse(&self.text).ok()?;
        let mut path = Vec::new();
        find_in_table(root.get_ref(), span, &mut path).then_some(path)
    }
}

/// Name and number of `name[number]`.
fn element(key: &str) -> Option<(&str, usize)> {
    let (name, number) = key.strip_suffix(']')?.rsplit_once('[')?;
    Some((name, number.parse().ok()?))
}

fn find_in_table(table: &DeTable<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
    for (key, value) in table {
        path.push(key.get_ref().to_string());
        // Deepest first: the implicit tables of a header share the span of their key.
        if find_in_value(value.get_ref(), span, path) || value.span() == *span || key.span() == *span {
            return true;
        }
        path.pop();
    }
    false
}

fn find_in_value(value: &DeValue<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
    match value {
        DeValue::Table(table) => find_in_table(table, span, path),
        // Elements of arrays go by the name of the array, tables among them by their number too.
        DeValue::Array(array) => array.iter().enumerate().any(|(number, v)| {
            let name = path.pop().unwrap_or_default();
            let is_table = v.get_ref().as_table().is_some();
            path.push(if is_table { format!("{name}[{number}]") } else { name.clone() });
            if v.span() == *span || find_in_value(v.get_ref(), span, path) {
                return true;
            }
            path.pop();
            path.push(name);
            false
        }),
        _ => false,
    }
}

/// A field of a config by its name, for error messages.
#[derive(Clone, Debug)]
pub(crate) struct Field<'a> {
    document: &'a Document,
    keys: Vec<String>,
}

impl<'a> Field<'a> {
    pub(crate) fn root(document: &'a Document) -> Self {
        Self { document, keys: Vec::new() }
    }

    /// The field `key` of this table.
    pub(crate) fn key(&self, key: &str) -> Self {
        let mut keys = self.keys.clone();
        keys.push(key.to_owned());
        Self { document: self.document, keys }
    }

    /// Element `number` of this array, counted from 0.
    pub(crate) fn element(&self, number: usize) -> Self {
        let mut keys = self.keys.clone();
        let name = keys.pop().unwrap_or_default();
        keys.push(format!("{name}[{number}]"));
        Self { document: self.document, keys }
    }

    pub(crate) fn place(&self) -> Box<Place> {
        self.document.place(&self.keys)
    }

    /// The error of a value outside its domain.
    pub(crate) fn invalid(
        &self,
        found: impl ToString,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> SceneError {
        SceneError::Invalid {
            place: self.place(),
            found: found.to_string(),
            expected: expected.into(),
            remedy: remedy.into(),
        }
    }

    pub(crate) fn missing(&self, key: &str) -> SceneError {
        SceneError::MissingKey { place: self.place(), key: key.to_owned() }
    }
}
