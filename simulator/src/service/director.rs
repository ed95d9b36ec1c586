//! Turns requests and signals into what the actors do, from their start to their end.

mod start;

use super::{
    ConfigSource,
    clock::Clock,
    edits::{self, Edits},
    ledger_actor::{Change, ToLedger, Version},
    publisher_actor::Still,
    settings::{self, SettingsError},
    watcher::News,
};
use crate::{counters::Counters, error::SimulatorError, simulation::Simulation};
use photonstream_protocol::{
    ChannelName, ControlServer, Incoming, ProtocolError, Reply, Request, monotonic_ns,
};
use photonstream_scene::Scene;
use serde::Serialize;
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// How a simulation is to run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Where it publishes.
    pub channel: ChannelName,
    /// Tracer threads; `None`: as the scene says, else one per core.
    pub threads: Option<usize>,
    /// Rest after this many paths.
    pub after_paths: Option<u64>,
    /// Where the scene comes from: it is loaded again when it changes there. `None`: it stays.
    pub config: Option<ConfigSource>,
}

/// Why a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The caller's stop channel said so: a signal.
    Stopped,
    /// A client of the control socket asked for it.
    Shutdown,
}

/// What a simulation did.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Why it ended.
    pub ending: Ending,
    /// Seconds it ran.
    pub seconds: f64,
    /// Frames published.
    pub frames: u64,
    /// Events since the start.
    #[serde(flatten)]
    pub counters: Counters,
}

/// Runs a simulation on a channel until `stop` gets a message or is closed, or a client asks for its end.
///
/// # Errors
/// If the channel is taken or shared memory fails, or an actor ends before its time.
pub fn run(
    simulation: Simulation,
    options: &Options,
    stop: &flume::Receiver<()>,
) -> Result<Summary, SimulatorError> {
    let mut director = Director::start(simulation, options)?;
    let ending = director.direct(stop);
    director.end(ending)
}

enum Event {
    Stop,
    Request(Incoming),
    News(News),
    /// The watcher has ended.
    Unwatched,
    /// The light of a version was shown whole.
    Settled(u64),
    /// It is time to look at the animation.
    Tick,
    ActorGone,
}

struct Director {
    scene_name: String,
    /// The newest version.
    simulation: Simulation,
    still: Arc<Still>,
    clock: Clock,
    config: Option<ConfigSource>,
    /// Why the animation stood still last.
    animation_error: String,
    /// Hash of the config that was loaded last.
    loaded_hash: u64,
    news: flume::Receiver<News>,
    /// Ends the watcher when it is dropped.
    watching: Option<(flume::Sender<()>, JoinHandle<()>)>,
    settled: flume::Receiver<u64>,
    /// Versions of the scene after the first.
    versions: u64,
    started: Instant,
    server: ControlServer,
    to_ledger: flume::Sender<ToLedger>,
    latest_frame: Arc<AtomicU64>,
    orderly: Arc<AtomicBool>,
    ledger: JoinHandle<Counters>,
    actor_gone: flume::Receiver<()>,
    publisher: JoinHandle<Result<(), ProtocolError>>,
    tracers: Vec<JoinHandle<()>>,
}

impl Director {
    /// Until it is time to end; `None` if an actor ended before.
    fn direct(&mut self, stop: &flume::Receiver<()>) -> Option<Ending> {
        loop {
            let selector = flume::Selector::new()
                .recv(stop, |_| Event::Stop)
                .recv(self.server.requests(), |request| request.map_or(Event::ActorGone, Event::Request))
                .recv(&self.actor_gone, |_| Event::ActorGone)
                .recv(&self.settled, |settled| settled.map_or(Event::ActorGone, Event::Settled));
            // A watcher that is not there has nothing to tell.
            let selector = match &self.watching {
                Some(_) => selector.recv(&self.news, |news| news.map_or(Event::Unwatched, Event::News)),
                None => selector,
            };
            let is_animated = !self.simulation.scene.animation.is_empty();
            let event = match self.clock.next().filter(|_| is_animated) {
                Some(due) => selector.wait_deadline(due).unwrap_or(Event::Tick),
                None => selector.wait(),
            };
            match event {
                Event::Stop => return Some(Ending::Stopped),
                // An actor ended before its time; `end` finds out which, and why.
                Event::ActorGone => return None,
                Event::Settled(version) if version == self.versions => self.clock.settled(),
                // Of a version that is no longer shown.
                Event::Settled(_) => {}
                Event::Tick => {
                    self.clock.tick(Instant::now());
                    if !self.animate() {
                        // There is nothing to wait for.
                        self.clock.settled();
                    }
                }
                Event::News(news) => self.hear(news),
                Event::Unwatched => {
                    self.watching = None;
                    self.refuse("the watcher of the config has failed, a bug: please report it; changes need --reload");
                }
                Event::Request(incoming) => {
                    let Some(Incoming { request, replier, .. }) = self.edit(incoming) else { continue };
                    let ends = matches!(request, Request::Shutdown);
                    let reply = self.answer(request);
                    replier.reply(reply);
                    if ends {
                        return Some(Ending::Shutdown);
                    }
                }
            }
        }
    }

