//! Turns events into lines on standard error, beside progress bars, and never fails because nobody reads them.

use crate::{cli::Global, error::LauncherError, progress};
use std::io::{IsTerminal, Write};
use tracing_subscriber::{EnvFilter, fmt::MakeWriter};

/// Starts logging as asked for on the command line; `RUST_LOG` overrides that.
pub(crate) fn start(global: &Global) {
    // Targets match by their beginning: `photonstream` stands for all crates of the workspace.
    let default = match i16::from(global.verbose) - i16::from(global.quiet) {
        ..=-2 => "error",
        -1 => "warn,winit=error",
        // winit complains of displays without a size, which is no business of the user's.
        0 => "warn,photonstream=info,winit=error",
        1 => "info,photonstream=debug,winit=error",
        _ => "debug,photonstream=trace",
    };
    let filter = match std::env::var("RUST_LOG") {
        Ok(text) if !text.is_empty() => EnvFilter::new(text),
        _ => EnvFilter::new(default),
    };
    let lines = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(Beside)
        .with_ansi(colours())
        .with_target(global.verbose > 0)
        .without_time();
    // Only a second start could fail, and there is none.
    let _ = lines.try_init();
}

/// Whether standard error takes colours.
fn colours() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Writes the error that ends this process, once.
pub(crate) fn report(error: &LauncherError) {
    let start = if colours() { "\x1b[1;31merror:\x1b[0m" } else { "error:" };
    raw(&format!("{start} {error}"));
}

/// Writes a line as it is. What happens to it is no matter: whoever read it may be gone.
pub(crate) fn raw(line: &str) {
    progress::bars().suspend(|| {
        let _ = writeln!(std::io::stderr().lock(), "{line}");
    });
}

/// Standard error beside progress bars, without errors.
#[derive(Clone, Copy, Debug)]
struct Beside;

impl<'a> MakeWriter<'a> for Beside {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        *self
    }
}

impl Write for Beside {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // A launcher that was killed no longer reads its children's logs; they still have to end in order.
        progress::bars().suspend(|| {
            let _ = std::io::stderr().lock().write_all(bytes);
        });
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
