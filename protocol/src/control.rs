//! Turns requests of users and renderers into messages to the simulator, and its answers back, over a local socket.

mod client;
mod message;
mod server;
mod wire;

pub use client::ControlClient;
pub use message::{Reply, Request};
pub use server::{ControlServer, Incoming, Replier};
