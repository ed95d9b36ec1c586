//! Turns hard cases (extreme scales, powers, reflectances, meshes, numbers and counts) into light and pictures, and holds
//! each to a figure. `tests/hard-cases.md` lists them with those that are tested elsewhere.
#![allow(clippy::unwrap_used)]

mod albedo;
mod counters;
mod flushing;
mod kernels;
mod lights;
mod meshes;
mod numbers;
mod odd_lights;
mod places;
mod properties;
mod rooms;
mod sizes;
mod table;