    fn answer(&mut self, request: Request) -> Reply {
        match request {
            Request::Pause => {
                self.clock.pause(true);
                self.change(Change::Pause)
            }
            Request::Resume => {
                self.clock.pause(false);
                self.change(Change::Resume)
            }
            Request::Step => {
                if self.clock.is_paused() {
                    self.clock.step();
                    self.animate();
                }
                self.change(Change::Step)
            }
            Request::Shutdown => Reply::Ok { frame: self.latest_frame.load(Ordering::Acquire) },
            Request::Query => match self.ask(ToLedger::Query).map(serde_json::to_value) {
                Some(Ok(state)) => Reply::State { state },
                Some(Err(error)) => Reply::error("internal", error.to_string()),
                None => Self::busy(),
            },
            Request::Reload => self.reload(),
            Request::SetStreaming { values } => {
                match settings::with_settings(&self.simulation.scene, &values) {
                    Ok(scene) => {
                        self.clock.set(scene.streaming.fixed_step_ms, publish_period(&scene));
                        self.show(scene, monotonic_ns())
                    }
                    Err(SettingsError::Value(error)) => Reply::error(edits::code(&error), error.to_string()),
                    Err(error @ SettingsError::Threads) => Reply::error("invalid-value", error.to_string()),
                    Err(error) => Reply::error("unknown-key", error.to_string()),
                }
            }
            Request::Hello { .. }
            | Request::SetLight { .. }
            | Request::MoveObject { .. }
            | Request::SetMaterial { .. } => {
                Reply::error("internal", "the request should have been answered before")
            }
        }
    }

    /// Loads the config again, whether it has changed or not.
    fn reload(&mut self) -> Reply {
        let Some(config) = &mut self.config else {
            return Reply::error("unsupported", "this simulation was not started from a config file");
        };
        match config.load() {
            Ok(scene) => self.show_config(scene),
            // Whoever asked is told; the watcher tells all others, as long as it is so.
            Err(error) => Reply::error(edits::code(&error), error.to_string()),
        }
    }

    /// Follows what the watcher has seen.
    fn hear(&mut self, news: News) {
        match news {
            // As loaded it is what is simulated already: edits since then stay.
            News::Scene(scene) if scene.hash == self.loaded_hash => {
                if !self.still.notice.is_empty() {
                    tracing::info!("the config is again what is simulated");
                    self.tell_all("");
                }
            }
            News::Scene(scene) => {
                tracing::info!("the config has changed: it is simulated from now on");
                self.show_config(*scene);
            }
            News::Broken(reason) => self.refuse(&reason),
        }
    }

    /// Goes on with the scene of another config, at the time that it is.
    fn show_config(&mut self, scene: Scene) -> Reply {
        let received_ns = monotonic_ns();
        for notice in &scene.notices {
            tracing::warn!("{}: {notice}", scene.name);
        }
        self.loaded_hash = scene.hash;
        self.clock.set(scene.streaming.fixed_step_ms, publish_period(&scene));
        let scene = self.at_present(&scene).unwrap_or(scene);
        let mut still = self.still.next(&scene);
        still.config_generation += 1;
        still.notice = Arc::from("");
        self.show_as(scene, still, received_ns)
    }

    /// Keeps what is simulated, and says everywhere why.
    fn refuse(&mut self, reason: &str) {
        tracing::warn!("the changed config is not shown, the last valid one stays: {reason}");
        self.tell_all(reason);
    }

    fn tell_all(&mut self, notice: &str) {
        if *self.still.notice == *notice {
            return;
        }
        let mut still = self.still.next(&self.simulation.scene);
        still.notice = Arc::from(notice);
        let scene = Scene::clone(&self.simulation.scene);
        self.show_as(scene, still, monotonic_ns());
    }

    /// The scene at the time that it is; `None` where nothing in it is animated.
    fn at_present(&mut self, scene: &Scene) -> Option<Scene> {
        if scene.animation.is_empty() {
            return None;
        }
        let mut edit = scene.edit();
        match scene.animation.apply(self.clock.time_s(), &mut edit) {
            Ok(()) => Some(edit.finish()),
            Err(error) => {
                let error = error.to_string();
                if self.animation_error != error {
                    tracing::warn!("the animation stands still: {error}");
                    self.animation_error = error;
                }
                None
            }
        }
    }

