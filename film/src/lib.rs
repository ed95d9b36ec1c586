//! Turns named layers of linear radiance into EXR and PNG files, and EXR files back into layers.
//!
//! A [`Film`] is what every renderer here produces and what `compare` reads back. Layers hold linear RGB with
//! Rec. 709 primaries; what the numbers mean (radiance, albedo, a normal …) is the layer's business and told by its
//! name. Files are written beside their target and renamed, so a reader sees the old or the new picture, never half.
#![forbid(unsafe_code)]

mod atomic;
mod error;
mod film;
mod linear_exr;
mod metadata;
mod tone_mapped_png;

pub use error::FilmError;
pub use film::{Film, Layer};
pub use metadata::Metadata;
pub use tone_mapped_png::Display;
