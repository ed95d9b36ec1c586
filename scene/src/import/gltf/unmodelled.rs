//! Turns what a glTF file has beyond what is modelled into an error, or one notice each.

use gltf::json::Root;

/// Extensions that are read.
const READ: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // Says only that a material is not lit, which here it is.
    "KHR_materials_unlit",
];

/// Extensions without which the geometry is still right.
const PASSED_OVER: &[&str] = &["KHR_materials_", "EXT_texture_", "KHR_texture_basisu", "MSFT_texture_dds"];

/// What is passed over of a file, one sentence each.
///
/// # Errors
/// If it is of another version, or needs an extension that cannot be passed over.
pub(super) fn check(root: &Root) -> Result<Vec<String>, String> {
    let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    if version != "2.0" {
        let version: String = version.chars().take(20).collect();
        return Err(format!("found a file of glTF {version:?}, expected 2.0; convert it"));
    }
    let is_read = |name: &String| READ.contains(&name.as_str());
    let is_passed_over = |name: &String| PASSED_OVER.iter().any(|known| name.starts_with(known));
    if let Some(name) = root.extensions_required.iter().find(|name| !is_read(name) && !is_passed_over(name)) {
        let name: String = name.chars().take(100).collect();
        return Err(format!(
            "it needs the extension {name:?}, which is not read; export it without (no compression)"
        ));
    }
    let mut notices = Vec::new();
    let unread: Vec<_> =
        root.extensions_used.iter().filter(|name| !is_read(name)).map(String::as_str).collect();
    if !unread.is_empty() {
        notices.push(format!("extensions are passed over: {}", unread.join(", ")));
    }
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    for (is_there, what) in [
        (!root.skins.is_empty(), "skins are not read: meshes stand as they were modelled"),
        (
            primitives().any(|p| p.targets.as_ref().is_some_and(|t| !t.is_empty())),
            "morph targets are not read",
        ),
        (
            root.cameras.iter().any(|camera| camera.orthographic.is_some()),
            "orthographic cameras are passed over",
        ),
    ] {
        if is_there {
            notices.push(what.to_owned());
        }
    }
    Ok(notices)
}
