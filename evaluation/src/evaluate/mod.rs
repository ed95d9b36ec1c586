//! Turns scenes into measured points, splits and step changes, writing results as they come.

mod run;

use crate::{
    EvaluateError, command,
    device::{Offered, WITHOUT},
    figures::figures,
    hard_cases::{CLOSED_FORMS, SAMPLES, run as run_closed_form},
    machine::Machine,
    methods::{Bench, denoised},
    motion,
    plan::{self, Effort, Planned},
    point::Point,
    report::{self, SceneSheet},
    results::{Results, Skipped},
    truth::truth,
};
use glam::Vec3;
use photonstream_renderer::{LayerKind, Watch};
use photonstream_scene::{Scene, SceneConfig};
use run::Run;
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
    /// The moment at which animated scenes are measured, s; `None`: as they are loaded.
    pub time_s: Option<f64>,
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
    pub(crate) fn watch(&self) -> Watch<'_> {
        Watch { progress: None, cancelled: Some(self.cancelled) }
    }
}

/// Evaluates scenes; `results.csv`, `results.json` and `index.html` in `options.out` hold all of it. `device` draws what is
/// measured of a graphics device; the report says why where there is none.
///
/// After an error, and after a cancelled evaluation, they hold what was measured before, and say so.
///
/// # Errors
/// [`EvaluateError`].
pub fn evaluate(
    options: &Options,
    mut device: Offered<'_>,
    observer: Observer<'_>,
) -> Result<Results, EvaluateError> {
    std::fs::create_dir_all(&options.out).map_err(|e| EvaluateError::write(&options.out, e))?;
    let begun = Instant::now();
    let arguments = device.as_ref().map_or(String::new(), |d| d.arguments());
    let mut results = Results::new(Machine::here(), command::whole(options, &arguments));
    results.skipped = left_out();
    match &device {
        Ok(device) => results.adapter = Some(device.adapter()),
        Err(why) => results.skipped.push(Skipped { what: WITHOUT.into(), why: why.clone() }),
    }
    results.hard_cases = CLOSED_FORMS.iter().filter_map(|form| run_closed_form(form.test, SAMPLES)).collect();
    let mut sheets = Vec::new();
    let (mut outcome, mut black) = (Ok(()), Vec::new());
    for (index, config) in options.configs.iter().enumerate() {
        let count = options.configs.len() as f64;
        let progress = |share: f64, what: &str| {
            (observer.progress)((index as f64 + share) / count, what);
        };
        let observer = Observer { progress: &progress, ..observer };
        match scene(config, options, &mut device, observer, &mut results, &mut sheets) {
            // The others may have light.
            Err(error @ EvaluateError::Black { .. }) => black.push(error),
            other => outcome = other,
        }
        if outcome.is_err() {
            break;
        }
    }
    for error in &black {
        results.skipped.push(Skipped { what: SCENE_WITHOUT_LIGHT.into(), why: error.to_string() });
    }
    if outcome.is_ok() && black.len() == options.configs.len() {
        outcome = black.into_iter().next().map_or(Ok(()), Err);
    }
    results.complete = outcome.is_ok();
    results.seconds = begun.elapsed().as_secs_f64();
    results.write(&options.out)?;
    report::write(&results, &sheets, &options.out)?;
    outcome.map(|()| results)
}

/// What is skipped where a scene's picture is black.
pub const SCENE_WITHOUT_LIGHT: &str = "a scene without light";

/// What no evaluation has.
fn left_out() -> Vec<Skipped> {
    let skipped = |what: &str, why: &str| Skipped { what: what.into(), why: why.into() };
    let mut left_out = vec![skipped(
        "HDR-FLIP",
        "FLIP is measured on the tone-mapped picture: the library has the variant for displays alone",
    )];
    if !denoised::IS_BUILT_IN {
        left_out.push(skipped(
            "path tracing with Open Image Denoise",
            "this build is without the feature oidn, which needs the library: cargo build --release --features oidn",
        ));
    }
    left_out
}

fn scene(
    config: &Path,
    options: &Options,
    device: &mut Offered<'_>,
    observer: Observer<'_>,
    results: &mut Results,
    sheets: &mut Vec<SceneSheet>,
) -> Result<(), EvaluateError> {
    let written = SceneConfig::from_file(config)?;
    let mut loaded = match options.time_s {
        Some(time_s) => {
            let mut held = written.at(time_s)?.build()?;
            held.animation = written.build()?.animation;
            held
        }
        None => written.build()?,
    };
    // A moving scene is measured as it is loaded, but for its flicker.
    let animation = std::mem::take(&mut loaded.animation);
    loaded.streaming.seed = options.seed.unwrap_or(loaded.streaming.seed);
    let scene = Arc::new(loaded);
    let size = options.size.unwrap_or_else(|| fitted(&scene, options.effort.pixels()));
    let spp = options.reference_spp.unwrap_or(options.effort.reference_spp());
    (observer.progress)(0.0, "reference");
    let reported = |share: f64| (observer.progress)(0.15 * share, "reference");
    let watch = Watch { progress: Some(&reported), cancelled: Some(observer.cancelled) };
    let truth = truth(&scene, size, spp, &options.cache, watch)?;
    let full = &truth.film.layer(LayerKind::Full.name())?.pixels;
    if full.iter().all(|pixel| *pixel == Vec3::ZERO) {
        let remedy = match animation.is_empty() {
            true => "give it a light that the camera sees something of",
            false => "measure a moment that has light by --time SECONDS",
        };
        return Err(EvaluateError::Black { scene: scene.name.clone(), remedy });
    }
    sheets.push(SceneSheet::new(&scene, &truth));
    let threads =
        options.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let base = Point::of_scene(&scene, threads);
    let bench = Bench::new(Arc::clone(&scene), size);
    let ways = device.as_ref().map_or(Vec::new(), |d| d.ways());
    let mut run = Run { config, options, observer, truth: &truth, spp, bench, device, results };
    run.warm_up(&base)?;
    if !options.points.is_empty() {
        for text in &options.points {
            let point =
                base.parse(text).map_err(|reason| EvaluateError::Point { text: text.clone(), reason })?;
            run.point(&Planned { sweeps: "point".into(), point }, sheets)?;
        }
        return Ok(());
    }
    let methods = motion::methods(&run.bench.scene, &base);
    let planned = plan::plan(&base, options.effort, &ways, &methods);
    let count = planned.len() as f64;
    for (index, planned) in planned.iter().enumerate() {
        (observer.progress)(0.15 + 0.45 * index as f64 / count, &planned.point.to_string());
        run.point(planned, sheets)?;
    }
    run.methods(&animation)?;
    if let Some(sheet) = sheets.last_mut() {
        sheet.figures = figures(
            &run.bench,
            &base,
            (&animation, options.time_s.unwrap_or(0.0)),
            &truth,
            observer.watch(),
        )?;
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
