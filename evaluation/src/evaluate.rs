//! Turns scenes into measured points, splits and step changes, writing results as they come.

use crate::{
    EvaluateError,
    flip::{Exposure, flip},
    machine::Machine,
    methods::{Bench, Shot},
    metrics::compare,
    plan::{self, Effort, Planned},
    point::{Method, Point},
    report::{self, Portrait, SceneSheet},
    results::{Results, Row, Skipped, StepChange},
    split::split,
    truth::{Truth, truth},
};
use photonstream_protocol::clean_one;
use photonstream_renderer::{LayerKind, RenderError, Watch};
use photonstream_scene::{Scene, SceneConfig, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::bench::{DynamicOptions, run_dynamic};
use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

/// What is to be evaluated.
#[derive(Clone, Debug)]
pub struct Options {
    /// Scene files.
    pub configs: Vec<PathBuf>,
    /// Where results go.
    pub out: PathBuf,
    /// Where references are kept.
    pub cache: PathBuf,
    /// How thorough.
    pub effort: Effort,
    /// Size of all pictures; `None`: the scene's proportions, few pixels.
    pub size: Option<(u32, u32)>,
    /// Paths per pixel of references; `None`: by effort.
    pub reference_spp: Option<u64>,
    /// Threads; `None`: one per core.
    pub threads: Option<usize>,
    /// Seed of all samples; `None`: the config's.
    pub seed: Option<u64>,
    /// These points alone, without splits and changes; empty: all.
    pub points: Vec<String>,
}

/// Who is told of the progress, and who may stop it.
#[derive(Clone, Copy)]
pub struct Observer<'a> {
    /// Called with the share that is done, in [0, 1], and what is being done.
    pub progress: &'a (dyn Fn(f64, &str) + Sync),
    /// Set to true to stop.
    pub cancelled: &'a AtomicBool,
}

impl Observer<'_> {
    fn watch(&self) -> Watch<'_> {
        Watch { progress: None, cancelled: Some(self.cancelled) }
    }
}

/// Evaluates scenes; `results.csv`, `results.json` and `index.html` in `options.out` hold all of it.
///
/// After an error, and after a cancelled evaluation, they hold what was measured before, and say so.
///
/// # Errors
/// [`EvaluateError`].
pub fn evaluate(options: &Options, observer: Observer<'_>) -> Result<Results, EvaluateError> {
    std::fs::create_dir_all(&options.out).map_err(|e| EvaluateError::write(&options.out, e))?;
    let begun = Instant::now();
    let mut results = Results::new(Machine::here());
    results.skipped = left_out();
    let mut sheets = Vec::new();
    let mut outcome = Ok(());
    for (index, config) in options.configs.iter().enumerate() {
        let count = options.configs.len() as f64;
        let progress = |share: f64, what: &str| {
            (observer.progress)((index as f64 + share) / count, what);
        };
        let observer = Observer { progress: &progress, ..observer };
        outcome = scene(config, options, observer, &mut results, &mut sheets);
        if outcome.is_err() {
            break;
        }
    }
    results.complete = outcome.is_ok();
    results.seconds = begun.elapsed().as_secs_f64();
    results.write(&options.out)?;
    report::write(&results, &sheets, &options.out)?;
    outcome.map(|()| results)
}

/// What no evaluation has.
fn left_out() -> Vec<Skipped> {
    let skipped = |what: &str, why: &str| Skipped { what: what.into(), why: why.into() };
    vec![
        skipped(
            "path tracing with Open Image Denoise",
            "no binding to the library is built in; the library was installed on none of the machines this was written on",
        ),
        skipped(
            "the GPU renderer",
            "figures here are of processor cores, which every method uses in the same way",
        ),
        skipped("accumulation (splat, tiled)", "a choice of the GPU renderer alone"),
        skipped(
            "HDR-FLIP",
            "FLIP is measured on the tone-mapped picture: the library has the variant for displays alone",
        ),
    ]
}

fn scene(
    config: &Path,
    options: &Options,
    observer: Observer<'_>,
    results: &mut Results,
    sheets: &mut Vec<SceneSheet>,
) -> Result<(), EvaluateError> {
    let mut loaded = SceneConfig::from_file(config)?.build()?;
    // A moving scene is measured as it is loaded.
    loaded.animation = Arc::default();
    loaded.streaming.seed = options.seed.unwrap_or(loaded.streaming.seed);
    let scene = Arc::new(loaded);
    let size = options.size.unwrap_or_else(|| fitted(&scene, options.effort.pixels()));
    let spp = options.reference_spp.unwrap_or(options.effort.reference_spp());
    (observer.progress)(0.0, "reference");
    let reported = |share: f64| (observer.progress)(0.15 * share, "reference");
    let watch = Watch { progress: Some(&reported), cancelled: Some(observer.cancelled) };
    let truth = truth(&scene, size, spp, &options.cache, watch)?;
    sheets.push(SceneSheet::new(&scene, &truth));
    let threads =
        options.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let base = Point::of_scene(&scene, threads);
    let bench = Bench::new(Arc::clone(&scene), size);
    let mut run = Run { config, options, observer, truth: &truth, spp, bench, results };
    run.warm_up(&base)?;
    if !options.points.is_empty() {
        for text in &options.points {
            let point =
                base.parse(text).map_err(|reason| EvaluateError::Point { text: text.clone(), reason })?;
            run.point(&Planned { sweeps: "point".into(), point }, sheets)?;
        }
        return Ok(());
    }
    let planned = plan::plan(&base, options.effort);
    let count = planned.len() as f64;
    for (index, planned) in planned.iter().enumerate() {
        (observer.progress)(0.15 + 0.45 * index as f64 / count, &planned.point.to_string());
        run.point(planned, sheets)?;
    }
    run.path_tracing(&base, sheets)?;
    run.splits(&base)?;
    run.changes(&base)
}

