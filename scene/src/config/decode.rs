//! Turns the text of a scene file into a [`SceneConfig`], and serde's complaints into errors with a place and a remedy.

use super::{Document, SceneConfig};
use crate::error::{SceneError, nearest};
use std::{fs, path::Path};

impl SceneConfig {
    /// Reads a scene file, or chooses a scene for a model ([`crate::ModelScene`]).
    ///
    /// # Errors
    /// If the file cannot be read, is not TOML, or has a key or type that no scene file has; or is no valid model.
    pub fn from_file(path: &Path) -> Result<Self, SceneError> {
        if crate::is_model(path) {
            return crate::model::config(path);
        }
        let text =
            fs::read_to_string(path).map_err(|source| SceneError::Read { file: path.to_owned(), source })?;
        Self::from_text(&text, path)
    }

    /// Reads the text of a scene file; `path` names it in errors, and assets are looked for beside it.
    ///
    /// # Errors
    /// If the text is not TOML, or has a key or type that no scene file has.
    pub fn from_text(text: &str, path: &Path) -> Result<Self, SceneError> {
        let document = Document { file: path.to_owned(), text: text.to_owned() };
        if let Err(error) = toml::de::DeTable::parse(text) {
            let place = document.place_at(error.span().map(|s| s.start), String::new());
            return Err(SceneError::Syntax { place, problem: error.message().to_owned() });
        }
        match toml::from_str::<Self>(text) {
            Ok(config) => Ok(Self { document, ..config }),
            Err(error) => Err(translate(&document, &error)),
        }
    }
}

impl SceneConfig {
    /// The same without the text it was read from: errors name no lines of it. `chosen` is what [`crate::Scene::choices`] tells.
    pub(crate) fn without_text(mut self, chosen: Vec<String>) -> Self {
        self.document.text.clear();
        Self { chosen, ..self }
    }
}

fn translate(document: &Document, error: &toml::de::Error) -> SceneError {
    let keys = error.span().and_then(|span| document.field_at(&span)).unwrap_or_default();
    let offset = error.span().map(|span| span.start);
    let message = error.message();
    if message.starts_with("unknown field") {
        let mut names = quoted(message);
        let key = if names.is_empty() { String::new() } else { names.remove(0) };
        let table = keys.split_last().map(|(_, table)| table.join(".")).unwrap_or_default();
        let nearest = nearest(&key, names.iter().map(String::as_str));
        return SceneError::UnknownKey {
            place: document.place_at(offset, table),
            key,
            nearest,
            valid: names,
        };
    }
    let place = document.place_at(offset, keys.join("."));
    if message.starts_with("missing field") {
        let key = quoted(message).into_iter().next().unwrap_or_default();
        return SceneError::MissingKey { place, key };
    }
    let problem = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|prefix| message.strip_prefix(prefix).map(|rest| (prefix, rest)))
        .map_or_else(
            || message.to_owned(),
            |(prefix, rest)| match *prefix {
                "invalid length " => format!("found {}", rest.replacen(',', " numbers,", 1)),
                _ => format!("found {rest}"),
            },
        );
    SceneError::WrongType { place, problem }
}

/// The words between backticks.
fn quoted(message: &str) -> Vec<String> {
    message.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}
