//! Turns signals into messages on a channel and a flag that long work looks at.

use crate::error::LauncherError;
use signal_hook::{
    consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM},
    iterator::Signals,
};
use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// What a signal means to a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Signal {
    /// The user, the system or the terminal wants an end.
    End,
    /// The user wants it at once.
    EndNow,
    /// A child process changed its state.
    Child,
}

/// The signals of this process.
pub(crate) struct Listener {
    /// One message a signal; full of children's deaths is as good as one of them.
    pub(crate) messages: flume::Receiver<Signal>,
    /// True from the first signal that wants an end.
    pub(crate) ended: Arc<AtomicBool>,
}

impl Listener {
    /// Listens from now on.
    pub(crate) fn start() -> Result<Self, LauncherError> {
        let failed = |source| LauncherError::io("listen to", PathBuf::from("signals"), source);
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGCHLD]).map_err(failed)?;
        let (sender, messages) = flume::unbounded();
        let ended = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&ended);
        let listen = move || {
            for signal in signals.forever() {
                let message = match signal {
                    SIGCHLD => Signal::Child,
                    // A flag alone: no other data hangs on it.
                    _ if flag.swap(true, Ordering::Relaxed) => Signal::EndNow,
                    _ => Signal::End,
                };
                if sender.send(message).is_err() {
                    // Nobody takes messages any more; a command that ends has nothing left to protect.
                    std::process::exit(i32::from(crate::exit::INTERRUPTED));
                }
            }
        };
        std::thread::Builder::new().name("signals".into()).spawn(listen).map_err(failed)?;
        Ok(Self { messages, ended })
    }

    /// For work that has no child processes: the flag alone, and a second signal ends the process at once.
    pub(crate) fn flag_only() -> Result<Arc<AtomicBool>, LauncherError> {
        let Self { messages, ended } = Self::start()?;
        let wait = move || {
            while let Ok(signal) = messages.recv() {
                if signal == Signal::EndNow {
                    std::process::exit(i32::from(crate::exit::INTERRUPTED));
                }
            }
        };
        let failed = |source| LauncherError::io("listen to", PathBuf::from("signals"), source);
        std::thread::Builder::new().name("second signal".into()).spawn(wait).map_err(failed)?;
        Ok(ended)
    }
}
