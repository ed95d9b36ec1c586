//! Turns published virtual surface lights into pictures on the GPU: paper A's deferred renderer, on wgpu.
#![deny(unsafe_code)]

mod error;
mod gpu;
mod layout;
mod shader;
#[cfg(test)]
mod test_gpu;

pub use error::GpuError;
pub use gpu::{AdapterChoice, Gpu, UNIFORM_BLOCK_BYTES, instance_flags};
