//! Turns published virtual surface lights into pictures on the GPU: paper A's deferred renderer, on wgpu.
#![deny(unsafe_code)]

pub mod cli;
mod deferred;
mod draw;
mod error;
#[cfg(test)]
#[path = "../tests/pictures/fence.rs"]
mod fence;
mod frame;
mod gather;
mod geometry;
mod gpu;
#[cfg(all(feature = "import", unix))]
mod import;
mod layout;
mod map_buffer;
mod openness;
mod owners;
mod picture;
mod pipelines;
mod present;
mod rays;
mod readback;
mod renderer;
mod scope;
mod shader;
mod shadow_maps;
mod shadow_views;
mod sky;
mod stages;
mod targets;
pub mod test_gpu;
mod textures;
mod timer;
mod view;
mod vsl_buffer;
mod vsl_shadow_maps;

pub use draw::Drawn;
pub use error::GpuError;
pub use gpu::{AdapterChoice, Gpu, UNIFORM_BLOCK_BYTES, instance_flags};
#[cfg(all(feature = "import", unix))]
pub use import::{ImportError, ImportedSegment};
pub use picture::{Choices, WgpuRenderer};
pub use renderer::Renderer;
pub use timer::PassTime;
pub use view::{Accumulation, Shadows, Show, View};
pub use vsl_buffer::Upload;
