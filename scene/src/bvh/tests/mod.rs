//! Turns soups, closed meshes and extreme rays into checks of every promise the structure makes.
// One part is a list of one range, and meant as such.
#![allow(clippy::unwrap_used, clippy::single_range_in_vec_init)]

mod brute_force;
mod degenerate;
mod parts;
mod refit;
pub(super) mod shapes;
mod watertight;