    /// Puts what is animated where it is now; false where it is there already, or cannot be.
    fn animate(&mut self) -> bool {
        let received_ns = monotonic_ns();
        let before = Arc::clone(&self.simulation.scene);
        let Some(scene) = self.at_present(&before) else { return false };
        let is_still = Arc::ptr_eq(&scene.geometry, &before.geometry) && scene.lights == before.lights;
        if is_still {
            return false;
        }
        self.show(scene, received_ns);
        true
    }

    /// Applies an edit, together with all edits that wait behind it, as one new version of the scene. Returns the request
    /// that follows them, if it is no edit.
    fn edit(&mut self, incoming: Incoming) -> Option<Incoming> {
        let received_ns = monotonic_ns();
        let mut edits = Edits::of(&self.simulation.scene);
        let rest = edits.take(incoming, self.server.requests());
        if let Some((scene, repliers)) = edits.finish() {
            let reply = self.show(scene, received_ns);
            repliers.into_iter().for_each(|replier| replier.reply(reply.clone()));
        }
        rest
    }

    /// Makes `scene` the version that is simulated and shown.
    fn show(&mut self, scene: Scene, received_ns: u64) -> Reply {
        let still = self.still.next(&scene);
        self.show_as(scene, still, received_ns)
    }

    fn show_as(&mut self, scene: Scene, still: Still, received_ns: u64) -> Reply {
        let scene = Arc::new(scene);
        let next = if self.simulation.has_lights_of(&scene) {
            self.simulation.with_scene(scene)
        } else {
            self.simulation.reloaded(scene)
        };
        (self.simulation, self.still) = (next, Arc::new(still));
        self.versions += 1;
        let version = Version {
            simulation: self.simulation.clone(),
            still: Arc::clone(&self.still),
            received_ns,
            time_s: self.clock.time_s(),
            only_whole: self.clock.is_fixed() && !self.simulation.scene.animation.is_empty(),
        };
        match self.ask(|sender| ToLedger::Edit(Box::new(version), sender)) {
            Some(frame) => Reply::Ok { frame },
            None => Self::busy(),
        }
    }

    fn change(&self, change: Change) -> Reply {
        match self.ask(|sender| ToLedger::Change(change, sender)) {
            Some(frame) => Reply::Ok { frame },
            None => Self::busy(),
        }
    }

    /// What the ledger answers; `None` if it does not.
    fn ask<T>(&self, question: impl FnOnce(flume::Sender<T>) -> ToLedger) -> Option<T> {
        let (sender, answer) = flume::bounded(1);
        self.to_ledger.send(question(sender)).ok()?;
        answer.recv_timeout(Duration::from_secs(2)).ok()
    }

    fn busy() -> Reply {
        Reply::error("busy", "the simulation did not answer within 2 s; try again")
    }

    /// Ends all actors and collects what they have to say.
    fn end(self, ending: Option<Ending>) -> Result<Summary, SimulatorError> {
        // Pairs with the publisher's load.
        self.orderly.store(ending.is_some(), Ordering::Release);
        if let Some((stop, watcher)) = self.watching {
            drop((stop, self.news));
            // A watcher that panicked has ended, too.
            let _ = watcher.join();
        }
        // The ledger may be gone already.
        let _ = self.to_ledger.send(ToLedger::Stop);
        let ledger = self.ledger.join();
        drop(self.to_ledger);
        let tracers: Vec<_> = self.tracers.into_iter().map(JoinHandle::join).collect();
        let publisher = self.publisher.join();
        // All have ended before anything is said, so that the channel is free again.
        let stopped = |actor| SimulatorError::ActorStopped { actor };
        tracers.into_iter().collect::<Result<Vec<()>, _>>().map_err(|_| stopped("tracer"))?;
        publisher.map_err(|_| stopped("publisher"))??;
        let counters = ledger.map_err(|_| stopped("ledger"))?;
        let ending = ending.ok_or_else(|| stopped("control server"))?;
        let frames = self.latest_frame.load(Ordering::Acquire);
        Ok(Summary {
            scene: self.scene_name,
            ending,
            seconds: self.started.elapsed().as_secs_f64(),
            frames,
            counters,
        })
    }
}

/// Time between two frames.
fn publish_period(scene: &Scene) -> Duration {
    Duration::from_secs_f32(scene.streaming.publish_period_ms.max(0.1) / 1e3)
}
