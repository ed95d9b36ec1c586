//! Turns what a child process says into lines of the launcher, and keeps its last words.

use crate::log;
use std::{
    collections::VecDeque,
    io::{BufRead, BufReader, Read},
    process::{ChildStderr, ChildStdout},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Lines that are kept for the message that tells of a failure.
const KEPT: usize = 6;
/// A descendant may keep a pipe open after its parent has ended; so long is waited for the rest.
const PATIENCE: Duration = Duration::from_millis(300);
/// The line that ends a role of this executable begins with this.
const VERDICT: &str = "error: ";

/// Where the standard output of children goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChildOutput {
    /// To standard output, as it is.
    Through,
    /// To standard error, with the child's name: standard output is for one JSON object.
    Aside,
}

/// The pipes of a running child.
pub(super) struct Voice {
    last: Arc<Mutex<VecDeque<String>>>,
    ends: Vec<flume::Receiver<()>>,
}

impl Voice {
    pub(super) fn listen(
        name: &str,
        pipes: (Option<ChildStdout>, Option<ChildStderr>),
        to: ChildOutput,
    ) -> Self {
        let last = Arc::new(Mutex::new(VecDeque::new()));
        let mut ends = Vec::new();
        let (stdout, stderr) = pipes;
        if let Some(stderr) = stderr {
            let (name, last) = (name.to_owned(), Arc::clone(&last));
            ends.extend(read_lines(stderr, move |line| {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                // The launcher tells how it ended, once, and with these words.
                if !line.starts_with(VERDICT) {
                    log::raw(&format!("[{name}] {line}"));
                }
                last.push_back(line);
                if last.len() > KEPT {
                    last.pop_front();
                }
            }));
        }
        if let Some(stdout) = stdout {
            let name = name.to_owned();
            ends.extend(read_lines(stdout, move |line| match to {
                // Whoever read it may be gone.
                ChildOutput::Through => {
                    let _ = crate::output::line(line);
                }
                ChildOutput::Aside => log::raw(&format!("[{name}] {line}")),
            }));
        }
        Self { last, ends }
    }

    /// What the ended child said last: its verdict alone where it gave one, else its last lines.
    pub(super) fn last_words(self) -> Vec<String> {
        for end in &self.ends {
            // Either the pipe is closed or patience is over: both go on.
            let _ = end.recv_timeout(PATIENCE);
        }
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        match last.iter().rev().find_map(|line| line.strip_prefix(VERDICT)) {
            Some(verdict) => vec![verdict.to_owned()],
            None => last.iter().cloned().collect(),
        }
    }
}

/// Calls `say` with each line of `pipe`; the receiver is closed with the pipe.
fn read_lines(
    pipe: impl Read + Send + 'static,
    say: impl Fn(String) + Send + 'static,
) -> Option<flume::Receiver<()>> {
    let (alive, end) = flume::bounded(1);
    let read = move || {
        let _alive: flume::Sender<()> = alive;
        let mut pipe = BufReader::new(pipe);
        let mut line = Vec::new();
        while matches!(pipe.read_until(b'\n', &mut line), Ok(1..)) {
            let text = String::from_utf8_lossy(&line);
            say(text.trim_end_matches(['\n', '\r']).to_owned());
            line.clear();
        }
    };
    // Without a thread the pipe is closed, and the child goes on unheard.
    std::thread::Builder::new().name("listener".into()).spawn(read).ok().map(|_| end)
}
