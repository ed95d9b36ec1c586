//! Tests of the CPU renderer and the reference through their public interface.

mod attach;
mod culling;
mod emissive;
mod gather;
mod options_and_layers;
mod reference_closed_forms;
mod reference_noise;
mod scenes;
mod sky;
mod smooth;
