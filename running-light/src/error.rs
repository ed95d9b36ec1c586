//! Turns slices that do not fit each other into an error that says which and by how much.

/// A slice for results that has not one entry for each VPL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{slice}` has {found} entries, expected {expected}: give it one for each VPL")]
pub struct LengthError {
    /// The parameter's name.
    pub slice: &'static str,
    /// Its length.
    pub found: usize,
    /// The number of VPLs.
    pub expected: usize,
}

impl LengthError {
    pub(crate) fn check(slice: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self { slice, found, expected }) }
    }
}
