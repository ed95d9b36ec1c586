//! Turns a running simulation into a window: what the GPU renderer draws, and hands for camera, lights, objects,
//! VPLs, blockers and proxies.
//!
//! [`run`] opens the window and stays until it is closed. Three threads: the window's own draws and never waits for the
//! simulator; one follows the channel and wakes the window for news; one talks to the simulator's control socket. While
//! nothing changes, nothing is drawn.
#![forbid(unsafe_code)]

mod application;
mod arguments;
mod choices;
mod commands;
mod dragging;
mod drawing;
mod error;
mod fault;
mod flaws;
mod following;
mod gizmos;
mod graphics;
mod input;
mod interface;
mod keys;
mod latency;
mod navigation;
mod notices;
mod overlay;
mod picking;
mod pointer;
mod probe;
mod screenshot;
mod session;
mod standing;

pub use application::{Ended, Report, run};
pub use arguments::Args;
pub use error::WindowError;
pub use fault::{Fault, FaultKind};
pub use probe::probe;
