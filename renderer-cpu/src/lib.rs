//! Turns published virtual surface lights into pictures on the CPU, and scenes into path-traced reference pictures.
//!
//! [`render`] evaluates the sum of METHODS §2 over a [`VslSet`]; [`reference()`] is the truth that it is measured
//! against. Both use the scene's own rays and the maths of `photonstream-shading`, and nothing else in common.
//! [`attach::run`] is the renderer process: it follows a simulator's channel and writes pictures.
#![forbid(unsafe_code)]

pub mod attach;
pub mod cli;
mod cull;
mod direct;
mod error;
mod gather;
mod layer;
mod options;
mod owner;
pub mod published;
pub mod reference;
mod render;
mod shadowed;
mod surface;
mod tile;
mod vsl;
mod watch;

pub use error::RenderError;
pub use gather::InstructionSet;
pub use layer::LayerKind;
pub use options::RenderOptions;
pub use reference::{Reference, ReferenceOptions, reference};
pub use render::{RenderStats, Rendered, render, render_with};
pub use vsl::{Vsl, VslSet};
pub use watch::Watch;
