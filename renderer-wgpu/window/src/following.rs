//! Turns a channel into the newest frame with its scene, from a thread that wakes the window only for news.

use crate::{WindowError, standing::Standing};
use photonstream_protocol::{
    AccessMode, ChannelName, LightRecord, Liveness, ObjectRecord, ProtocolError, Reading, Subscriber,
    VslFrame,
};
use photonstream_renderer::{RenderError, published::PublishedScene};
use photonstream_scene::Scene;
use std::{
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

/// Longest sleep of the thread before it looks whether it shall end.
const LOOK: Duration = Duration::from_millis(50);
/// Time between two attempts to load a scene that cannot be loaded.
const TRY_AGAIN: Duration = Duration::from_millis(200);

/// A published frame and the scene it was computed for.
#[derive(Clone, Debug)]
pub(crate) struct Published {
    /// The frame.
    pub(crate) frame: Arc<VslFrame>,
    /// Its scene; the same one for as long as nothing in it has changed.
    pub(crate) scene: Arc<Scene>,
    /// Where things stand in the coordinates of the config.
    pub(crate) standing: Arc<Standing>,
}

/// What is known of the simulator.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub(crate) enum Connection {
    /// There is no channel yet.
    #[default]
    Waiting,
    /// There is one.
    Attached(Liveness),
}

/// What has happened since the last look.
#[derive(Debug, Default)]
pub(crate) struct News {
    /// A newer frame.
    pub(crate) published: Option<Published>,
    /// What is known of the simulator.
    pub(crate) connection: Connection,
    /// What is wrong with the channel or its scene now, if anything.
    pub(crate) problem: Option<String>,
    /// Why nothing will ever come.
    pub(crate) fatal: Option<ProtocolError>,
    /// Somebody asked the program to end.
    pub(crate) is_cancelled: bool,
}

#[derive(Debug, Default)]
struct Shared {
    news: Mutex<News>,
    taken: Condvar,
    stop: AtomicBool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Follows a channel.
#[derive(Debug)]
pub(crate) struct Following {
    shared: Arc<Shared>,
}

impl Following {
    /// Starts to follow `channel`, also before there is one; `wake` is called after each piece of news, and once
    /// `cancelled` is set.
    ///
    /// # Errors
    /// [`WindowError::Thread`].
    pub(crate) fn start(
        channel: ChannelName,
        cancelled: Arc<AtomicBool>,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, WindowError> {
        let shared = Arc::new(Shared::default());
        let follower = Follower {
            shared: Arc::clone(&shared),
            cancelled,
            wake,
            scene: PublishedScene::default(),
            known: None,
            refused: None,
        };
        std::thread::Builder::new()
            .name("following".into())
            .spawn(move || follower.run(&channel))
            .map_err(|e| WindowError::Thread { reason: e.to_string() })?;
        Ok(Self { shared })
    }

    /// Why there will be no more news: somebody asked to stop, or the channel cannot be read; `None` as long as there may.
    pub(crate) fn ended(&self) -> Option<Result<(), ProtocolError>> {
        let mut news = self.shared.lock();
        match news.fatal.take() {
            Some(error) => Some(Err(error)),
            None => news.is_cancelled.then_some(Ok(())),
        }
    }

    /// What is new; frames that were published in between are skipped.
    pub(crate) fn take(&self) -> News {
        let mut news = self.shared.lock();
        let taken = News {
            published: news.published.take(),
            connection: news.connection.clone(),
            problem: news.problem.clone(),
            ..News::default()
        };
        drop(news);
        self.shared.taken.notify_one();
        taken
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.taken.notify_one();
    }
}

/// The scene of the last frame, and what it was made of.
struct Known {
    text: Arc<str>,
    /// Of the text and its assets.
    hash: u64,
    lights: Vec<LightRecord>,
    objects: Vec<ObjectRecord>,
    scene: Arc<Scene>,
    standing: Arc<Standing>,
}

struct Follower<W> {
    shared: Arc<Shared>,
    cancelled: Arc<AtomicBool>,
    wake: W,
    scene: PublishedScene,
    known: Option<Known>,
    /// When the scene of the newest frame could not be had.
    refused: Option<Instant>,
}

impl<W: Fn()> Follower<W> {
    fn run(mut self, channel: &ChannelName) {
        let stop = || self.shared.stop.load(Ordering::Relaxed) || self.cancelled.load(Ordering::Relaxed);
        let forever = Duration::from_secs(10 * 365 * 24 * 3600);
        match Subscriber::attach_wait(channel, AccessMode::Mapped, forever, &stop) {
            Ok(mut subscriber) => self.follow(&mut subscriber),
            Err(ProtocolError::Cancelled { .. }) => {}
            Err(error) => self.shared.lock().fatal = Some(error),
        }
        self.shared.lock().is_cancelled = self.cancelled.load(Ordering::Relaxed);
        (self.wake)();
    }

