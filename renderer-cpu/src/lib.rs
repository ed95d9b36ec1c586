//! Turns published virtual surface lights into pictures on the CPU, and scenes into path-traced reference pictures.
//!
//! [`render`] evaluates the sum of METHODS §2 over a [`VslSet`](photonstream_renderer::VslSet); [`reference()`] is the truth that it is measured
//! against. Both use the scene's own rays and the maths of `photonstream-shading`, and nothing else in common.
//! [`CpuRenderer`] is the renderer process: it follows a simulator's channel and writes pictures.
#![forbid(unsafe_code)]

mod cull;
mod direct;
mod gather;
mod lanes;
mod mapped;
mod owner;
mod patched;
pub mod reference;
mod render;
mod shadowed;
mod surface;
mod threads;
mod tile;

pub use gather::InstructionSet;
pub use reference::{Reference, ReferenceOptions, reference};
pub use render::{CpuRenderer, render, render_with};
