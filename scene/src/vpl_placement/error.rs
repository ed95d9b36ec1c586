//! Says why no virtual point lights were placed.

/// Why placement of virtual point lights failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VplPlacementError {
    /// A setting is outside its domain.
    #[error("{name}: found {found}, expected {expected}")]
    Setting {
        /// Which one.
        name: &'static str,
        /// Its value.
        found: String,
        /// Its domain.
        expected: String,
    },
    /// No path met a side that reflects.
    #[error(
        "none of {paths} paths met a side that reflects: the start may lie in a body or behind walls that look away; give \
         another one with --from"
    )]
    NothingFound {
        /// How many were traced.
        paths: u32,
    },
    /// No surface lies nearest to any of what was found.
    #[error(
        "none of {clusters} places found, {spacing_m} m apart, has surface around it that no other stands for; trace more paths \
         with --population, or give a wider --spacing-m"
    )]
    NoSurface {
        /// How many places there were.
        clusters: u32,
        /// Their distance, m.
        spacing_m: f32,
    },
}
