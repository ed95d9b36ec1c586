//! Turns a point into a picture and the time it takes: each method on the same scene, rays and cores.

pub(crate) mod denoised;
pub(crate) mod few;
mod instant_radiosity;
mod on_device;
mod paper_a;
mod photon_streaming;

pub(crate) use photon_streaming::{lights_of, render_streamed, vsls_of, with_scene_and_pool};

use crate::{
    EvaluateError,
    point::{Method, Point},
};
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, RenderOptions, VslSet, Watch};
use photonstream_renderer_cpu::{
    ReferenceOptions, reference,
    reference::{PixelFilter, Stop},
    render,
};
use photonstream_scene::{RangeCulling, Scene, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::simulation::Simulation;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{collections::HashMap, sync::Arc, time::Instant};

/// What a picture takes on the point's threads.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Times {
    /// Lights placed, once for a scene: no part of the time of a picture.
    pub place_ms: f64,
    /// Light traced: a whole pool.
    pub light_ms: f64,
    /// Picture rendered, direct light included.
    pub picture_ms: f64,
}

impl Times {
    /// Light and picture.
    pub fn total_ms(&self) -> f64 {
        self.light_ms + self.picture_ms
    }
}

/// A picture of a point.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Layers full and indirect.
    pub film: Film,
    /// What it took: of several runs the one of median total.
    pub times: Times,
    /// Number of runs.
    pub runs: usize,
    /// Virtual lights that were used.
    pub vsls_placed: Option<usize>,
}

/// One scene, to be rendered by every method.
#[derive(Debug)]
pub struct Bench {
    /// The scene as its config says.
    pub scene: Arc<Scene>,
    size: (u32, u32),
    /// Simulations by VSLs, seed and whether they are placed as paper A does, with the time in ms.
    placed: HashMap<(u32, u64, bool), (Simulation, f64)>,
    threads: HashMap<usize, Arc<ThreadPool>>,
}

/// A point that is done in less than this is done again, so that its time is a median.
const SHORT_MS: f64 = 50.0;
/// Most runs of a point.
const MOST_RUNS: usize = 5;

impl Bench {
    /// Pictures of `scene` of `size` pixels.
    pub fn new(scene: Arc<Scene>, size: (u32, u32)) -> Self {
        Self { scene, size, placed: HashMap::new(), threads: HashMap::new() }
    }

    /// Measures one point, on processor cores; those of a graphics device are [`Bench::shoot_on`]'s.
    ///
    /// # Errors
    /// Those of the renderer: cancelled, or a setting that it does not have.
    pub fn shoot(&mut self, point: &Point, watch: Watch<'_>) -> Result<Shot, EvaluateError> {
        let prepared = self.prepare(point);
        let pool = self.threads(point.threads)?;
        pool.install(|| {
            let mut runs: Vec<Times> = Vec::new();
            loop {
                let (film, times, vsls_placed) = self.once(point, prepared.as_ref(), watch)?;
                runs.push(times);
                if runs.len() >= MOST_RUNS || runs.iter().map(Times::total_ms).sum::<f64>() > SHORT_MS {
                    runs.sort_by(|a, b| a.total_ms().total_cmp(&b.total_ms()));
                    let times = runs[runs.len() / 2];
                    return Ok(Shot { film, times, runs: runs.len(), vsls_placed });
                }
            }
        })
    }

