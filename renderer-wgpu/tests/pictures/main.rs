//! Pictures of the GPU renderer against those of the CPU from the same published frame, and against each other.
#![allow(clippy::unwrap_used)]

mod accumulations;
mod against_cpu;
mod approximations;
mod edited;
mod emissive;
mod extremes;
mod fence;
mod few_lights;
mod holes;
mod only_what_changed;
mod scenes;
mod sky;
mod smooth;
mod textured;
mod twin_distance_map;
mod twin_texture;
mod twins;
