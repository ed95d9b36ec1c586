//! Turns a role into a process that is started, seen to end, and judged.

use super::{
    backoff::{Backoff, Verdict},
    role::{Kind, Role},
    sequence::Sequence,
    voice::{ChildOutput, Voice},
};
use crate::{error::LauncherError, exit};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    ffi::OsString,
    os::unix::process::ExitStatusExt,
    process::{Child, ExitStatus},
    time::{Duration, Instant},
};

/// Where a process stands.
pub(super) enum State {
    /// It runs.
    Running { child: Child, voice: Voice, since: Instant },
    /// It failed, and will be started again then.
    Waiting { until: Instant },
    /// It did what it was for.
    Done,
    /// It failed for good.
    Failed,
}

/// A role and its present process.
pub(super) struct Process {
    pub(super) role: Role,
    pub(super) state: State,
    pub(super) restarts: u32,
    /// Name of what has taken its place.
    pub(super) replaced_by: Option<String>,
    backoff: Backoff,
}

impl Process {
    pub(super) fn start(role: Role, output: ChildOutput) -> Result<Self, LauncherError> {
        let first = role.sequence.as_ref().map_or_else(Vec::new, Sequence::whole);
        let state = spawn(&role, &first, output)?;
        Ok(Self { role, state, restarts: 0, replaced_by: None, backoff: Backoff::default() })
    }

    /// Looks whether it has ended. The error is that of a process that failed for good.
    pub(super) fn look(&mut self) -> Result<(), LauncherError> {
        let State::Running { child, since, .. } = &mut self.state else { return Ok(()) };
        let status = child.try_wait().map_err(|e| LauncherError::io("wait for", &self.role.name, e))?;
        let Some(status) = status else { return Ok(()) };
        let uptime = since.elapsed();
        let State::Running { voice, .. } = std::mem::replace(&mut self.state, State::Done) else {
            unreachable!("invariant: it was running a moment ago")
        };
        if status.success() {
            return Ok(());
        }
        self.judge(status, uptime, voice.last_words())
    }

    fn judge(
        &mut self,
        status: ExitStatus,
        uptime: Duration,
        said: Vec<String>,
    ) -> Result<(), LauncherError> {
        let name = self.role.name.clone();
        let how = describe(status);
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        // What is wrong with the scene, the channel or the command line is still wrong the next time.
        let final_code = code.filter(|c| {
            self.role.plug_in.is_none() && [exit::USAGE, exit::CONFIG, exit::CHANNEL].contains(c)
        });
        if let Some(code) = final_code {
            self.state = State::Failed;
            return Err(LauncherError::Child { name, how: "cannot run".into(), said, code });
        }
        // The device will not do better, and others need none. One that has drawn before may recover.
        let never_drew = !self.role.sequence.as_ref().is_some_and(Sequence::has_begun);
        if code == Some(exit::DEVICE) && never_drew && self.replace(&how, &said) {
            return Ok(());
        }
        let complaint = status.code().map(|code| format!("{code} {}", said.join("\n")));
        match self.backoff.failed(uptime, complaint) {
            Verdict::Retry(pause) => {
                // Who was killed said nothing about it.
                let last = said.last().filter(|_| code.is_some());
                let words = last.map_or_else(String::new, |line| format!(" ({line})"));
                tracing::warn!("{name} {how} after {:.1} s{words}; starting it again", uptime.as_secs_f64());
                self.state = State::Waiting { until: Instant::now() + pause };
                Ok(())
            }
            Verdict::GiveUp if self.replace(&how, &said) => Ok(()),
            Verdict::GiveUp => {
                self.state = State::Failed;
                let how = format!("{how}, after {} restarts", self.restarts);
                Err(LauncherError::Child { name, how, said, code: exit::CHILD })
            }
        }
    }

