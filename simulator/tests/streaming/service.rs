//! The service as a whole: actors, shared memory and control socket within one process.
#![allow(clippy::unwrap_used)]

use photonstream_protocol::{
    AccessMode, ChannelName, ControlClient, Liveness, Reading, Reply, Request, Subscriber, VslFrame,
};
use photonstream_simulator::{
    ledger::Ledger,
    service::{self, Ending, Options, Summary},
    simulation::Simulation,
    tracer::Tracer,
};
use std::{sync::Arc, thread::JoinHandle, time::Duration};

pub(crate) struct Service {
    pub(crate) channel: ChannelName,
    stop: flume::Sender<()>,
    thread: JoinHandle<Summary>,
}

pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) fn start(
    name: &str,
    simulation: &Simulation,
    threads: usize,
    after_paths: Option<u64>,
) -> Service {
    start_with(name, simulation, Options { threads: Some(threads), after_paths, ..Options::default() })
}

/// On a channel of its own, whatever `options` say.
pub(crate) fn start_with(name: &str, simulation: &Simulation, options: Options) -> Service {
    let channel: ChannelName = format!("t{}-{name}", std::process::id()).parse().unwrap();
    let (stop, stopped) = flume::bounded(1);
    let options = Options { channel: channel.clone(), ..options };
    let simulation = simulation.clone();
    let thread = std::thread::spawn(move || service::run(simulation, &options, &stopped).unwrap());
    Service { channel, stop, thread }
}

impl Service {
    pub(crate) fn attach(&self) -> Subscriber {
        Subscriber::attach_wait(&self.channel, AccessMode::Mapped, PATIENCE, &|| false).unwrap()
    }

