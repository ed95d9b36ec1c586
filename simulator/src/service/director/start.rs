//! Turns a simulation into actors that run, joined by channels.

use super::{Director, Loader, Options, saving, scenes};
use crate::{
    error::SimulatorError,
    records,
    service::{
        Farewell,
        ledger_actor::LedgerActor,
        loader,
        placements::Placements,
        placer,
        published_maps::PublishedMaps,
        publisher_actor::{PlacedRecords, PublisherActor, RECORD_SETS, Still},
        spawn, tracer_actor, watcher,
    },
    simulation::Simulation,
};
use crossbeam::queue::ArrayQueue;
use photonstream_protocol::{ControlServer, DISTANCE_TEXELS, Publisher};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64},
    },
    time::Instant,
};

impl Director {
    pub(super) fn start(simulation: Simulation, options: &Options) -> Result<Self, SimulatorError> {
        let scene = Arc::clone(&simulation.scene);
        let threads = options
            .threads
            .or(scene.streaming.threads.map(|t| t as usize))
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
            .max(1);
        let place = records::vsl_records(&scene, &simulation.placement);
        let place = PlacedRecords { records: place, version: 0, placement: 0 };
        let still = Arc::new(Still::new(&scene));
        let edge = scene.streaming.distance_map_px as usize;
        let lights = simulation.published_lights();
        let distances = lights * edge * edge / DISTANCE_TEXELS;
        // Lights that move are shown where they were and where they are, for a while.
        let times = if scene.streaming.adaptive && simulation.is_streaming() { 2 } else { 1 };
        let spec = still.spec(times * lights, times * distances, None);
        let publisher = Publisher::create(&options.channel, &spec)?;
        let server = ControlServer::start(&publisher)?;

        let (work_sender, work) = flume::bounded(2 * threads + 2);
        let (to_ledger, inbox) = flume::bounded(4 * threads + 16);
        let (snapshot_sender, snapshots) = flume::bounded(1);
        let emptied = Arc::new(ArrayQueue::new(RECORD_SETS));
        for records in std::iter::repeat_n(place, RECORD_SETS) {
            emptied.push(records).expect("invariant: the queue has room for all sets of records");
        }
        // At most two messages for each version, which this thread makes.
        let (tell_director, from_ledger) = flume::unbounded();
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
            stays_findable: options.leaves_channel,
            refused: None,
            patches: None,
            maps: PublishedMaps::default(),
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
            has_no_fade: options.has_no_fade,
            only_whole: scene.streaming.fixed_step_ms.is_some() && !scene.animation.is_empty(),
            director: tell_director,
        };
        let ledger = {
            let farewell = Farewell(farewells.clone());
            spawn("ledger", move || {
                let _farewell = farewell;
                actor.run()
            })?
        };
        let (tell, news) = flume::bounded(1);
        let watching = match &options.config {
            Some(source) => {
                let (stop, stopped) = flume::bounded(1);
                Some((stop, watcher::start(source.clone(), &scene, tell, stopped)?))
            }
            None => None,
        };
        let loader = match &options.config {
            Some(source) => {
                // At most one message for each connection, which waits for the answer.
                let (asked, asks) = flume::unbounded();
                let (answer, loaded) = flume::bounded(1);
                let source = source.clone();
                spawn("config loader", move || loader::run(source, &asks, &answer))?;
                Some(Loader { asked, loaded })
            }
            None => None,
        };
        let (to_placer, orders) = flume::bounded(1);
        let (answer, placed) = flume::bounded(1);
        let placer = {
            let farewell = Farewell(farewells);
            spawn("placer", move || {
                let _farewell = farewell;
                placer::run(&orders, &answer);
            })?
        };
        Ok(Self {
            scene_name: scene.name.clone(),
            clock: scenes::clock(&scene),
            animated_s: 0.0,
            config_file: options.config.as_ref().and_then(saving::writable),
            saved: None,
            loaded_hash: scene.hash,
            animation_error: String::new(),
            news,
            watching,
            loader,
            placements: Placements::default(),
            to_placer,
            placed,
            placer,
            from_ledger,
            versions: 0,
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
}