/// The scene's proportions with about `pixels` pixels.
fn fitted(scene: &Scene, pixels: u32) -> (u32, u32) {
    let (width, height) = (f64::from(scene.render.width), f64::from(scene.render.height));
    let scale = (f64::from(pixels) / (width * height)).sqrt();
    let round = |x: f64| (x * scale).round().max(1.0) as u32;
    (round(width), round(height))
}

/// The evaluation of one scene.
struct Run<'a> {
    config: &'a Path,
    options: &'a Options,
    observer: Observer<'a>,
    truth: &'a Truth,
    spp: u64,
    bench: Bench,
    results: &'a mut Results,
}

impl Run<'_> {
    /// Threads, caches and clock rates are up before anything is timed.
    fn warm_up(&mut self, base: &Point) -> Result<(), EvaluateError> {
        let (vsls, pool) = (50, 4096);
        let point = Point { vsls, pool, visibility: Visibility::None, ..base.clone() };
        self.bench.shoot(&point, self.observer.watch()).map(drop)
    }

    /// Measures one point and writes all that is known; what the renderer does not have is left out and named.
    fn point(&mut self, planned: &Planned, sheets: &mut [SceneSheet]) -> Result<Option<f64>, EvaluateError> {
        let point = &planned.point;
        let shot = match self.bench.shoot(point, self.observer.watch()) {
            Ok(shot) => shot,
            Err(EvaluateError::Render(error @ RenderError::Option { option, .. })) => {
                let what = match option {
                    "visibility" => format!("visibility {}", point.visibility.name()),
                    "kernel" => format!("kernel {}", point.kernel.name()),
                    _ => point.to_string(),
                };
                self.skip(what, error.to_string());
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        let row = self.row(planned, &shot)?;
        if let Some(sheet) = sheets.last_mut() {
            sheet.offer(Portrait { row: row.clone(), film: shot.film });
        }
        self.results.rows.push(row);
        self.results.write(&self.options.out)?;
        Ok(Some(shot.times.total_ms()))
    }

    fn skip(&mut self, what: String, why: String) {
        let skipped = Skipped { what, why };
        if !self.results.skipped.contains(&skipped) {
            self.results.skipped.push(skipped);
        }
    }

    fn row(&self, planned: &Planned, shot: &Shot) -> Result<Row, EvaluateError> {
        let (point, scene, truth) = (&planned.point, &self.bench.scene, self.truth);
        let full = compare(&shot.film, &truth.film, LayerKind::Full.name())?.whole;
        // A scene whose light is all direct has nothing to be wrong about.
        let indirect = compare(&shot.film, &truth.film, LayerKind::Indirect.name()).map(|c| c.whole);
        let indirect = indirect.map_or((0.0, 0.0), |e| (e.rel_rmse, e.bias));
        let exposure = Exposure { ev: scene.render.exposure_ev, tone_map: scene.render.tone_map };
        let layer = |film: &photonstream_film::Film| -> Result<Vec<glam::Vec3>, EvaluateError> {
            Ok(film.layer(LayerKind::Full.name())?.pixels.clone())
        };
        let (width, height) = (truth.film.width(), truth.film.height());
        let flip = flip(width, height, &layer(&shot.film)?, &layer(&truth.film)?, exposure);
        let machine = &self.results.machine;
        let is = |key: &str| point.has(key);
        let shadows = match point.method {
            Method::PaperA => Some(Visibility::None),
            _ => is("visibility").then_some(point.visibility),
        };
        let kernel = match point.method {
            Method::PaperA | Method::InstantRadiosity => Some(Kernel::Paper),
            Method::InstantRadiosityBounded => Some(Kernel::Disc),
            _ => is("kernel").then_some(point.kernel),
        };
        Ok(Row {
            sweeps: planned.sweeps.clone(),
            scene: scene.name.clone(),
            scene_hash: format!("{:016x}", scene.hash),
            config: self.config.display().to_string(),
            commit: machine.commit.clone(),
            cpu: machine.cpu.clone(),
            cores: machine.cores,
            threads: point.threads,
            seed: point.seed,
            method: point.method.name().into(),
            vsls: is("vsls").then_some(point.vsls),
            vsls_placed: shot.vsls_placed,
            pool_paths: is("pool").then_some(point.pool),
            kernel: kernel.map(|k| k.name().into()),
            visibility: shadows.map(|v| v.name().into()),
            sampling: is("sampling").then(|| point.sampling.name().into()),
            light_samples: is("light_samples").then_some(point.light_samples),
            spp: is("spp").then_some(point.spp),
            width_px: width,
            height_px: height,
            place_ms: shot.times.place_ms,
            light_ms: shot.times.light_ms,
            picture_ms: shot.times.picture_ms,
            total_ms: shot.times.total_ms(),
            runs: shot.runs,
            rel_rmse: full.rel_rmse,
            rel_rmse_indirect: indirect.0,
            rel_mse: full.rel_mse,
            bias: full.bias,
            bias_indirect: indirect.1,
            worst_1pct: full.worst_1pct,
            flip: flip.mean,
            reference_spp: truth.noise.spp,
            reference_noise: truth.noise.full,
            reference_noise_indirect: truth.noise.indirect,
            at_noise_floor: full.rel_rmse < std::f64::consts::SQRT_2 * truth.noise.full,
            command: self.command(point, (width, height)),
        })
    }

    fn command(&self, point: &Point, (width, height): (u32, u32)) -> String {
        let config = self.config.display().to_string();
        let config = if config.contains([' ', '\'', '"', '$']) {
            format!("'{}'", config.replace('\'', r"'\''"))
        } else {
            config
        };
        format!(
            "photonstream evaluate {config} --out again --size {width}x{height} --spp {} --point {point}",
            self.spp
        )
    }

    /// Path tracing with more and more paths, until the time is over.
    fn path_tracing(&mut self, base: &Point, sheets: &mut [SceneSheet]) -> Result<(), EvaluateError> {
        let mut spp = 2;
        loop {
            let point = Point { method: Method::PathTracing, spp, ..base.clone() };
            (self.observer.progress)(0.6 + 0.02 * (spp as f64).log2().min(10.0), &point.to_string());
            let took = self.point(&Planned { sweeps: plan::TIME.into(), point }, sheets)?;
            // Half the samples of the reference would be compared with its noise.
            let is_enough = took.is_none_or(|ms| 2.0 * ms > self.options.effort.longest_ms());
            if is_enough || spp * 4 > self.spp {
                return Ok(());
            }
            spp *= 2;
        }
    }

    /// The split of every kernel and visibility, in pictures of a quarter of the pixels.
    fn splits(&mut self, base: &Point) -> Result<(), EvaluateError> {
        let scene = Arc::clone(&self.bench.scene);
        let size = fitted(&scene, self.truth.film.width() * self.truth.film.height() / 4);
        let truth = truth(&scene, size, self.spp, &self.options.cache, self.observer.watch())?;
        let mut bench = Bench::new(scene, size);
        let kinds: Vec<(Kernel, Visibility)> = Kernel::ALL
            .iter()
            .flat_map(|&kernel| Visibility::ALL.iter().map(move |&visibility| (kernel, visibility)))
            .collect();
        for (index, &(kernel, visibility)) in kinds.iter().enumerate() {
            let what = format!("split: {}, {}", kernel.name(), visibility.name());
            (self.observer.progress)(0.82 + 0.1 * index as f64 / kinds.len() as f64, &what);
            let point = Point { kernel, visibility, ..base.clone() };
            match split(&mut bench, &point, &truth, self.options.effort, self.observer.watch()) {
                Ok(split) => self.results.splits.push(split),
                Err(EvaluateError::Render(RenderError::Option { .. })) => {}
                Err(error) => return Err(error),
            }
            self.results.write(&self.options.out)?;
        }
        Ok(())
    }

    /// How long light takes to follow a step change, with the simulator running as it does for renderers.
    fn changes(&mut self, base: &Point) -> Result<(), EvaluateError> {
        (self.observer.progress)(0.93, "step changes");
        self.observer.watch().check()?;
        let scene = &self.bench.scene;
        let full_trace_ms = self.results.rows.iter().rev().find_map(|row| {
            let is_own =
                row.scene_hash == format!("{:016x}", scene.hash) && row.sweeps.contains(plan::CONFIG);
            is_own.then_some(row.light_ms)
        });
        let rounds = if self.options.effort == Effort::Quick { 1 } else { 3 };
        let options = DynamicOptions { rounds, pools: Vec::new(), ..DynamicOptions::default() };
        let measured = run_dynamic(scene, &options, &mut |_| {});
        if let Ok(channel) = format!("bench-dynamic-{}", std::process::id()).parse() {
            // Nothing left is as good as removed.
            let _ = clean_one(&channel);
        }
        match measured {
            Ok(report) => {
                let name = &scene.name;
                self.results.changes.extend(report.events.into_iter().map(|figures| StepChange {
                    scene: name.clone(),
                    figures,
                    full_trace_ms: full_trace_ms.unwrap_or(0.0),
                }));
            }
            Err(error) => {
                let what = format!("step changes of {} ({} paths)", scene.name, base.pool);
                self.skip(what, error.to_string());
            }
        }
        self.observer.watch().check()?;
        Ok(())
    }
}
