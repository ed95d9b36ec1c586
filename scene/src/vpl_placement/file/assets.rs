//! Turns paths of assets in a scene file into paths that lead to the same files from another folder.

use crate::import::AssetRoots;
use std::path::Path;
use toml_edit::{DocumentMut, TableLike, Value};

/// Rewrites the relative paths of a scene file at `from` that would lead elsewhere, or nowhere, from `to`: relative to the
/// folder of `to` where the asset lies in it, else absolute. What is not found is left as it is.
pub(super) fn rebase(document: &mut DocumentMut, from: &Path, to: &Path) {
    let (before, after) = (AssetRoots::from_environment(from), AssetRoots::from_environment(to));
    let moved = |written: &str| {
        let asset = Path::new(written);
        let file = before.find(asset).ok()?;
        let same = |other: &Path| other == file || other.canonicalize().ok() == file.canonicalize().ok();
        if after.find(asset).is_ok_and(|other| same(&other)) {
            return None;
        }
        let folder = std::path::absolute(to).ok()?.parent()?.to_owned();
        let path = file.strip_prefix(&folder).unwrap_or(&file).to_str()?.to_owned();
        // In the folder, but hidden by another file of that name that is found before.
        let is_found = after.find(Path::new(&path)).is_ok_and(|other| same(&other));
        Some(if is_found { path } else { file.to_str()?.to_owned() })
    };
    for (kinds, key, tables) in [(&["obj", "ply", "gltf"][..], "path", "object"), (&["sky"], "map", "light")]
    {
        let Some(named) = document.get_mut(tables).and_then(|item| item.as_table_like_mut()) else {
            continue;
        };
        for (_, item) in named.iter_mut() {
            let Some(table) = item.as_table_like_mut() else { continue };
            for kind in kinds {
                let inner = table.get_mut(kind).and_then(|item| item.as_table_like_mut());
                if let Some(inner) = inner {
                    replace(inner, key, moved);
                }
            }
        }
    }
}

fn replace(table: &mut dyn TableLike, key: &str, moved: impl Fn(&str) -> Option<String>) {
    let Some(value) = table.get_mut(key).and_then(|item| item.as_value_mut()) else { return };
    let Some(path) = value.as_str().and_then(moved) else { return };
    let decor = value.decor().clone();
    *value = Value::from(path);
    *value.decor_mut() = decor;
}
