//! Turns requests and signals into what the actors do, from their start to their end.

mod saving;
mod scenes;
mod start;
#[cfg(test)]
mod tests;

use super::{
    ConfigSource,
    clock::Clock,
    edits,
    ledger_actor::{Change, FromLedger, State, ToLedger},
    loader::Loaded,
    placements::Placements,
    placer::{Order, Placed},
    publisher_actor::Still,
    watcher::News,
};
use crate::{counters::Counters, error::SimulatorError, simulation::Simulation};
use photonstream_protocol::{ChannelName, ControlServer, Incoming, ProtocolError, Replier, Reply, Request};
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
    /// Virtual surface lights that move are shown where they are at once.
    pub has_no_fade: bool,
    /// The channel is left at an orderly end, with its last frame, for the caller to remove.
    pub leaves_channel: bool,
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

impl Summary {
    /// Of a simulation that was stopped before it began.
    pub(crate) fn of_nothing(scene: String, ran: Duration) -> Self {
        let counters = Counters::default();
        Self { scene, ending: Ending::Stopped, seconds: ran.as_secs_f64(), frames: 0, counters }
    }
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
    /// The config was loaded, as somebody asked.
    Loaded(Box<Loaded>),
    /// The loader has ended.
    LoaderGone,
    /// The placer has done what it was told, or what it was told is not wanted any more.
    Placed(Option<Box<Placed>>),
    /// The ledger has something to say.
    Ledger(FromLedger),
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
    /// The instant of the animation that is simulated, s.
    animated_s: f64,
    /// Why the animation stood still last.
    animation_error: String,
    /// The file of the scene, if it is one that can be written.
    config_file: Option<saving::ConfigFile>,
    /// What was saved into it, until the watcher has found it there.
    saved: Option<String>,
    /// Hash of the config that was loaded last.
    loaded_hash: u64,
    news: flume::Receiver<News>,
    /// Ends the watcher when it is dropped.
    watching: Option<(flume::Sender<()>, JoinHandle<()>)>,
    loader: Option<Loader>,
    /// The scenes to come.
    placements: Placements,
    to_placer: flume::Sender<Order>,
    placed: flume::Receiver<Option<Box<Placed>>>,
    placer: JoinHandle<()>,
    from_ledger: flume::Receiver<FromLedger>,
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

/// The way to and from who loads the config.
struct Loader {
    asked: flume::Sender<Replier>,
    loaded: flume::Receiver<Loaded>,
}

/// What a query is answered.
#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    state: State,
    /// Whether another scene is being made ready.
    placing: bool,
}

impl Director {
    /// Until it is time to end; `None` if an actor ended before.
    fn direct(&mut self, stop: &flume::Receiver<()>) -> Option<Ending> {
        loop {
            let event = self.wait(stop);
            match event {
                Event::Stop => return Some(Ending::Stopped),
                // An actor ended before its time; `end` finds out which, and why.
                Event::ActorGone => return None,
                event => {
                    if let Some(ending) = self.handle(event) {
                        return Some(ending);
                    }
                }
            }
        }
    }

    fn wait(&self, stop: &flume::Receiver<()>) -> Event {
        let selector = flume::Selector::new()
            .recv(stop, |_| Event::Stop)
            .recv(self.server.requests(), |request| request.map_or(Event::ActorGone, Event::Request))
            .recv(&self.actor_gone, |_| Event::ActorGone)
            .recv(&self.placed, |placed| placed.map_or(Event::ActorGone, Event::Placed))
            .recv(&self.from_ledger, |told| told.map_or(Event::ActorGone, Event::Ledger));
        // Who is not there has nothing to tell.
        let selector = match &self.watching {
            Some(_) => selector.recv(&self.news, |news| news.map_or(Event::Unwatched, Event::News)),
            None => selector,
        };
        let selector = match &self.loader {
            Some(loader) => selector.recv(&loader.loaded, |loaded| {
                loaded.map_or(Event::LoaderGone, |loaded| Event::Loaded(Box::new(loaded)))
            }),
            None => selector,
        };
        match self.due() {
            Some(due) => selector.wait_deadline(due).unwrap_or(Event::Tick),
            None => selector.wait(),
        }
    }

