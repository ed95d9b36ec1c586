//! Turns a simulator's channel into pictures, whatever renders them: layers, options, the published scene, the loop.
//!
//! A renderer implements [`FrameRenderer`]; [`attach::run`] follows a channel and writes its pictures. How light is
//! gathered is the business of `photonstream-renderer-cpu` and `photonstream-renderer-wgpu`.
#![forbid(unsafe_code)]

pub mod attach;
pub mod cli;
mod error;
mod layer;
mod options;
pub mod owner;
pub mod program;
pub mod published;
mod rendered;
pub mod shadow_rays;
pub mod telemetry;
mod vsl;
mod watch;

pub use error::RenderError;
pub use layer::LayerKind;
pub use options::RenderOptions;
pub use rendered::{FrameRenderer, RenderStats, Rendered, SOFTWARE};
pub use vsl::{Patch, Vsl, VslSet, distance_map_edge};
pub use watch::Watch;
