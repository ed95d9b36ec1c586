//! Turns pictures and their reference into figures of error.
#![forbid(unsafe_code)]

pub mod metrics;

pub use metrics::{Comparison, MetricsError, compare};