    /// Follows an event; why it is time to end, if it is.
    fn handle(&mut self, event: Event) -> Option<Ending> {
        match event {
            Event::Stop => return Some(Ending::Stopped),
            Event::ActorGone => return None,
            Event::Ledger(FromLedger::Settled(version)) if version == self.versions => self.clock.settled(),
            // Of a version that is no longer shown.
            Event::Ledger(FromLedger::Settled(_)) => {}
            Event::Ledger(FromLedger::Wants(lights)) => self.move_lights(lights),
            Event::Tick => self.tick(Instant::now()),
            Event::News(news) => self.hear(news),
            Event::Unwatched => {
                self.watching = None;
                self.refuse(
                    "the watcher of the config has failed, a bug: please report it; changes need --reload",
                );
            }
            Event::Loaded(loaded) => {
                let Loaded { scene, replier } = *loaded;
                match scene {
                    Ok(scene) => self.want_config(scene, Some(replier)),
                    // Whoever asked is told; the watcher tells all others, as long as it is so.
                    Err(error) => replier.reply(edits::refusal(&error)),
                }
            }
            Event::LoaderGone => self.loader = None,
            Event::Placed(simulation) => self.take_placed(simulation),
            Event::Request(incoming) => {
                let Incoming { request, replier } = self.edit(incoming)?;
                return self.answer(request, replier);
            }
        }
        None
    }

    /// Answers a request that is no edit, or sees to it that it is answered later; why it is time to end, if it is.
    fn answer(&mut self, request: Request, replier: Replier) -> Option<Ending> {
        let reply = match request {
            Request::Pause => {
                self.clock.pause(true);
                self.change(Change::Pause)
            }
            Request::Resume => {
                self.clock.pause(false);
                self.change(Change::Resume)
            }
            Request::Step => {
                self.step(replier);
                return None;
            }
            Request::Shutdown => {
                replier.reply(Reply::Ok { frame: self.latest_frame.load(Ordering::Acquire) });
                return Some(Ending::Shutdown);
            }
            Request::Query => match self.ask(ToLedger::Query) {
                Some(state) => self.tell(state),
                None => Self::busy(),
            },
            Request::Reload => {
                self.reload(replier);
                return None;
            }
            Request::SaveVpls {} => self.save_vpls(),
            Request::SetStreaming { values } => {
                self.set_streaming(&values, replier);
                return None;
            }
            Request::Hello { .. }
            | Request::SetLight { .. }
            | Request::MoveObject { .. }
            | Request::SetMaterial { .. }
            | Request::SetVpls { .. } => {
                Reply::error("internal", "the request should have been answered before")
            }
        };
        replier.reply(reply);
        None
    }

    fn tell(&self, state: State) -> Reply {
        match serde_json::to_value(Told { state, placing: self.placements.are_awaited() }) {
            Ok(state) => Reply::State { state },
            Err(error) => Reply::error("internal", error.to_string()),
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
        // It has nothing that somebody else needs: a config that takes long to load keeps nobody.
        drop(self.loader);
        self.placements.end();
        drop((self.to_placer, self.placed));
        let placer = self.placer.join();
        // The ledger may be gone already.
        let _ = self.to_ledger.send(ToLedger::Stop);
        let ledger = self.ledger.join();
        drop(self.to_ledger);
        let tracers: Vec<_> = self.tracers.into_iter().map(JoinHandle::join).collect();
        let publisher = self.publisher.join();
        // All have ended before anything is said, so that the channel is free again.
        let stopped = |actor| SimulatorError::ActorStopped { actor };
        tracers.into_iter().collect::<Result<Vec<()>, _>>().map_err(|_| stopped("tracer"))?;
        placer.map_err(|_| stopped("placer"))?;
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
