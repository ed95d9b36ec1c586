//! What crosses processes: kill, restart, swap of renderers.
#![forbid(unsafe_code)]
