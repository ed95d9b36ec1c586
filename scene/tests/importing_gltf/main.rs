//! Checks imports of glTF files, one small file for each feature.
#![allow(clippy::unwrap_used)]

mod animations;
mod bad;
mod cameras;
mod colours;
mod files;
mod geometry;
mod parts;
mod riding;
mod surfaces;
mod textures;
