//! Turns a long computation into one that can be watched and stopped.

use crate::RenderError;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Who is told of the progress, and who may stop it; the default is nobody.
#[derive(Clone, Copy, Default)]
pub struct Watch<'a> {
    /// Called from any thread with the share that is done, in [0, 1].
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
    /// Set to true to stop; the computation then returns [`RenderError::Cancelled`].
    pub cancelled: Option<&'a AtomicBool>,
}

impl std::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("cancelled", &self.cancelled).finish_non_exhaustive()
    }
}

impl Watch<'_> {
    /// Whether to go on.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`].
    pub fn check(&self) -> Result<(), RenderError> {
        match self.cancelled {
            // A flag alone: no other data hangs on it.
            Some(flag) if flag.load(Ordering::Relaxed) => Err(RenderError::Cancelled),
            _ => Ok(()),
        }
    }

    /// Counts one finished piece of `total`.
    pub fn advance(&self, done: &AtomicUsize, total: usize) {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.progress {
            progress(done as f64 / total.max(1) as f64);
        }
    }

    /// Tells the share that is done, in [0, 1].
    pub fn report(&self, share: f64) {
        if let Some(progress) = self.progress {
            progress(share.clamp(0.0, 1.0));
        }
    }
}
