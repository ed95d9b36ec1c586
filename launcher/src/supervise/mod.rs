//! Turns roles into processes that are watched, restarted when they crash, and ended together.
//!
//! One thread owns all children: signals (also those of their deaths) arrive as messages, so there is nothing to lock.
//! Children are started by the thread that calls, which has to live as long as they do.

mod backoff;
mod process;
mod role;
mod sequence;
mod voice;

pub(crate) use role::{Kind, Role, find_plug_in};
pub(crate) use sequence::{Sequence, written_since};
pub(crate) use voice::ChildOutput;

use crate::{
    error::LauncherError,
    signals::{Listener, Signal},
};
use process::{Process, State};
use std::{
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

/// So long may children take to end in order.
const GRACE: Duration = Duration::from_secs(5);

/// All processes of one run.
pub(crate) struct Supervisor {
    signals: Listener,
    processes: Vec<Process>,
    output: ChildOutput,
    failures: Vec<LauncherError>,
    ended: bool,
    kill: bool,
}

/// How one role fared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fate {
    /// Times it was started again.
    pub(crate) restarts: u32,
    /// Whether it failed for good.
    pub(crate) failed: bool,
    /// Name of what has taken its place.
    pub(crate) replaced_by: Option<String>,
}

impl Supervisor {
    pub(crate) fn new(output: ChildOutput) -> Result<Self, LauncherError> {
        let signals = Listener::start()?;
        Ok(Self { signals, processes: Vec::new(), output, failures: Vec::new(), ended: false, kill: false })
    }

    /// Starts a process.
    pub(crate) fn start(&mut self, role: Role) -> Result<(), LauncherError> {
        self.processes.push(Process::start(role, self.output)?);
        Ok(())
    }

    /// A flag that is true from the first signal that asks for the end.
    pub(crate) fn end_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.signals.ended)
    }

    /// Sees to the children until something happens, at most for `timeout`.
    ///
    /// # Errors
    /// `Interrupted` once a signal asks for the end, and that of a simulator that failed for good. The failure of a
    /// renderer waits in `take_failure`: the others go on.
    pub(crate) fn attend(&mut self, timeout: Duration) -> Result<(), LauncherError> {
        let due = self.processes.iter().filter_map(|p| match p.state {
            State::Waiting { until } => Some(until),
            _ => None,
        });
        let deadline = due.fold(Instant::now() + timeout, Instant::min);
        match self.signals.messages.recv_deadline(deadline) {
            Ok(Signal::Child) | Err(_) => {}
            Ok(signal) => {
                self.kill |= signal == Signal::EndNow;
                return Err(LauncherError::Interrupted);
            }
        }
        let mut given_up = None;
        for process in &mut self.processes {
            match process.look().and_then(|()| process.start_if_due(self.output)) {
                Err(error) if process.is(Kind::Simulator) => return Err(error),
                Err(error) => {
                    given_up = Some(process.role.name.clone());
                    self.failures.push(error);
                }
                Ok(()) => {}
            }
        }
        if let Some(name) = given_up.filter(|_| !self.is_over(Kind::Renderer)) {
            tracing::warn!("{name} is given up; the others go on");
        }
        Ok(())
    }

    /// Whether all processes of a kind have ended and will not be started again.
    pub(crate) fn is_over(&self, kind: Kind) -> bool {
        self.processes.iter().filter(|p| p.is(kind)).all(Process::is_over)
    }

    /// The first renderer's failure, if there was one.
    pub(crate) fn take_failure(&mut self) -> Option<LauncherError> {
        (!self.failures.is_empty()).then(|| self.failures.remove(0))
    }

    /// How each role of a kind fared, in the order in which they were started.
    pub(crate) fn fates(&self, kind: Kind) -> Vec<Fate> {
        let fate = |p: &Process| Fate {
            restarts: p.restarts,
            failed: matches!(p.state, State::Failed),
            replaced_by: p.replaced_by.clone(),
        };
        self.processes.iter().filter(|p| p.is(kind)).map(fate).collect()
    }

    /// Ends all children, in order where they let it: renderers first, so that they don't see the light go out.
    pub(crate) fn end(&mut self) {
        if self.ended {
            return;
        }
        self.ended = true;
        for kind in [Kind::Renderer, Kind::Simulator] {
            self.end_kind(kind);
        }
    }

    fn end_kind(&mut self, kind: Kind) {
        use rustix::process::Signal as Kill;
        let mine = |p: &&mut Process| p.is(kind);
        let signal = if self.kill { Kill::KILL } else { Kill::TERM };
        self.processes.iter_mut().filter(mine).for_each(|p| p.signal(signal));
        let deadline = Instant::now() + GRACE;
        loop {
            self.processes.iter_mut().filter(mine).for_each(Process::collect);
            if !self.processes.iter().any(|p| p.is(kind) && p.is_running()) {
                return;
            }
            let kill_now = match self.signals.messages.recv_deadline(deadline) {
                Ok(Signal::EndNow) => true,
                // The first signal may come while an end for other reasons is under way.
                Ok(Signal::End | Signal::Child) => false,
                Err(_) => true,
            };
            if kill_now {
                self.kill = true;
                for process in self.processes.iter_mut().filter(mine) {
                    if process.is_running() {
                        tracing::warn!("{} does not end in order and is ended by force", process.role.name);
                        process.signal(Kill::KILL);
                    }
                }
                // A killed process ends as soon as the system gets round to it.
                while self.processes.iter().any(|p| p.is(kind) && p.is_running()) {
                    std::thread::sleep(Duration::from_millis(2));
                    self.processes.iter_mut().filter(mine).for_each(Process::collect);
                }
                return;
            }
        }
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        self.end();
    }
}
