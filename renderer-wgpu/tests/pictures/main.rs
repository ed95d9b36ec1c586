//! Pictures of the GPU renderer against those of the CPU from the same published frame, and against each other.
#![allow(clippy::unwrap_used)]

mod against_cpu;
mod scenes;
