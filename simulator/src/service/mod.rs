//! Turns a scene into a running service: actors joined by channels, each owning what it writes.
//!
//! ```text
//! config watcher ─┐          placer, loader
//! control socket ─┤            ⇅
//! signals, clock ─┴─────── director ─→ ledger ⇄ tracers × N        (tasks out, finished batches in)
//!                                        └────→ publisher ─→ shared memory
//! ```
//!
//! The director decides, and turns edits, saved configs and time into new versions of the scene; what takes long (reading
//! a config, placing its lights) is done aside, so that it answers meanwhile. The ledger alone writes
//! pool and flux, tracers have no state, the publisher alone writes shared memory. All channels are bounded: who is slow slows down who feeds it. When nothing is left to trace every thread
//! sleeps.

mod clock;
mod config_source;
mod director;
mod edits;
mod ledger_actor;
mod loader;
mod placements;
mod placer;
mod published_maps;
mod publisher_actor;
mod settings;
mod stamp;
mod tracer_actor;
mod watcher;

pub use config_source::ConfigSource;
pub use director::{Ending, Options, Summary, run};
pub use ledger_actor::State;

use crate::error::SimulatorError;
use std::thread::JoinHandle;

/// Tells the director when its thread ends, by return or by panic.
struct Farewell(flume::Sender<()>);

impl Drop for Farewell {
    fn drop(&mut self) {
        // One message is enough, and nobody may be listening any more.
        let _ = self.0.try_send(());
    }
}

/// Starts a named thread.
pub(crate) fn spawn<T: Send + 'static>(
    actor: &'static str,
    body: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, SimulatorError> {
    std::thread::Builder::new()
        .name(actor.to_owned())
        .spawn(body)
        .map_err(|source| SimulatorError::Spawn { actor, source })
}
