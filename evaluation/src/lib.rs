//! Turns pictures and their reference into figures of error.
#![forbid(unsafe_code)]
