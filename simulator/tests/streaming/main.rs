//! Tests of the simulator through its public interface.

mod closed_forms;
mod exactness;
mod placed;
mod service;
mod support;
