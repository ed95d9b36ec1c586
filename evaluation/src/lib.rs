//! Turns scenes, pictures and their references into speed against error.
//!
//! [`evaluate()`] measures scenes and writes `results.csv`, `results.json` and `index.html`: `plan` says which points,
//! `methods` make their pictures, `truth` is what these are compared with, `split` says what causes the errors, `report`
//! shows it all. [`compare`] is for two pictures.
#![forbid(unsafe_code)]

mod command;
pub mod device;
mod error;
mod evaluate;
pub mod figures;
pub mod flip;
pub mod hard_cases;
pub mod machine;
pub mod maps;
pub mod methods;
pub mod metrics;
pub mod motion;
pub mod paper_tables;
pub mod pareto;
pub mod plan;
pub mod point;
pub mod report;
pub mod results;
pub mod split;
pub mod truth;

pub use error::EvaluateError;
pub use evaluate::{Observer, Options, SCENE_WITHOUT_LIGHT, evaluate};
pub use metrics::{Comparison, MetricsError, compare};
