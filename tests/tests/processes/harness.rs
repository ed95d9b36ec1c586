//! Turns a test into a private folder, in which the real command runs under a watchdog.

use photonstream_protocol::Runtime;
use serde_json::Value;
use std::{
    ffi::OsStr,
    fs,
    io::Read,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread::JoinHandle,
    time::{Duration, Instant},
};
use tempfile::TempDir;

/// The command under test: built by Cargo before this test, from the launcher's own main file.
pub(crate) const PHOTONSTREAM: &str = env!("CARGO_BIN_EXE_photonstream-under-test");

/// After this, whatever is waited for is taken never to come. No test depends on how fast anything is.
const WATCHDOG: Duration = Duration::from_secs(180);

/// A folder of its own for runtime files, and one to work in.
pub(crate) struct Ground {
    folder: TempDir,
}

/// What a finished command said.
#[derive(Debug)]
pub(crate) struct Said {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// A command that runs; it and all it started are killed when this is dropped.
pub(crate) struct Running<'a> {
    ground: &'a Ground,
    child: Child,
    pipes: Option<(JoinHandle<String>, JoinHandle<String>)>,
}

impl Ground {
    pub(crate) fn new() -> Self {
        let folder = tempfile::Builder::new().prefix("photonstream-test-").tempdir().unwrap();
        for name in ["runtime", "work"] {
            fs::create_dir(folder.path().join(name)).unwrap();
        }
        Self { folder }
    }

    /// The runtime folder, which identifies all processes of this ground.
    pub(crate) fn runtime(&self) -> PathBuf {
        self.folder.path().join("runtime")
    }

    /// A path in the working folder.
    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join("work").join(name)
    }

    /// Writes a file in the working folder.
    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).unwrap();
        path
    }

    /// The command, not started.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        self.command_of(Path::new(PHOTONSTREAM), arguments)
    }

    /// A copy of the command, not started.
    pub(crate) fn command_of(&self, program: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command
            .args(arguments)
            .current_dir(self.path(""))
            .env("PHOTONSTREAM_RUNTIME_DIR", self.runtime())
            .env("PHOTONSTREAM_CACHE", "off")
            .env_remove("RUST_LOG")
            // No test opens a window on the display of whoever runs it.
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env_remove("PHOTONSTREAM_OWNED")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Starts the command.
    pub(crate) fn start(&self, arguments: &[&str]) -> Running<'_> {
        self.start_command(self.command(arguments))
    }

    /// Starts a prepared command.
    pub(crate) fn start_command(&self, mut command: Command) -> Running<'_> {
        let mut child = command.spawn().unwrap();
        let (mut out, mut err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
        let pipes =
            (std::thread::spawn(move || read_all(&mut out)), std::thread::spawn(move || read_all(&mut err)));
        Running { ground: self, child, pipes: Some(pipes) }
    }

    /// Runs the command to its end.
    pub(crate) fn run(&self, arguments: &[&str]) -> Said {
        self.start(arguments).wait()
    }

    /// Runs the command, which must succeed, and parses its one JSON object.
    pub(crate) fn json(&self, arguments: &[&str]) -> Value {
        let said = self.run(arguments);
        assert!(said.status.success(), "{arguments:?}: {said:?}");
        serde_json::from_str(&said.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {said:?}"))
    }

    /// All processes that were started from this ground, however: (process id, command line).
    pub(crate) fn processes(&self) -> Vec<(i32, String)> {
        let mark = format!("PHOTONSTREAM_RUNTIME_DIR={}", self.runtime().display());
        let entries = fs::read_dir("/proc").unwrap().flatten();
        let of_this = entries.filter_map(|entry| {
            let pid = entry.file_name().to_str()?.parse().ok()?;
            let environment = fs::read(entry.path().join("environ")).ok()?;
            if !environment.split(|&b| b == 0).any(|variable| variable == mark.as_bytes()) {
                return None;
            }
            let line = fs::read(entry.path().join("cmdline")).ok()?;
            let line = String::from_utf8_lossy(&line).replace('\0', " ");
            // A process that has ended and was not waited for yet has no command line.
            (!line.is_empty()).then_some((pid, line))
        });
        of_this.collect()
    }

    /// Waits for a process with `part` in its command line that is not `other`.
    pub(crate) fn process(&self, part: &str, other: Option<i32>) -> i32 {
        let find =
            || self.processes().into_iter().find(|(pid, line)| line.contains(part) && Some(*pid) != other);
        wait_for(&format!("a process with {part:?}"), || find().map(|(pid, _)| pid))
    }

    /// Waits until no process of this ground is left.
    pub(crate) fn wait_for_silence(&self) {
        let mut left = Vec::new();
        let silent = || {
            left = self.processes();
            left.is_empty().then_some(())
        };
        wait_for("all processes to end", silent);
    }

    /// Name of the shared-memory object of a channel, once there is one.
    pub(crate) fn segment(&self, channel: &str) -> PathBuf {
        let current = self.runtime().join(channel).join("current");
        let name = || {
            let text = fs::read_to_string(&current).ok()?;
            let line = text.lines().find_map(|line| line.strip_prefix("segment = "))?.to_owned();
            Some(Path::new("/dev/shm").join(line.trim_matches('"').trim_start_matches('/')))
        };
        let segment = wait_for("a segment", name);
        assert!(segment.exists(), "{}", segment.display());
        segment
    }
}

