//! Turns soups, closed meshes and extreme rays into checks of every promise the structure makes.
#![allow(clippy::unwrap_used)]

mod brute_force;
mod degenerate;
mod parts;
mod shapes;
mod watertight;
