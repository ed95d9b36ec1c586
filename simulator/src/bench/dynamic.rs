//! Turns changes of a running simulation into how long their light takes, how many rays, and with what error.
//!
//! t95 is the time from a change's arrival at the simulator until the published flux of all lights has gone 95 % of the
//! way to that of the converged scene, and stays there; distances are Euclidean in W. It holds tracing, publishing, and
//! the wait for the next frame. Changes go to and fro; figures are medians.

mod changes;

use self::changes::{changes, moved_object};
use super::exchange;
use crate::{
    change::Change,
    error::SimulatorError,
    ledger::Ledger,
    service,
    simulation::Simulation,
    tracer::{PathBatch, Wave},
};
use glam::Vec3;
use photonstream_protocol::{
    AccessMode, ControlClient, ProtocolError, Reading, Reply, Request, Subscriber, VslFrame,
};
use photonstream_scene::{Method, Scene};
use serde::Serialize;
use std::{
    fmt,
    sync::Arc,
    time::{Duration, Instant},
};

/// How thorough it is.
#[derive(Clone, Debug)]
pub struct DynamicOptions {
    /// Changes of each kind; odd.
    pub rounds: usize,
    /// Sizes of pools for the curve of time against noise.
    pub pools: Vec<u32>,
    /// The time that a change may take with an adaptive pool, ms.
    pub latency_ms: f64,
}

impl Default for DynamicOptions {
    fn default() -> Self {
        Self { rounds: 5, pools: (12..=20).step_by(2).map(|n| 1 << n).collect(), latency_ms: 33.0 }
    }
}

/// What one kind of change takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventFigures {
    /// What was changed.
    pub event: String,
    /// From its arrival to the publication of the first frame of it that a reader saw, ms; the reader shares the cores
    /// with the tracers.
    pub first_frame_ms: f64,
    /// To 95 % of the way to the converged light, ms.
    pub t95_ms: f64,
    /// To the frame with nothing of the old light in it, ms.
    pub whole_ms: f64,
    /// Rays traced for it, over those of a whole pool.
    pub rays_share: f64,
    /// Frames published a second on the way; 0 where one frame was all.
    pub frames_per_s: f64,
}

/// One point of the curve of time against noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Slots of the pool.
    pub pool_paths: u32,
    /// The time that a change may take, ms; 0: the pool keeps its size.
    pub latency_target_ms: f64,
    /// Relative standard error of the converged light, weighted by flux.
    pub relative_error: f64,
    /// The same of the frame that first showed nothing of the old light.
    pub whole_relative_error: f64,
    /// What the moved object takes.
    #[serde(flatten)]
    pub figures: EventFigures,
}

/// What `photonstream bench --dynamic` reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DynamicReport {
    /// Name of the scene.
    pub scene: String,
    /// Slots of its pool.
    pub pool_paths: u32,
    /// Virtual surface lights.
    pub vsls: usize,
    /// Tracer threads.
    pub threads: usize,
    /// Changes of one kind each.
    pub events: Vec<EventFigures>,
    /// Time to see whether a path met a moved object, over the time to trace it, one thread.
    pub check_over_trace: f64,
    /// The moved object with pools of other sizes.
    pub curve: Vec<CurvePoint>,
}

