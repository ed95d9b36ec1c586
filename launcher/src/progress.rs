//! Turns long work into progress bars, where standard error is a terminal, and into nothing elsewhere.

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::{io::IsTerminal, sync::OnceLock, time::Duration};

/// All bars of this process: what writes to standard error goes through [`MultiProgress::suspend`].
pub(crate) fn bars() -> &'static MultiProgress {
    static BARS: OnceLock<MultiProgress> = OnceLock::new();
    BARS.get_or_init(|| {
        let target = if std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        MultiProgress::with_draw_target(target)
    })
}

/// A bar of 1000 steps, for shares in [0, 1]; it disappears when it is dropped.
pub(crate) struct Share(ProgressBar);

const STEPS: u64 = 1000;

impl Share {
    pub(crate) fn start(what: &'static str) -> Self {
        let bar = bars().add(ProgressBar::new(STEPS));
        let style = ProgressStyle::with_template("{prefix:>16} [{bar:32}] {percent:>3} % {msg}")
            .expect("invariant: the template is valid");
        bar.set_style(style.progress_chars("=> "));
        bar.set_prefix(what);
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    /// The share that is done, in [0, 1].
    pub(crate) fn set(&self, share: f64) {
        self.0.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// A remark behind the bar.
    pub(crate) fn say(&self, message: String) {
        self.0.set_message(message);
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        bars().remove(&self.0);
    }
}

/// A sign of life with a remark, for work of unknown length; it disappears when it is dropped.
pub(crate) struct Spinner(ProgressBar);

impl Spinner {
    pub(crate) fn start(what: &'static str) -> Self {
        let bar = bars().add(ProgressBar::new_spinner());
        let style = ProgressStyle::with_template("{prefix:>16} {spinner} {msg}")
            .expect("invariant: the template is valid");
        bar.set_style(style);
        bar.set_prefix(what);
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    /// What is being done.
    pub(crate) fn say(&self, message: String) {
        self.0.set_message(message);
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        bars().remove(&self.0);
    }
}
