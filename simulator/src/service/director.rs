//! Turns requests and signals into what the actors do, from their start to their end.

use super::{
    Farewell,
    edits::Edits,
    ledger_actor::{Change, LedgerActor, ToLedger, Version},
    publisher_actor::{PlacedRecords, PublisherActor, RECORD_SETS, Still},
    spawn, tracer_actor,
};
use crate::{counters::Counters, error::SimulatorError, records, simulation::Simulation};
use crossbeam::queue::ArrayQueue;
use photonstream_protocol::{
    ChannelName, ControlServer, Incoming, NOTICE_CAPACITY, ProtocolError, Publisher, Reply, Request,
    SegmentSpec, monotonic_ns,
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
    ActorGone,
}

struct Director {
    scene_name: String,
    /// The newest version.
    simulation: Simulation,
    still: Arc<Still>,
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
    fn start(simulation: Simulation, options: &Options) -> Result<Self, SimulatorError> {
        let scene = Arc::clone(&simulation.scene);
        let threads = options
            .threads
            .or(scene.streaming.threads.map(|t| t as usize))
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
            .max(1);
        let place = records::vsl_records(&scene, &simulation.placement);
        let place = PlacedRecords { records: place, version: 0 };
        let still = Arc::new(Still::new(&scene));
        let spec = SegmentSpec {
            vsl_capacity: place.records.len().max(1) as u32,
            object_capacity: still.objects.len().max(1) as u32,
            light_capacity: still.lights.len().max(1) as u32,
            scene_text_capacity: still.scene_text.len() as u32,
            notice_capacity: NOTICE_CAPACITY,
            scene_hash: scene.hash,
            slots: 3,
        };
        let publisher = Publisher::create(&options.channel, &spec)?;
        let server = ControlServer::start(&publisher)?;

        let (work_sender, work) = flume::bounded(2 * threads + 2);
        let (to_ledger, inbox) = flume::bounded(4 * threads + 16);
        let (snapshot_sender, snapshots) = flume::bounded(1);
        let emptied = Arc::new(ArrayQueue::new(RECORD_SETS));
        for records in std::iter::repeat_n(place, RECORD_SETS) {
            emptied.push(records).expect("invariant: the queue has room for all sets of records");
        }
        let (farewells, actor_gone) = flume::bounded(1);
        let tracers = (0..threads)
            .map(|_| {
                let (work, to_ledger, farewell) =
                    (work.clone(), to_ledger.clone(), Farewell(farewells.clone()));
                spawn("tracer", move || {
                    let _farewell = farewell;
                    tracer_actor::run(&work, &to_ledger);
                })
            })
            .collect::<Result<_, _>>()?;
        let latest_frame = Arc::new(AtomicU64::new(0));
        let orderly = Arc::new(AtomicBool::new(false));
        let actor = PublisherActor {
            publisher,
            snapshots,
            emptied: Arc::clone(&emptied),
            latest_frame: Arc::clone(&latest_frame),
            orderly: Arc::clone(&orderly),
        };
        let publisher = {
            let farewell = Farewell(farewells.clone());
            spawn("publisher", move || {
                let _farewell = farewell;
                actor.run()
            })?
        };
        let actor = LedgerActor {
            simulation: simulation.clone(),
            still: Arc::clone(&still),
            threads,
            inbox,
            work: work_sender,
            snapshots: snapshot_sender,
            emptied,
            after_paths: options.after_paths,
        };
        let ledger = {
            let farewell = Farewell(farewells.clone());
            spawn("ledger", move || {
                let _farewell = farewell;
                actor.run()
            })?
        };
        Ok(Self {
            scene_name: scene.name.clone(),
            simulation,
            still,
            started: Instant::now(),
            server,
            to_ledger,
            latest_frame,
            orderly,
            ledger,
            actor_gone,
            publisher,
            tracers,
        })
    }

    /// Until it is time to end; `None` if an actor ended before.
    fn direct(&mut self, stop: &flume::Receiver<()>) -> Option<Ending> {
        loop {
            let event = flume::Selector::new()
                .recv(stop, |_| Event::Stop)
                .recv(self.server.requests(), |request| request.map_or(Event::ActorGone, Event::Request))
                .recv(&self.actor_gone, |_| Event::ActorGone)
                .wait();
            match event {
                Event::Stop => return Some(Ending::Stopped),
                // An actor ended before its time; `end` finds out which, and why.
                Event::ActorGone => return None,
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

    fn answer(&self, request: Request) -> Reply {
        match request {
            Request::Pause => self.change(Change::Pause),
            Request::Resume => self.change(Change::Resume),
            Request::Step => self.change(Change::Step),
            Request::Shutdown => Reply::Ok { frame: self.latest_frame.load(Ordering::Acquire) },
            Request::Query => match self.ask(ToLedger::Query).map(serde_json::to_value) {
                Some(Ok(state)) => Reply::State { state },
                Some(Err(error)) => Reply::error("internal", error.to_string()),
                None => Self::busy(),
            },
            Request::Reload | Request::SetStreaming { .. } => Reply::error(
                "unsupported",
                "this simulator cannot load another config yet; restart it with the edited one",
            ),
            Request::SetMaterial { .. } => Reply::error(
                "unsupported",
                "this simulator cannot change materials yet; edit the config instead",
            ),
            Request::Hello { .. } | Request::SetLight { .. } | Request::MoveObject { .. } => {
                Reply::error("internal", "the request should have been answered before")
            }
        }
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
        self.still = Arc::new(self.still.next(&scene));
        self.simulation = self.simulation.with_scene(Arc::new(scene));
        let version =
            Version { simulation: self.simulation.clone(), still: Arc::clone(&self.still), received_ns };
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
