//! Turns the environment into the folder of the user that keeps what took long to compute.

use std::{ffi::OsString, path::PathBuf};

/// Names another folder, or is `off`.
const VARIABLE: &str = "PHOTONSTREAM_CACHE";

/// `$PHOTONSTREAM_CACHE`, else `$XDG_CACHE_HOME/photonstream`, else `~/.cache/photonstream`; `None` where nothing is to
/// be kept, or nowhere.
pub fn user_cache() -> Option<PathBuf> {
    folder(|name| std::env::var_os(name))
}

fn folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let given = |name: &str| variable(name).filter(|value| !value.is_empty());
    match given(VARIABLE) {
        Some(value) if value == "off" => return None,
        Some(value) => return std::path::absolute(value).ok(),
        None => {}
    }
    let base = given("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| given("HOME").map(|home| PathBuf::from(home).join(".cache")))?;
    base.is_absolute().then(|| base.join("photonstream"))
}

#[cfg(test)]
mod tests {
    use super::folder;
    use std::path::{Path, PathBuf};

    #[test]
    fn the_nearest_variable_counts() {
        let found = |set: &[(&str, &str)]| {
            folder(|name| set.iter().find(|(other, _)| *other == name).map(|(_, value)| value.into()))
        };
        let home = ("HOME", "/home/a");
        assert_eq!(found(&[]), None);
        assert_eq!(found(&[home]), Some(PathBuf::from("/home/a/.cache/photonstream")));
        assert_eq!(found(&[("XDG_CACHE_HOME", "/c"), home]), Some(PathBuf::from("/c/photonstream")));
        assert_eq!(
            found(&[("XDG_CACHE_HOME", ""), home]),
            Some(PathBuf::from("/home/a/.cache/photonstream"))
        );
        assert_eq!(found(&[("XDG_CACHE_HOME", "c"), home]), None);
        assert_eq!(found(&[("PHOTONSTREAM_CACHE", "off"), home]), None);
        assert_eq!(found(&[("PHOTONSTREAM_CACHE", "/here"), home]), Some(PathBuf::from("/here")));
        let relative = found(&[("PHOTONSTREAM_CACHE", "here")]).unwrap();
        assert!(relative.is_absolute() && relative.ends_with(Path::new("here")));
    }
}
