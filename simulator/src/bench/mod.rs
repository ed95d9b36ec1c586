//! Turns a scene into figures of speed: the whole simulator, its parts, and a yardstick on the same rays in one run.
//!
//! The machine may be busy with other things, so that figures taken minutes apart cannot be compared. Each figure is
//! the best of several rounds, rounds of all parts take turns, and what matters are their ratios.

mod dynamic;
mod exchange;
mod parts;
mod report;

pub use dynamic::{CurvePoint, DynamicOptions, DynamicReport, EventFigures, run as run_dynamic};
pub use exchange::Exchange;
pub use parts::Parts;
pub use report::{BenchReport, Throughput};

use crate::{error::SimulatorError, service, simulation::Simulation};
use photonstream_scene::{Method, Scene};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// How thorough a benchmark is.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Paths of one round of the parts.
    pub paths: u32,
    /// Rounds; the best of each part counts.
    pub rounds: u32,
    /// Time for which the whole simulator runs, for each number of threads and round.
    pub whole: Duration,
}

impl Default for BenchOptions {
    fn default() -> Self {
        Self { paths: 1 << 16, rounds: 5, whole: Duration::from_millis(700) }
    }
}

/// Measures `scene`; `progress` hears what is being measured.
///
/// # Errors
/// If the scene sends no rays, or shared memory fails.
pub fn run(
    scene: Arc<Scene>,
    options: &BenchOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<BenchReport, SimulatorError> {
    progress("placing virtual surface lights");
    let begun = Instant::now();
    let simulation = Simulation::new(with_still_lights(&scene));
    let placement_s = begun.elapsed().as_secs_f64();
    progress("recording rays");
    let recording = parts::Recording::new(&simulation, options.paths)?;
    let all_threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut parts = Parts::default();
    let mut one = Throughput { threads: 1, ..Throughput::default() };
    let mut all = Throughput { threads: all_threads, ..Throughput::default() };
    for round in 1..=options.rounds {
        progress(&format!("round {round} of {}", options.rounds));
        parts.keep_best(recording.measure(&simulation));
        one.keep_best(stream(&simulation, 1, options.whole)?);
        if all_threads > 1 {
            all.keep_best(stream(&simulation, all_threads, options.whole)?);
        } else {
            all = one;
        }
    }
    progress("publishing and reading");
    let ledger = simulation.fill();
    let exchange = Exchange::measure(&simulation, &ledger)?;
    Ok(BenchReport::new(&simulation, placement_s, one, all, &parts, exchange))
}

/// The scene lit by photons, with virtual surface lights that stay where they are placed: measured is light that changes, not lights that move.
fn with_still_lights(scene: &Scene) -> Arc<Scene> {
    let mut scene = Scene::clone(scene);
    (scene.streaming.adaptive, scene.streaming.method) = (false, Method::PhotonStreaming);
    Arc::new(scene)
}

/// Runs the whole service, fresh samples without end, for a while and returns its rates.
fn stream(simulation: &Simulation, threads: usize, time: Duration) -> Result<Throughput, SimulatorError> {
    let mut scene = Scene::clone(&simulation.scene);
    scene.streaming.sampling = photonstream_scene::Sampling::Fresh;
    let simulation = Simulation { scene: Arc::new(scene), ..simulation.clone() };
    let options = service::Options {
        channel: exchange::channel("stream")?,
        threads: Some(threads),
        after_paths: None,
        has_no_fade: false,
        leaves_channel: false,
        config: None,
    };
    let (stop, stopped) = flume::bounded(1);
    let timer = service::spawn("timer", move || {
        std::thread::sleep(time);
        // The service may have failed and gone already.
        let _ = stop.send(());
    })?;
    let summary = service::run(simulation, &options, &stopped)?;
    photonstream_protocol::clean_one(&options.channel)?;
    // It only sleeps and sends.
    let _ = timer.join();
    let rate = |events: u64| events as f64 / summary.seconds;
    Ok(Throughput {
        threads,
        paths_per_s: rate(summary.counters.paths),
        rays_per_s: rate(summary.counters.rays),
        deposits_per_s: rate(summary.counters.deposits),
    })
}