    pub(crate) fn connect(&self) -> ControlClient {
        drop(self.attach());
        // The socket follows the segment.
        let deadline = std::time::Instant::now() + PATIENCE;
        loop {
            match ControlClient::connect(&self.channel) {
                Ok(client) => return client,
                Err(error) => assert!(std::time::Instant::now() < deadline, "{error}"),
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub(crate) fn end(self) -> Summary {
        self.stop.send(()).unwrap();
        let summary = self.thread.join().unwrap();
        photonstream_protocol::clean_one(&self.channel).unwrap();
        summary
    }
}

/// The first frame that shows so many paths and says that the light has converged.
pub(crate) fn after(subscriber: &mut Subscriber, paths: u64) -> VslFrame {
    let deadline = std::time::Instant::now() + PATIENCE;
    while std::time::Instant::now() < deadline {
        let new = subscriber.read().unwrap() == Reading::New;
        let done = |f: &&VslFrame| f.statistics.converged == 1 && f.statistics.paths_total == paths;
        if let Some(frame) = subscriber.frame().filter(|_| new).filter(done) {
            return frame.clone();
        }
        subscriber.wait(Duration::from_millis(50));
    }
    panic!("no converged frame of {paths} paths within {PATIENCE:?}");
}

fn room(sampling: &str) -> Simulation {
    let streaming =
        format!("vsls = 300\npool_paths = 30000\nsampling = \"{sampling}\"\npublish_period_ms = 1");
    Simulation::new(Arc::new(crate::support::closed_box(0.7, 10.0, &streaming)))
}

/// Published flux is that of the pool traced in this process, bit for bit, with 1 and 3 tracers, replayed and fresh.
#[test]
fn frames_hold_the_same_flux_on_any_number_of_threads() {
    for (sampling, paths) in [("replay", None), ("fresh", Some(70_000))] {
        let simulation = room(sampling);
        let mut ledger = simulation.ledger();
        let tasks = paths.map_or(u64::MAX, |_| {
            // As many tasks as hold the paths: the last of each round is short.
            let mut counting = simulation.ledger();
            let more = |ledger: &mut Ledger| {
                simulation.advance(ledger, 1);
                ledger.counters().paths < paths.unwrap()
            };
            1 + std::iter::from_fn(|| more(&mut counting).then_some(())).count() as u64
        });
        simulation.advance(&mut ledger, tasks);
        let expected: Vec<[f32; 3]> = ledger.readings(&simulation.scene).map(|r| r.flux.to_array()).collect();
        for threads in [1, 3] {
            let service = start(&format!("{sampling}{threads}"), &simulation, threads, paths);
            let frame = after(&mut service.attach(), ledger.counters().paths);
            let flux: Vec<[f32; 3]> = frame.vsls.iter().map(|v| v.flux).collect();
            assert!(flux == expected, "{sampling} on {threads} threads");
            assert_eq!(frame.scene_hash, simulation.scene.hash);
            assert_eq!(&*frame.scene_text, &*simulation.scene.resolved_text);
            assert_eq!(frame.lights.len(), 1);
            assert_eq!(frame.statistics.paths_total, ledger.counters().paths);
            let summary = service.end();
            assert_eq!((summary.ending, summary.counters), (Ending::Stopped, ledger.counters()));
        }
    }
}

#[test]
fn the_control_socket_pauses_steps_resumes_tells_and_ends() {
    let service = start("control", &room("fresh"), 2, None);
    let mut client = service.connect();
    let mut ask = |request: &Request| client.request(request, Duration::from_secs(20)).unwrap();
    let paths = |reply: Reply| match reply {
        Reply::State { state } => (state["paths"].as_u64().unwrap(), state["paused"].as_bool().unwrap()),
        other => panic!("{other:?}"),
    };
    assert!(matches!(ask(&Request::Pause), Reply::Ok { .. }));
    // What is in flight still arrives; then the number stands.
    let mut before = paths(ask(&Request::Query));
    loop {
        std::thread::sleep(Duration::from_millis(100));
        let now = paths(ask(&Request::Query));
        if now == before {
            break;
        }
        before = now;
    }
    assert!(before.1);
    assert!(matches!(ask(&Request::Step), Reply::Ok { .. }));
    std::thread::sleep(Duration::from_millis(500));
    let stepped = paths(ask(&Request::Query));
    assert!(stepped.0 > before.0 && stepped.1);
    assert!(matches!(ask(&Request::Resume), Reply::Ok { .. }));
    std::thread::sleep(Duration::from_millis(200));
    assert!(paths(ask(&Request::Query)).0 > stepped.0);
    assert!(matches!(ask(&Request::Reload), Reply::Error { .. }));
    assert!(matches!(ask(&Request::Shutdown), Reply::Ok { .. }));
    assert_eq!(service.thread.join().unwrap().ending, Ending::Shutdown);
    photonstream_protocol::clean_one(&service.channel).unwrap();
}

/// A still scene converges, publishes that, and then does nothing: no frame and no path for a second.
#[test]
fn a_converged_scene_rests() {
    let service = start("rest", &room("replay"), 2, None);
    let mut subscriber = service.attach();
    let frame = after(&mut subscriber, 30_000);
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(subscriber.read().unwrap(), Reading::Unchanged);
    assert_eq!(subscriber.frame().unwrap().statistics.paths_total, frame.statistics.paths_total);
    assert_eq!(frame.statistics.pool_valid, frame.statistics.pool_paths);
    service.end();
}

/// A tracer that panics (its owner table is that of a smaller scene) ends the service with an error that names it,
/// instead of leaving everybody else waiting for its batch.
#[test]
fn a_panic_ends_the_service() {
    let small = room("replay");
    let large = Simulation::new(Arc::new(crate::support::closed_sphere(0.5, 1.0, 0.0, "vsls = 100")));
    let tracer =
        Tracer::new(Arc::clone(&large.scene), Arc::clone(&small.owners), Arc::clone(&large.emitters));
    let broken = Simulation { tracer, ..large };
    let channel: ChannelName = format!("t{}-panic", std::process::id()).parse().unwrap();
    let (_stop, stopped) = flume::bounded(1);
    let options = Options { channel: channel.clone(), threads: Some(2), ..Options::default() };
    let error = service::run(broken, &options, &stopped).unwrap_err();
    assert!(error.to_string().contains("tracer"), "{error}");
    // Left as a crash leaves it: renderers wait for a successor.
    let subscriber = Subscriber::attach(&channel, AccessMode::Mapped);
    assert!(subscriber.is_err() || !matches!(subscriber.unwrap().liveness(), Liveness::Retired));
    photonstream_protocol::clean_one(&channel).unwrap();
}
