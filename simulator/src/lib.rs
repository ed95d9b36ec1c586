//! Turns a scene into the flux of its virtual surface lights, and publishes it.
#![forbid(unsafe_code)]

mod apportion;
pub mod bench;
pub mod budgets;
pub mod cancel;
pub mod change;
pub mod cli;
pub mod counters;
pub mod distance_maps;
mod disturbance;
pub mod emitters;
mod encounters;
pub mod error;
pub mod exposure;
pub mod few_lights;
pub mod flux;
pub mod ledger;
pub mod method;
pub mod owner;
pub mod patch;
pub mod placement;
pub mod pool;
pub mod records;
pub mod service;
pub mod simulation;
pub mod split;
mod streams;
pub mod tracer;
pub mod trail;
pub mod vsl;