    fn follow(&mut self, subscriber: &mut Subscriber) {
        while !self.shared.stop.load(Ordering::Relaxed) && !self.cancelled.load(Ordering::Relaxed) {
            // Asked before reading: what was published before the end is then read.
            let connection = Connection::Attached(rounded(subscriber.liveness()));
            let news = self.shared.lock();
            let is_full = news.published.is_some();
            if is_full {
                // The window has not taken the last frame: the next one it gets is the newest by then.
                drop(self.shared.taken.wait_timeout(news, LOOK).unwrap_or_else(PoisonError::into_inner));
            } else {
                drop(news);
            }
            let outcome = if is_full { Ok(None) } else { self.read(subscriber) };
            let mut news = self.shared.lock();
            let before = (news.connection.clone(), news.problem.clone());
            news.connection = connection;
            let is_new = matches!(outcome, Ok(Some(_)));
            match outcome {
                Ok(Some(published)) => (news.published, news.problem) = (Some(published), None),
                Ok(None) => {}
                Err(error) => news.problem = Some(error.to_string()),
            }
            let is_news = is_new || before != (news.connection.clone(), news.problem.clone());
            drop(news);
            if is_news {
                (self.wake)();
            }
            subscriber.wait(LOOK);
        }
    }

    fn read(&mut self, subscriber: &mut Subscriber) -> Result<Option<Published>, RenderError> {
        let is_new = subscriber.read()? == Reading::New;
        // A file that could not be loaded may be whole by now, also where no other frame comes.
        let is_due = self.refused.map_or(is_new, |refused| refused.elapsed() >= TRY_AGAIN);
        let Some(frame) = subscriber.frame().filter(|_| is_due) else { return Ok(None) };
        let is_of = |known: &Known| known.text == frame.scene_text && known.hash == frame.scene_hash;
        let is_known = self.known.as_ref().is_some_and(|known| {
            is_of(known) && known.lights == frame.lights && known.objects == frame.objects
        });
        if !is_known {
            let scene = self.scene.update(frame).inspect_err(|_| self.refused = Some(Instant::now()));
            let scene = Arc::new(scene?.clone());
            let standing = match self.known.take().filter(is_of) {
                Some(known) => known.standing,
                None => Arc::new(
                    Scene::from_resolved(&frame.scene_text)
                        .map(|at_rest| Standing::of(&at_rest))
                        .unwrap_or_default(),
                ),
            };
            self.known = Some(Known {
                text: Arc::clone(&frame.scene_text),
                hash: frame.scene_hash,
                lights: frame.lights.clone(),
                objects: frame.objects.clone(),
                scene,
                standing,
            });
        }
        self.refused = None;
        let known = self.known.as_ref().expect("invariant: set above");
        let (scene, standing) = (Arc::clone(&known.scene), Arc::clone(&known.standing));
        Ok(Some(Published { frame: Arc::new(frame.clone()), scene, standing }))
    }
}

/// Ages in whole seconds: the window is not woken for less.
fn rounded(liveness: Liveness) -> Liveness {
    match liveness {
        Liveness::Stalled { age } => Liveness::Stalled { age: Duration::from_secs(age.as_secs()) },
        Liveness::Gone { .. } => Liveness::Gone { reason: String::new() },
        other => other,
    }
}

#[cfg(test)]
mod tests;
