//! Turns the death of the launcher into an orderly end of the processes it started.
//!
//! A built-in role gets a pipe as standard input and `PHOTONSTREAM_OWNED=1`. The pipe closes when the launcher is gone,
//! however it ended, and the role then ends as if asked to with SIGTERM. A plug-in knows nothing of that: it is started
//! through [`exec_plug_in`], which has the system send it SIGTERM instead (Linux).

use crate::error::LauncherError;
use std::{
    ffi::OsString,
    io::Read,
    os::unix::process::CommandExt,
    process::Command,
    sync::atomic::{AtomicBool, Ordering},
};

/// Environment variable that makes standard input a lifeline.
pub(crate) const OWNED: &str = "PHOTONSTREAM_OWNED";

/// Set once the launcher is seen to be gone.
static LAUNCHER_IS_GONE: AtomicBool = AtomicBool::new(false);

/// Ends this process in order when its launcher is gone, if it has one.
pub(crate) fn end_with_launcher() {
    if std::env::var_os(OWNED).is_none_or(|value| value != "1") {
        return;
    }
    let watch = || {
        let mut ignored = [0; 256];
        let mut stdin = std::io::stdin();
        loop {
            match stdin.read(&mut ignored) {
                Ok(1..) => {}
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                _ => break,
            }
        }
        LAUNCHER_IS_GONE.store(true, Ordering::Release);
        if let Err(error) = signal_hook::low_level::raise(signal_hook::consts::SIGTERM) {
            tracing::error!("the launcher is gone, and ending in order failed ({error}); ending at once");
            std::process::exit(1);
        }
    };
    if let Err(error) = std::thread::Builder::new().name("lifeline".into()).spawn(watch) {
        tracing::warn!("cannot watch the launcher ({error}): this process would outlive it");
    }
}

/// Whether this process was started by a launcher.
pub(crate) fn is_owned() -> bool {
    std::env::var_os(OWNED).is_some_and(|value| value == "1")
}

/// Whether this process was started by a launcher that has ended since.
pub(crate) fn launcher_is_gone() -> bool {
    LAUNCHER_IS_GONE.load(Ordering::Acquire)
}

/// Becomes the program `command`, which the system will end with SIGTERM when the launcher `parent` is gone.
pub(crate) fn exec_plug_in(parent: u32, command: &[OsString]) -> Result<(), LauncherError> {
    let [program, arguments @ ..] = command else {
        return Err(LauncherError::Usage("exec: no program given".into()));
    };
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Signal, set_parent_process_death_signal};
        set_parent_process_death_signal(Some(Signal::TERM))
            .map_err(|error| LauncherError::io("follow the launcher of", program, error.into()))?;
    }
    // The launcher may have gone before that took effect.
    if std::os::unix::process::parent_id() != parent {
        return Err(LauncherError::Interrupted);
    }
    let error = Command::new(program).args(arguments).env_remove(OWNED).exec();
    Err(LauncherError::io("run", program, error))
}
