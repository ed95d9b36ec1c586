//! Turns what is wrong with a scene file into sentences: where, what was found, what was expected, what to do.

use std::{fmt, io, path::PathBuf};

/// A place in a scene file: the file, line and column counted from 1, and the field's dotted name. An edit of a running
/// scene has a field only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The scene file as it was named when loaded; empty for an edit.
    pub file: PathBuf,
    /// Line and column, counted from 1 (columns in characters); `None` where the value is not in the file.
    pub line_column: Option<(usize, usize)>,
    /// Dotted name of the field, for example `object.ball.sphere`; empty for the file as a whole.
    pub field: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.file.as_os_str().is_empty() {
            return f.write_str(&self.field);
        }
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.line_column {
            write!(f, ":{line}:{column}")?;
        }
        if self.field.is_empty() { Ok(()) } else { write!(f, ": {}", self.field) }
    }
}

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file cannot be read.
    #[error("{}: cannot be read ({source}); check the path and its permissions", file.display())]
    Read {
        /// The scene file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The text is not TOML.
    #[error("{place}: not valid TOML: {problem}")]
    Syntax {
        /// Where the parser stopped.
        place: Box<Place>,
        /// What it expected.
        problem: String,
    },
    /// A key that does not exist.
    #[error("{place}: unknown key \"{key}\"{}", hint(nearest.as_deref(), valid))]
    UnknownKey {
        /// The table that holds it.
        place: Box<Place>,
        /// The key as written.
        key: String,
        /// The most similar valid key.
        nearest: Option<String>,
        /// All valid keys.
        valid: Vec<String>,
    },
    /// A key that has to be there and is not.
    #[error("{place}: the key \"{key}\" is missing; add it (configs/README.md lists every key)")]
    MissingKey {
        /// The table that lacks it.
        place: Box<Place>,
        /// The missing key.
        key: String,
    },
    /// A value of the wrong type or an unknown choice.
    #[error("{place}: {problem}")]
    WrongType {
        /// The value.
        place: Box<Place>,
        /// What was found and expected.
        problem: String,
    },
    /// A value outside its domain, or a combination of values without a meaning.
    #[error("{place}: found {found}, expected {expected}; {remedy}")]
    Invalid {
        /// The value.
        place: Box<Place>,
        /// What the file says.
        found: String,
        /// What would be valid.
        expected: String,
        /// What to do.
        remedy: String,
    },
    /// A name that refers to nothing.
    #[error("{place}: no {kind} is called \"{found}\"{}", hint(nearest.as_deref(), known))]
    UnknownName {
        /// The reference.
        place: Box<Place>,
        /// What it should name, for example `material`.
        kind: &'static str,
        /// The name as written.
        found: String,
        /// The most similar existing name.
        nearest: Option<String>,
        /// All existing names.
        known: Vec<String>,
    },
    /// An asset that is nowhere.
    #[error(
        "{place}: found no file \"{asset}\"; looked at {}; set PHOTONSTREAM_SCENES to the folder that holds the scenes, \
         or put the file into assets/ (README.md, \"Scenes\", says where to get it)",
        list(looked)
    )]
    AssetMissing {
        /// The reference.
        place: Box<Place>,
        /// The path as written.
        asset: String,
        /// Where it was looked for, in order.
        looked: Vec<PathBuf>,
    },
    /// An asset that cannot be used.
    #[error("{place}: asset {}: {problem}; {remedy}", asset.display())]
    Asset {
        /// The reference.
        place: Box<Place>,
        /// The file.
        asset: PathBuf,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        remedy: String,
    },
}

fn hint(nearest: Option<&str>, valid: &[String]) -> String {
    match nearest {
        Some(nearest) => format!(", did you mean \"{nearest}\"?"),
        None if valid.is_empty() => "; there is none to choose from".into(),
        None => format!("; expected one of: {}", valid.join(", ")),
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// The candidate most similar to `word`, if one is similar enough to be meant.
pub(crate) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let lower = word.to_lowercase();
    candidates
        .into_iter()
        .map(|c| {
            // A forgotten or wrong unit suffix is the likeliest slip; Jaro-Winkler favours a common start.
            (strsim::jaro_winkler(&lower, &c.to_lowercase()), c)
        })
        .filter(|(similarity, _)| *similarity > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c.to_owned())
}