    fn threads(&mut self, threads: usize) -> Result<Arc<ThreadPool>, EvaluateError> {
        if let Some(pool) = self.threads.get(&threads) {
            return Ok(Arc::clone(pool));
        }
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| EvaluateError::Threads { threads, reason: e.to_string() })?;
        let pool = Arc::new(pool);
        self.threads.insert(threads, Arc::clone(&pool));
        Ok(pool)
    }

    fn once(
        &self,
        point: &Point,
        prepared: Option<&(Simulation, f64)>,
        watch: Watch<'_>,
    ) -> Result<(Film, Times, Option<usize>), EvaluateError> {
        let scene = &self.scene;
        let begun = Instant::now();
        let (vsls, place_ms, light_ms) = match (point.method, prepared) {
            (Method::PathTracing, _) => return self.path_traced(point, watch),
            (Method::PathTracingDenoised, _) => return self.path_traced_and_denoised(point, watch),
            (Method::PaperA, Some((simulation, place_ms))) => {
                let (vsls, light_ms) = paper_a::lights(simulation)?;
                (vsls, *place_ms, light_ms)
            }
            (Method::PhotonStreaming, Some((simulation, place_ms))) => {
                let (vsls, light_ms) = lights_of(simulation)?;
                (vsls, *place_ms, light_ms)
            }
            (method, _) if few::method_of(method).is_some() => {
                let (vsls, shining, light_ms) = few::lights(scene, point)?;
                let begun = Instant::now();
                let film = self.picture(point, &vsls, watch)?;
                let picture_ms = begun.elapsed().as_secs_f64() * 1e3;
                return Ok((film, Times { place_ms: 0.0, light_ms, picture_ms }, Some(shining)));
            }
            _ => {
                let is_bounded = point.method == Method::InstantRadiosityBounded;
                let vsls = instant_radiosity::lights(scene, point.vsls, point.seed, is_bounded)?;
                (vsls, 0.0, begun.elapsed().as_secs_f64() * 1e3)
            }
        };
        let begun = Instant::now();
        let film = self.picture(point, &vsls, watch)?;
        let times = Times { place_ms, light_ms, picture_ms: begun.elapsed().as_secs_f64() * 1e3 };
        Ok((film, times, Some(vsls.len())))
    }

    fn picture(&self, point: &Point, vsls: &VslSet, watch: Watch<'_>) -> Result<Film, EvaluateError> {
        Ok(render(&self.scene, vsls, &self.options(point), watch)?.film)
    }

    pub(crate) fn options(&self, point: &Point) -> RenderOptions {
        let mut options = RenderOptions::from_settings(&self.scene.render);
        (options.width, options.height) = self.size;
        options.layers = vec![LayerKind::Full, LayerKind::Indirect];
        options.light_samples = point.light_samples;
        options.seed = point.seed;
        (options.kernel, options.visibility) = match point.method {
            Method::PaperA => (Kernel::Paper, Visibility::None),
            Method::InstantRadiosity => (Kernel::Paper, point.visibility),
            Method::InstantRadiosityBounded => (Kernel::Disc, point.visibility),
            _ => (point.kernel, point.visibility),
        };
        if point.method == Method::PaperA {
            options.culling = RangeCulling::Cut;
        }
        options
    }

    fn path_traced(
        &self,
        point: &Point,
        watch: Watch<'_>,
    ) -> Result<(Film, Times, Option<usize>), EvaluateError> {
        let options = ReferenceOptions {
            width: self.size.0,
            height: self.size.1,
            stop: Stop::Samples(point.spp),
            layers: vec![LayerKind::Full, LayerKind::Indirect],
            seed: point.seed,
            pixel_filter: PixelFilter::Centre,
            threads: None,
        };
        let traced = reference(&self.scene, &options, watch)?;
        let times = Times { picture_ms: traced.stats.render_ms, ..Times::default() };
        Ok((traced.film, times, None))
    }

    /// The guides are the picture's, too, and so is the time that they take.
    fn path_traced_and_denoised(
        &self,
        point: &Point,
        watch: Watch<'_>,
    ) -> Result<(Film, Times, Option<usize>), EvaluateError> {
        let begun = Instant::now();
        let (noisy, ..) = self.path_traced(point, watch)?;
        let mut options = self.options(point);
        options.layers = vec![LayerKind::Albedo, LayerKind::Normal];
        let guides = render(&self.scene, &VslSet::default(), &options, watch)?.film;
        let film = denoised::denoise(&noisy, &guides)?;
        let picture_ms = begun.elapsed().as_secs_f64() * 1e3;
        Ok((film, Times { picture_ms, ..Times::default() }, None))
    }

    /// What is placed once for a scene, whatever is rendered of it.
    fn prepare(&mut self, point: &Point) -> Option<(Simulation, f64)> {
        let is_as_paper = match point.method {
            Method::PhotonStreaming | Method::PhotonStreamingGpu => false,
            Method::PaperA => true,
            _ => return None,
        };
        let key = (point.vsls, point.seed, is_as_paper);
        let scene = &self.scene;
        let (base, place_ms) =
            self.placed.entry(key).or_insert_with(|| photon_streaming::place(scene, key)).clone();
        Some((photon_streaming::with_pool(&base, point), place_ms))
    }

    /// The simulation of a point of photon streaming, its pool empty.
    pub fn simulation(&mut self, point: &Point) -> Simulation {
        self.placed_for(point).0
    }

    /// The same, and the time that placing its lights took, ms.
    fn placed_for(&mut self, point: &Point) -> (Simulation, f64) {
        let point = Point { method: Method::PhotonStreaming, ..point.clone() };
        let prepared = self.prepare(&point);
        prepared.expect("invariant: photon streaming is prepared")
    }
}
