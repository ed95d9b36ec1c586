//! Turns one scene into its measured points, splits and step changes, writing results as they come.

use super::{Observer, Options, fitted};
use crate::{
    EvaluateError, command,
    device::{Offered, WITHOUT},
    flip::{Exposure, flip},
    methods::{Bench, Shot, denoised},
    metrics::compare,
    motion::{self, MethodLine},
    plan::{self, Effort, Planned},
    point::{Method, Point},
    report::{Portrait, SceneSheet},
    results::{Results, Row, Skipped, StepChange},
    split::split,
    truth::{Truth, truth},
};
use photonstream_protocol::clean_one;
use photonstream_renderer::{LayerKind, RenderError, RenderOptions};
use photonstream_scene::{Animation, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::bench::{DynamicOptions, run_dynamic};
use std::{path::Path, sync::Arc};

/// The evaluation of one scene.
pub(super) struct Run<'a, 'd> {
    pub(super) config: &'a Path,
    pub(super) options: &'a Options,
    pub(super) observer: Observer<'a>,
    pub(super) truth: &'a Truth,
    pub(super) spp: u64,
    pub(super) bench: Bench,
    pub(super) device: &'a mut Offered<'d>,
    pub(super) results: &'a mut Results,
}

impl Run<'_, '_> {
    /// Threads, caches and clock rates are up before anything is timed.
    pub(super) fn warm_up(&mut self, base: &Point) -> Result<(), EvaluateError> {
        let (vsls, pool) = (50, 4096);
        let point = Point { vsls, pool, visibility: Visibility::None, ..base.clone() };
        self.bench.shoot(&point, self.observer.watch()).map(drop)
    }

    /// Measures one point and writes all that is known; what the renderer does not have is left out and named.
    pub(super) fn point(
        &mut self,
        planned: &Planned,
        sheets: &mut [SceneSheet],
    ) -> Result<Option<f64>, EvaluateError> {
        let point = &planned.point;
        let watch = self.observer.watch();
        let shot = match self.device.as_deref_mut() {
            _ if point.method != Method::PhotonStreamingGpu => self.bench.shoot(point, watch),
            Ok(device) => self.bench.shoot_on(device, point, watch),
            Err(reason) => {
                let why = reason.clone();
                self.skip(WITHOUT.into(), why);
                return Ok(None);
            }
        };
        let shot = match shot {
            Ok(shot) => shot,
            // What an adapter cannot do is no reason to end.
            Err(EvaluateError::Render(error @ (RenderError::Option { .. } | RenderError::Device(_))))
                if point.method == Method::PhotonStreamingGpu =>
            {
                let shown = (&point.accumulation, point.interleave, point.visibility.name());
                let what =
                    format!("the GPU renderer: {}, interleave {}, visibility {}", shown.0, shown.1, shown.2);
                self.skip(what, error.to_string());
                return Ok(None);
            }
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
            accumulation: is("accumulation").then(|| point.accumulation.clone()),
            interleave: is("interleave").then_some(point.interleave),
            adapter: if is("accumulation") { self.results.adapter.clone() } else { None },
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
            command: command::of_point(
                (self.config, self.options.time_s),
                (width, height),
                self.spp,
                point,
                &self.device.as_ref().map_or(String::new(), |d| d.arguments()),
            ),
        })
    }

    /// A line for each of the simulator's methods, with their flicker in pictures of a quarter of the pixels.
    pub(super) fn methods(&mut self, animation: &Animation) -> Result<(), EvaluateError> {
        let scene = Arc::clone(&self.bench.scene);
        let hash = format!("{:016x}", scene.hash);
        let size = fitted(&scene, self.truth.film.width() * self.truth.film.height() / 4);
        let mut bench = Bench::new(Arc::clone(&scene), size);
        let frames = if self.options.effort == Effort::Quick { 6 } else { 16 };
        let base = Point::of_scene(&scene, self.results.machine.cores.max(1));
        for point in motion::methods(&scene, &base) {
            let is_own = |row: &&Row| {
                row.scene_hash == hash
                    && row.method == point.method.name()
                    && row.sweeps.split(' ').any(|s| s == plan::METHODS)
            };
            let Some(row) = self.results.rows.iter().find(is_own).cloned() else { continue };
            (self.observer.progress)(0.6, &format!("flicker: {}", point.method));
            let options = RenderOptions { layers: vec![LayerKind::Indirect], ..bench.options(&point) };
            let watch = self.observer.watch();
            let flicker = motion::flicker_of(&mut bench, &point, animation, frames, &options, watch)?;
            self.results.methods.push(MethodLine::of_row(&row, flicker));
            self.results.write(&self.options.out)?;
        }
        Ok(())
    }

    /// Path tracing with more and more paths, until the time is over.
    pub(super) fn path_tracing(
        &mut self,
        base: &Point,
        sheets: &mut [SceneSheet],
    ) -> Result<(), EvaluateError> {
        self.paths_of(Method::PathTracing, base, sheets)?;
        if denoised::IS_BUILT_IN {
            self.paths_of(Method::PathTracingDenoised, base, sheets)?;
        }
        Ok(())
    }

    fn paths_of(
        &mut self,
        method: Method,
        base: &Point,
        sheets: &mut [SceneSheet],
    ) -> Result<(), EvaluateError> {
        let mut spp = 2;
        loop {
            let point = Point { method, spp, ..base.clone() };
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
    pub(super) fn splits(&mut self, base: &Point) -> Result<(), EvaluateError> {
        let scene = Arc::clone(&self.bench.scene);
        let size = fitted(&scene, self.truth.film.width() * self.truth.film.height() / 4);
        let truth = truth(&scene, size, self.spp, &self.options.cache, self.observer.watch())?;
        let mut bench = Bench::new(scene, size);
        let kinds: Vec<(Kernel, Visibility)> = Kernel::ALL
            .iter()
            .flat_map(|&kernel| plan::shadows().map(move |visibility| (kernel, visibility)))
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
    pub(super) fn changes(&mut self, base: &Point) -> Result<(), EvaluateError> {
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