/// Measures changes of `scene`, whose animations stand still; `progress` hears what is being measured.
///
/// # Errors
/// If the scene sends no rays, or shared memory fails.
pub fn run(
    scene: &Scene,
    options: &DynamicOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<DynamicReport, SimulatorError> {
    let mut scene = scene.clone();
    scene.animation = Arc::default();
    (scene.streaming.adaptive, scene.streaming.method) = (false, Method::PhotonStreaming);
    let simulation = Simulation::new(Arc::new(scene));
    let rays = simulation.fill().counters().rays;
    if rays == 0 {
        return Err(SimulatorError::NothingToMeasure);
    }
    let mut events = Vec::new();
    for (event, requests) in changes(&simulation.scene) {
        progress(&event);
        events.push(Follower::start(&simulation)?.follow(&event, &requests, options.rounds, rays)?.0);
    }
    progress("checking paths");
    let check_over_trace = check_over_trace(&simulation);
    let mut curve = Vec::new();
    if let Some((event, requests)) = moved_object(&simulation.scene) {
        for &pool in &options.pools {
            for latency_ms in [0.0, options.latency_ms] {
                progress(&format!("{event}, {pool} paths, latency {latency_ms} ms"));
                curve.push(curve_point(&simulation, (pool, latency_ms), &event, &requests, options.rounds)?);
            }
        }
    }
    Ok(DynamicReport {
        scene: simulation.scene.name.clone(),
        pool_paths: simulation.emitters.slots,
        vsls: simulation.placement.vsls.len(),
        threads: threads(),
        events,
        check_over_trace,
        curve,
    })
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn curve_point(
    simulation: &Simulation,
    (pool, latency_ms): (u32, f64),
    event: &str,
    requests: &[Request; 2],
    rounds: usize,
) -> Result<CurvePoint, SimulatorError> {
    let mut scene = Scene::clone(&simulation.scene);
    (scene.streaming.pool_paths, scene.streaming.latency_ms) = (pool, latency_ms);
    let simulation = Simulation::new(Arc::new(scene));
    let rays = simulation.fill().counters().rays;
    let (figures, errors) = Follower::start(&simulation)?.follow(event, requests, rounds, rays)?;
    Ok(CurvePoint {
        pool_paths: pool,
        latency_target_ms: latency_ms,
        relative_error: errors[1],
        whole_relative_error: errors[0],
        figures,
    })
}

/// Time to see whether each path of the pool met a moved object, over the time to trace it.
fn check_over_trace(simulation: &Simulation) -> f64 {
    let Some((_, [Request::MoveObject { name, values }, _])) = moved_object(&simulation.scene) else {
        return 0.0;
    };
    let mut edit = simulation.scene.edit();
    if edit.move_object(&name, &values).is_err() {
        return 0.0;
    }
    let moved = simulation.with_scene(Arc::new(edit.finish()));
    let change = Change::between(simulation, &moved);
    let ledger: Ledger = simulation.fill();
    // Paths are traced on one thread, too.
    let Ok(alone) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { return 0.0 };
    let (mut check, mut trace) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..5 {
        let begun = Instant::now();
        let count = || {
            let concerned = change.look_through(ledger.pool());
            let lights = simulation.emitters.lights.iter();
            let slots = lights.flat_map(|l| l.slots.clone().map(|slot| (l.light.0 as usize, slot)));
            slots.filter(|&(light, slot)| concerned.contains(light, slot)).count()
        };
        std::hint::black_box(alone.install(count));
        check = check.min(begun.elapsed().as_secs_f64());
        let (mut again, mut wave, mut batch) = (simulation.ledger(), Wave::default(), PathBatch::default());
        let begun = Instant::now();
        while let Some(task) = again.next_task() {
            simulation.tracer.trace(&task.draws, &mut wave, &mut batch);
            std::hint::black_box(&batch);
        }
        trace = trace.min(begun.elapsed().as_secs_f64());
    }
    check / trace
}

/// A running simulation that is changed and looked at.
struct Follower {
    service: std::thread::JoinHandle<Result<service::Summary, SimulatorError>>,
    stop: flume::Sender<()>,
    channel: photonstream_protocol::ChannelName,
    subscriber: Subscriber,
    client: ControlClient,
}

const PATIENCE: Duration = Duration::from_secs(120);
/// Rest before each change: longer than the time between frames.
const BETWEEN: Duration = Duration::from_millis(60);

impl Follower {
    fn start(simulation: &Simulation) -> Result<Self, SimulatorError> {
        let channel = exchange::channel("dynamic")?;
        let options = service::Options {
            channel: channel.clone(),
            threads: Some(threads()),
            after_paths: None,
            has_no_fade: false,
            leaves_channel: false,
            config: None,
        };
        let (stop, stopped) = flume::bounded(1);
        let simulation = simulation.clone();
        let service = service::spawn("service", move || service::run(simulation, &options, &stopped))?;
        let subscriber = Subscriber::attach_wait(&channel, AccessMode::Mapped, PATIENCE, &|| false)?;
        let deadline = Instant::now() + PATIENCE;
        let client = loop {
            match ControlClient::connect(&channel) {
                Ok(client) => break client,
                // The socket follows the segment.
                Err(error) if Instant::now() > deadline => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        Ok(Self { service, stop, channel, subscriber, client })
    }

    /// Figures of changes to and fro, and the errors of the first whole frame and of the converged one.
    fn follow(
        self,
        event: &str,
        requests: &[Request; 2],
        rounds: usize,
        pool_rays: u64,
    ) -> Result<(EventFigures, [f64; 2]), SimulatorError> {
        let Self { service, stop, channel, mut subscriber, mut client } = self;
        let mut before = frames_until(&mut subscriber, |frame| frame.statistics.converged == 1)?.pop();
        let mut all: Vec<[f64; 7]> = Vec::new();
        for round in 0..rounds {
            // The wait for a frame after the last one is not that of this change.
            std::thread::sleep(BETWEEN);
            let arrived = before.as_ref().map_or(0, |frame| frame.statistics.edit_received_ns);
            let is_new = |frame: &VslFrame| frame.statistics.edit_received_ns > arrived;
            // Frames are looked for while the request is still under way: the first may come before the reply.
            let (frames, reply) = std::thread::scope(|scope| {
                let looking = scope.spawn(|| {
                    frames_until(&mut subscriber, |frame| is_new(frame) && frame.statistics.converged == 1)
                });
                let reply = client.request(&requests[round % 2], PATIENCE);
                (looking.join(), reply)
            });
            let Reply::Ok { .. } = reply? else {
                let message = format!("{event} was refused");
                return Err(ProtocolError::Control { message }.into());
            };
            let frames = frames.map_err(|_| SimulatorError::ActorStopped { actor: "reader" })??;
            let frames: Vec<VslFrame> = frames.into_iter().filter(is_new).collect();
            if let (Some(old), Some(figures)) = (&before, figures(before.as_ref(), &frames)) {
                let last = &frames[frames.len() - 1];
                let traced = last.statistics.rays_total - old.statistics.rays_total;
                let [first, t95, whole, rate, whole_error] = figures;
                let share = traced as f64 / pool_rays as f64;
                all.push([first, t95, whole, rate, share, whole_error, last.statistics.relative_error]);
            }
            before = frames.into_iter().last();
        }
        // It may have ended by itself, and says why.
        let _ = stop.send(());
        drop(subscriber);
        match service.join() {
            Ok(summary) => drop(summary?),
            Err(_) => return Err(SimulatorError::ActorStopped { actor: "service" }),
        }
        photonstream_protocol::clean_one(&channel)?;
        let median = |index: usize| {
            let mut of_all: Vec<f64> = all.iter().map(|round| round[index]).collect();
            of_all.sort_by(f64::total_cmp);
            of_all.get(of_all.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let figures = EventFigures {
            event: event.to_owned(),
            first_frame_ms: median(0),
            t95_ms: median(1),
            whole_ms: median(2),
            frames_per_s: median(3),
            rays_share: median(4),
        };
        Ok((figures, [median(5), median(6)]))
    }
}

/// All frames that were seen until one is `wanted`.
fn frames_until(
    subscriber: &mut Subscriber,
    wanted: impl Fn(&VslFrame) -> bool,
) -> Result<Vec<VslFrame>, SimulatorError> {
    let deadline = Instant::now() + PATIENCE;
    let mut frames = Vec::new();
    loop {
        let is_new = subscriber.read()? == Reading::New;
        if let Some(frame) = subscriber.frame().filter(|_| is_new) {
            frames.push(frame.clone());
        }
        if frames.last().is_some_and(&wanted) {
            return Ok(frames);
        }
        // What was wanted may have been read before.
        if let Some(frame) = subscriber.frame().filter(|frame| wanted(frame)) {
            frames.push(frame.clone());
            return Ok(frames);
        }
        if Instant::now() > deadline {
            let message = format!("no converged light within {} s", PATIENCE.as_secs());
            return Err(ProtocolError::Control { message }.into());
        }
        subscriber.wait(Duration::from_millis(20));
    }
}

/// First frame, t95 and whole light in ms, frames a second, and the error of the first whole frame.
fn figures(before: Option<&VslFrame>, frames: &[VslFrame]) -> Option<[f64; 5]> {
    let (first, last) = (frames.first()?, frames.last()?);
    let arrived = last.statistics.edit_received_ns;
    let ms = |frame: &VslFrame| frame.publish_time_ns.saturating_sub(arrived) as f64 * 1e-6;
    let step = distance(before?, last);
    let far = frames.iter().rposition(|frame| distance(frame, last) > 0.05 * step);
    let t95 = far.map_or(first, |index| frames.get(index + 1).unwrap_or(last));
    let whole = frames.iter().find(|frame| frame.statistics.stale_share == 0.0).unwrap_or(last);
    let seconds = (ms(last) - ms(first)) * 1e-3;
    let rate = if seconds > 0.0 { (last.frame - first.frame) as f64 / seconds } else { 0.0 };
    Some([ms(first), ms(t95), ms(whole), rate, whole.statistics.relative_error])
}

/// Euclidean distance of all lights' flux, W.
fn distance(a: &VslFrame, b: &VslFrame) -> f64 {
    let squares = a
        .vsls
        .iter()
        .zip(&b.vsls)
        .map(|(a, b)| (Vec3::from(a.flux) - Vec3::from(b.flux)).as_dvec3().length_squared());
    squares.sum::<f64>().sqrt()
}

impl fmt::Display for DynamicReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} paths, {} VSLs, {} tracers\n",
            self.scene, self.pool_paths, self.vsls, self.threads
        )?;
        writeln!(f, "| change | first frame ms | t95 ms | whole ms | rays / pool | frames/s |")?;
        writeln!(f, "|---|---|---|---|---|---|")?;
        for event in &self.events {
            let EventFigures { event, first_frame_ms, t95_ms, whole_ms, rays_share, frames_per_s } = event;
            writeln!(
                f,
                "| {event} | {first_frame_ms:.1} | {t95_ms:.1} | {whole_ms:.1} | {rays_share:.3} | {frames_per_s:.0} |"
            )?;
        }
        writeln!(f, "\nchecking a path: {:.2} % of tracing it\n", 100.0 * self.check_over_trace)?;
        if let Some(point) = self.curve.first() {
            writeln!(f, "{}:\n", point.figures.event)?;
        }
        writeln!(f, "| paths | latency target ms | error | t95 ms | whole ms | error then | rays / pool |")?;
        writeln!(f, "|---|---|---|---|---|---|---|")?;
        for point in &self.curve {
            let target = match point.latency_target_ms {
                0.0 => "none".to_owned(),
                ms => format!("{ms:.0}"),
            };
            writeln!(
                f,
                "| {} | {target} | {:.2} % | {:.1} | {:.1} | {:.2} % | {:.3} |",
                point.pool_paths,
                100.0 * point.relative_error,
                point.figures.t95_ms,
                point.figures.whole_ms,
                100.0 * point.whole_relative_error,
                point.figures.rays_share
            )?;
        }
        Ok(())
    }
}
