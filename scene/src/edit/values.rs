//! Turns the keys and JSON values of an edit into validated types, with errors that name the nearest key.

use crate::{
    config::Field,
    error::{SceneError, nearest},
};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// New values by key: JSON, as a control message carries them.
pub(crate) type Values = Map<String, Value>;

/// The values of an edit, taken out one by one.
pub(super) struct Keys<'v> {
    /// Key as it was written, key within the shape, value.
    left: Vec<(&'v str, &'v Value)>,
}

impl<'v> Keys<'v> {
    /// The values of a table that may name the keys of its `shape` with or without it: `position_m`,
    /// `spot.position_m`, or a table `spot`.
    ///
    /// # Errors
    /// If there are none, a key is given twice, or is not in `valid`.
    pub(super) fn read(
        values: &'v Values,
        shape: Option<&str>,
        valid: &[&str],
        field: &Field<'_>,
    ) -> Result<Self, SceneError> {
        let mut left: Vec<(&str, &Value)> = Vec::new();
        let expected = || format!("some of {}", valid.join(", "));
        for (written, value) in values {
            match (value, shape) {
                (Value::Object(inner), Some(shape)) if written == shape => {
                    left.extend(inner.iter().map(|(k, v)| (k.as_str(), v)));
                }
                _ => {
                    let key = shape
                        .and_then(|shape| written.strip_prefix(shape)?.strip_prefix('.'))
                        .unwrap_or(written);
                    left.push((key, value));
                }
            }
        }
        if left.is_empty() {
            return Err(field.invalid("no value", expected(), "give at least one"));
        }
        for (index, (key, _)) in left.iter().enumerate() {
            if !valid.contains(key) {
                return Err(SceneError::UnknownKey {
                    place: field.place(),
                    key: (*key).to_owned(),
                    nearest: nearest(key, valid.iter().copied()),
                    valid: valid.iter().map(|&k| k.to_owned()).collect(),
                });
            }
            if left[..index].iter().any(|(other, _)| other == key) {
                return Err(field.key(key).invalid("two values", "one", "leave one out"));
            }
        }
        Ok(Self { left })
    }

    /// The value of `key`, if it is given.
    ///
    /// # Errors
    /// If it is not of the type that `expected` describes.
    pub(super) fn take<T: DeserializeOwned>(
        &mut self,
        key: &str,
        expected: &str,
        field: &Field<'_>,
    ) -> Result<Option<T>, SceneError> {
        let Some(index) = self.left.iter().position(|(k, _)| *k == key) else { return Ok(None) };
        let (_, value) = self.left.swap_remove(index);
        T::deserialize(value).map(Some).map_err(|_| SceneError::WrongType {
            place: field.key(key).place(),
            problem: format!("found {}, expected {expected}", shortened(value)),
        })
    }
}

/// A value as JSON, short enough for a sentence.
fn shortened(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text,
    }
}
