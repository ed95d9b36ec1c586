//! Turns the names of glTF things, which may be missing or equal, into names that are unique and hold no slash.

use std::collections::BTreeSet;

/// A name for each of `given`, in order; `unnamed` with their number for those without.
pub(super) fn unique<'n>(given: impl Iterator<Item = Option<&'n str>>, unnamed: &str) -> Vec<String> {
    let mut taken = BTreeSet::new();
    given
        .enumerate()
        .map(|(index, name)| {
            let name = name
                .map(clean)
                .filter(|name| !name.is_empty())
                .unwrap_or_else(|| format!("{unnamed}{index}"));
            let mut unique = name.clone();
            while !taken.insert(unique.clone()) {
                // The number of a thing is its own; what is called like that already gets one more.
                unique = format!("{unique}.{index}");
            }
            unique
        })
        .collect()
}

/// A slash separates the parts of an imported name.
fn clean(name: &str) -> String {
    name.chars().map(|c| if c == '/' || c.is_control() { '_' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_clean() {
        let given = [Some("a"), None, Some("a"), Some("b/c\n"), Some(""), Some("a.2"), Some("node1")];
        let names = unique(given.into_iter(), "node");
        assert_eq!(names, ["a", "node1", "a.2", "b_c_", "node4", "a.2.5", "node1.6"]);
    }
}
