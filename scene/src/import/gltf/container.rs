//! Turns the bytes of a glTF or GLB file into its validated JSON and its binary chunk.

use gltf::{
    binary::Glb,
    json::{
        Path, Root, deserialize,
        validation::{Error, Validate},
    },
};
use std::borrow::Cow;

/// Length of a GLB header, bytes.
const GLB_HEADER: usize = 12;

/// What a glTF file holds itself.
pub(super) struct Container<'b> {
    pub(super) root: Root,
    /// The binary chunk of a GLB file.
    pub(super) bin: Option<Cow<'b, [u8]>>,
}

/// The JSON, whose references all lead to something, and the binary chunk of a GLB file.
///
/// # Errors
/// A sentence on what is wrong with them.
pub(super) fn parse(bytes: &[u8]) -> Result<Container<'_>, String> {
    let (json, bin) = if bytes.starts_with(b"glTF") {
        // The crate subtracts the header's length from what the header says.
        let length =
            bytes.get(8..GLB_HEADER).map(|b| b.iter().rev().fold(0, |n, b| n << 8 | usize::from(*b)));
        if length.is_none_or(|length| length < GLB_HEADER) {
            return Err("not a valid GLB file: its header is cut off".into());
        }
        let glb = Glb::from_slice(bytes).map_err(|e| format!("not a valid GLB file: {e}"))?;
        (glb.json, glb.bin)
    } else {
        (Cow::Borrowed(bytes), None)
    };
    let root: Root = deserialize::from_slice(&json).map_err(|e| format!("not a valid glTF file: {e}"))?;
    check_attributes(&root)?;
    let mut problem = None;
    root.validate(&root, Path::new, &mut |path, error| {
        let path = path();
        if problem.is_none() && matters(path.as_str(), error) {
            let what = match error {
                Error::IndexOutOfBounds => "names something that is not there",
                Error::Missing => "is missing",
                Error::Oversize => "is too large",
                Error::Invalid | Error::Unsupported => "has a value that glTF 2.0 does not know",
            };
            problem = Some(format!("not a valid glTF file: {} {what}", path.as_str()));
        }
    });
    match problem {
        Some(problem) => Err(problem),
        None => Ok(Container { root, bin }),
    }
}

/// Refuses attributes that name no accessor: the crate's own validation of positions panics on them.
fn check_attributes(root: &Root) -> Result<(), String> {
    for (mesh, all) in root.meshes.iter().enumerate() {
        for (primitive, all) in all.primitives.iter().enumerate() {
            if let Some(bad) = all.attributes.values().find(|a| a.value() >= root.accessors.len()) {
                return Err(format!(
                    "not a valid glTF file: meshes[{mesh}].primitives[{primitive}] has an attribute of accessor {}, of {}",
                    bad.value(),
                    root.accessors.len()
                ));
            }
        }
    }
    Ok(())
}

/// Whether a complaint is about something that is used: bounds of positions are not, required extensions are checked
/// elsewhere.
fn matters(path: &str, error: Error) -> bool {
    !(path.ends_with("].min") || path.ends_with("].max") || error == Error::Unsupported)
}