impl Running<'_> {
    pub(crate) fn pid(&self) -> i32 {
        self.child.id() as i32
    }

    /// Sends a signal to the command itself.
    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        kill(self.pid(), signal);
    }

    /// Waits for the end of the command.
    pub(crate) fn wait(mut self) -> Said {
        let status = wait_for("the command to end", || self.child.try_wait().unwrap());
        let (out, err) = self.pipes.take().unwrap();
        Said { status, stdout: out.join().unwrap(), stderr: err.join().unwrap() }
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        if self.pipes.is_some() {
            let _ = self.child.kill();
            let _ = self.child.wait();
            for (pid, _) in self.ground.processes() {
                kill(pid, rustix::process::Signal::KILL);
            }
            // A second panic would hide the first one.
            if !std::thread::panicking() {
                self.ground.wait_for_silence();
            }
            // Killed simulators leave their segments.
            let _ = photonstream_protocol::clean_in(&Runtime::at(self.ground.runtime()));
        }
    }
}

impl Said {
    /// Requires this exit code and every one of `parts` on stderr.
    #[track_caller]
    pub(crate) fn expect(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.status.code(), Some(code), "{self:#?}");
        for part in parts {
            assert!(self.stderr.contains(part), "no {part:?} in {self:#?}");
        }
        let told = self.stderr.lines().filter(|line| line.contains("error:")).count();
        assert!(code == 0 || told == 1, "an error is told once: {self:#?}");
        assert!(!self.stderr.contains("panicked") && !self.stderr.contains("stack backtrace"), "{self:#?}");
    }
}

/// Waits for something, with the watchdog watching.
#[track_caller]
pub(crate) fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < WATCHDOG, "watchdog: waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Sends a signal to a process, which may have ended.
pub(crate) fn kill(pid: i32, signal: rustix::process::Signal) {
    let _ = rustix::process::kill_process(rustix::process::Pid::from_raw(pid).unwrap(), signal);
}

/// A file of `configs/`.
pub(crate) fn config(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
    path.canonicalize().unwrap().to_str().unwrap().to_owned()
}

/// Requires an object with exactly these keys.
#[track_caller]
pub(crate) fn has_keys(value: &Value, keys: &[&str]) {
    let found: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    let missing: Vec<_> = keys.iter().filter(|key| !found.contains(key)).collect();
    let extra: Vec<_> = found.iter().filter(|key| !keys.contains(key)).collect();
    assert!(missing.is_empty() && extra.is_empty(), "missing {missing:?}, extra {extra:?}");
}

/// Number of files in a folder whose names end with `end`; none where there is no folder.
pub(crate) fn files(folder: &Path, end: &str) -> usize {
    let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.file_name());
    names.filter(|name| Path::new(name).extension() == Some(OsStr::new(end))).count()
}

fn read_all(pipe: &mut impl Read) -> String {
    let mut bytes = Vec::new();
    // Half of what was said is better than nothing.
    let _ = pipe.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}
