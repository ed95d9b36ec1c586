//! Turns asset files into meshes and materials.

mod assets;
mod obj;

pub use assets::AssetRoots;
pub(crate) use obj::{Group, Import, ImportedMaterial, load_obj};
