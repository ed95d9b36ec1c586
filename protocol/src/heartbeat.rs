//! Turns time into a heartbeat in the segment, from a thread of its own that no frame can hold up.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::error::ProtocolError;
use crate::runtime::ChannelDir;
use crate::writer_segment::WriterSegment;

/// Time between beats.
const PERIOD: Duration = Duration::from_millis(100);
/// Beats between two looks at the names.
const BEATS_PER_LOOK: u32 = 10;

struct Watched {
    segment: Mutex<Arc<WriterSegment>>,
    stop: AtomicBool,
    /// The segment's name, or the pointer to it, has been removed by someone else.
    lost: AtomicBool,
}

/// The heartbeat thread.
pub(crate) struct Heartbeat {
    watched: Arc<Watched>,
    thread: Option<JoinHandle<()>>,
}

impl Heartbeat {
    pub(crate) fn start(segment: Arc<WriterSegment>, dir: ChannelDir) -> Result<Self, ProtocolError> {
        let watched = Arc::new(Watched {
            segment: Mutex::new(segment),
            stop: AtomicBool::new(false),
            lost: AtomicBool::new(false),
        });
        let shared = Arc::clone(&watched);
        let path = dir.path.clone();
        let thread = std::thread::Builder::new()
            .name("heartbeat".to_owned())
            .spawn(move || beat(&shared, &dir))
            .map_err(|error| ProtocolError::io("start the heartbeat thread of", path, error))?;
        Ok(Self { watched, thread: Some(thread) })
    }

    /// Beats into another segment from now on.
    pub(crate) fn follow(&self, segment: Arc<WriterSegment>) {
        *self.watched.segment.lock().unwrap_or_else(PoisonError::into_inner) = segment;
        self.watched.lost.store(false, Ordering::Relaxed);
    }

    /// Whether new readers can no longer find the segment.
    pub(crate) fn name_is_lost(&self) -> bool {
        self.watched.lost.load(Ordering::Relaxed)
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        self.watched.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic of that thread has been printed already.
            let _ = thread.join();
        }
    }
}

fn beat(watched: &Watched, dir: &ChannelDir) {
    for beat in (1..=BEATS_PER_LOOK).cycle() {
        {
            let segment = watched.segment.lock().unwrap_or_else(PoisonError::into_inner);
            segment.beat();
            if beat == BEATS_PER_LOOK {
                let found =
                    segment.is_named() && dir.current().is_ok_and(|current| current.segment == segment.name);
                watched.lost.store(!found, Ordering::Relaxed);
            }
        }
        std::thread::park_timeout(PERIOD);
        if watched.stop.load(Ordering::Relaxed) {
            return;
        }
    }
}
