//! Turns a change of mind into the early end of work that nobody waits for any more.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Whether work that takes long is still wanted; clones are one and the same.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// From now on nobody wants it.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the work may end early. Its result is dropped then, so that no memory hangs on the order of this load.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// `result`, if it is still wanted, hence whole.
    pub(crate) fn or<T>(&self, result: T) -> Option<T> {
        (!self.is_cancelled()).then_some(result)
    }
}