    /// Lets its stand-in take its place; whether it has one.
    fn replace(&mut self, how: &str, said: &[String]) -> bool {
        let Some(stand_in) = self.role.stand_in.take() else { return false };
        let words = said.last().map_or_else(String::new, |line| format!(" ({line})"));
        let pictures = stand_in.sequence.as_ref().map_or_else(String::new, |sequence| {
            format!(" and writes pictures to {}", sequence.folder.display())
        });
        tracing::warn!("{} {how}{words}; {} takes its place{pictures}", self.role.name, stand_in.name);
        self.replaced_by = Some(stand_in.name.clone());
        self.role = *stand_in;
        self.backoff = Backoff::default();
        self.state = State::Waiting { until: Instant::now() };
        true
    }

    /// Starts it again if the time has come. The error is that of a process that cannot be started any more.
    pub(super) fn start_if_due(&mut self, output: ChildOutput) -> Result<(), LauncherError> {
        if !matches!(self.state, State::Waiting { until } if until <= Instant::now()) {
            return Ok(());
        }
        let Some(rest) = self.role.sequence.as_ref().map_or_else(|| Some(Vec::new()), Sequence::rest) else {
            tracing::info!("{} has written all its pictures and is not started again", self.role.name);
            self.state = State::Done;
            return Ok(());
        };
        match spawn(&self.role, &rest, output) {
            Ok(state) => {
                self.state = state;
                self.restarts += 1;
                Ok(())
            }
            Err(error) => self.not_started(&error),
        }
    }

    /// What prevents a start may pass, like a lack of memory: tried as often as one that never comes up.
    fn not_started(&mut self, error: &LauncherError) -> Result<(), LauncherError> {
        match self.backoff.failed(Duration::ZERO, None) {
            Verdict::Retry(pause) => {
                tracing::warn!("{error}; trying again");
                self.state = State::Waiting { until: Instant::now() + pause };
                Ok(())
            }
            Verdict::GiveUp => {
                self.state = State::Failed;
                let (name, how) = (self.role.name.clone(), "could not be started again".into());
                Err(LauncherError::Child { name, how, said: vec![error.to_string()], code: exit::CHILD })
            }
        }
    }

    /// Asks it to end, or ends it; one that waits for its restart waits no more.
    pub(super) fn signal(&mut self, signal: Signal) {
        match &self.state {
            State::Running { child, .. } => {
                let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
                if let Some(pid) = pid {
                    // It may have ended a moment ago; until it is waited for, its number stays its own.
                    let _ = kill_process(pid, signal);
                }
            }
            State::Waiting { .. } => self.state = State::Done,
            State::Done | State::Failed => {}
        }
    }

    /// Collects it without judging, at the end of all.
    pub(super) fn collect(&mut self) {
        if let State::Running { child, .. } = &mut self.state
            && let Ok(Some(_)) = child.try_wait()
        {
            let State::Running { voice, .. } = std::mem::replace(&mut self.state, State::Done) else {
                return;
            };
            // The last lines are printed while this waits.
            let _ = voice.last_words();
        }
    }

    pub(super) fn is_running(&self) -> bool {
        matches!(self.state, State::Running { .. })
    }

    pub(super) fn is_over(&self) -> bool {
        matches!(self.state, State::Done | State::Failed)
    }

    pub(super) fn is(&self, kind: Kind) -> bool {
        self.role.kind == kind
    }
}

fn spawn(role: &Role, more: &[OsString], output: ChildOutput) -> Result<State, LauncherError> {
    let mut child = role.command(more)?.spawn().map_err(|e| LauncherError::io("start", &role.name, e))?;
    let voice = Voice::listen(&role.name, (child.stdout.take(), child.stderr.take()), output);
    tracing::debug!(pid = child.id(), "{} started", role.name);
    Ok(State::Running { child, voice, since: Instant::now() })
}

fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(101), _) => "panicked (a bug: please report it)".into(),
        (Some(code), _) => format!("failed with exit code {code}"),
        (None, Some(signal)) => {
            let name = signal_hook::low_level::signal_name(signal).unwrap_or("unknown");
            format!("was ended by signal {signal} ({name})")
        }
        (None, None) => "ended in an unknown way".into(),
    }
}
