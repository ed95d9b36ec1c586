//! Tests of the simulator through its public interface.

mod adaptive;
mod animated;
mod closed_forms;
mod distance_maps;
mod edits;
mod exactness;
mod few_lights;
mod placed;
mod reload;
mod selective;
mod service;
mod service_edits;
mod sky;
mod split;
mod support;
mod textured;
