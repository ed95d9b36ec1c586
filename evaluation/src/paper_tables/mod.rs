//! Turns the scenes of paper A into its tables, remade on this machine, with the error that the paper does not give.

mod markdown;
pub mod published;

use crate::{
    EvaluateError, Observer, device::Offered, machine::Machine, methods::Bench, metrics::compare,
    point::Point, truth::truth,
};
use photonstream_scene::SceneError;
use published::{PaperScene, SCENES, SIZES, VSLS};
use serde::Serialize;
use std::{path::PathBuf, sync::Arc, time::Instant};

/// How the tables are made.
#[derive(Clone, Debug)]
pub struct PaperOptions {
    /// Small pictures of few lights of the first scene alone: to see that it works.
    pub quick: bool,
    /// Where references are kept.
    pub cache: PathBuf,
    /// Threads.
    pub threads: usize,
}

/// Tables 1 to 3, remade.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperTables {
    /// On what it was measured.
    pub machine: Machine,
    /// The graphics adapter; `None`: pictures are the processor's.
    pub adapter: Option<String>,
    /// Why there is none.
    pub without_adapter: Option<String>,
    /// Time of it all, s.
    pub seconds: f64,
    /// Size of the pictures that errors are of, and paths per pixel of their references.
    pub error_size: (u32, u32),
    /// See `error_size`.
    pub reference_spp: u64,
    /// Table 1.
    pub scenes: Vec<SceneRow>,
    /// Tables 2 and 3.
    pub pictures: Vec<PictureRow>,
    /// What was left out, and why.
    pub skipped: Vec<Skipped>,
}

/// A row of table 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneRow {
    /// The paper's name.
    pub scene: &'static str,
    /// The paper's polygons.
    pub paper_polygons: u32,
    /// The paper's vertices.
    pub paper_vertices: u32,
    /// Triangles here.
    pub triangles: usize,
    /// Vertices here.
    pub vertices: usize,
    /// How the scene here differs.
    pub differs: &'static str,
    /// Noise of its reference: relative RMSE of the full picture.
    pub reference_noise: f64,
}

/// A box of table 2 or 3.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureRow {
    /// The paper's name.
    pub scene: &'static str,
    /// Picture width, pixels.
    pub width: u32,
    /// Picture height, pixels.
    pub height: u32,
    /// Virtual surface lights asked for.
    pub vsls: u32,
    /// The paper's pictures a second with deferred shading.
    pub paper_deferred_per_s: u32,
    /// The paper's pictures a second with the whole geometry drawn for each light.
    pub paper_whole_per_s: u32,
    /// Pictures a second here, by way: `tiled` and `splat` are deferred, `forward` draws the geometry for each light; `cpu`.
    pub per_s: Vec<(String, f64)>,
    /// Relative RMSE of the full picture as it is timed: kernel `paper`, without shadows of the lights.
    pub rel_rmse_paper: f64,
    /// The same with kernel `patch` and visibility `octahedral`.
    pub rel_rmse_octahedral: f64,
}

/// Rows that are not there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// The paper's name of the scene.
    pub scene: &'static str,
    /// Why, and what to do.
    pub why: String,
}

/// Paths of the pool: what the pictures cost does not depend on it.
const POOL_PATHS: u32 = 1 << 17;
/// Pictures that errors are of, and paths per pixel of their references.
const ERROR: ((u32, u32), u64) = ((160, 120), 256);
/// The same of a quick run.
const QUICK_ERROR: ((u32, u32), u64) = ((24, 18), 16);
/// Pictures of a quick run.
const QUICK_SIZE: (u32, u32) = (80, 60);

/// Takes how much of a scene is done, in [0, 1], and what is being done.
type Part<'a> = &'a dyn Fn(f64, &str);

impl PaperTables {
    /// Measures all tables.
    ///
    /// # Errors
    /// Cancelled, or a renderer fails. A scene whose model is not there is skipped.
    pub fn measure(
        options: &PaperOptions,
        mut device: Offered<'_>,
        observer: Observer<'_>,
    ) -> Result<Self, EvaluateError> {
        let begun = Instant::now();
        let (error_size, reference_spp) = if options.quick { QUICK_ERROR } else { ERROR };
        let mut tables = Self {
            machine: Machine::here(),
            adapter: device.as_ref().ok().map(|device| device.adapter()),
            without_adapter: device.as_ref().err().cloned(),
            seconds: 0.0,
            error_size,
            reference_spp,
            scenes: Vec::new(),
            pictures: Vec::new(),
            skipped: Vec::new(),
        };
        let scenes = if options.quick { &SCENES[..1] } else { &SCENES[..] };
        for (index, paper) in scenes.iter().enumerate() {
            let share = |part: f64| (index as f64 + part) / scenes.len() as f64;
            let part = |part: f64, what: &str| {
                (observer.progress)(share(part), &format!("{}: {what}", paper.name));
            };
            match tables.scene(paper, options, &mut device, (observer, &part)) {
                Err(EvaluateError::Scene(error @ SceneError::AssetMissing { .. })) => {
                    tables.skipped.push(Skipped { scene: paper.name, why: error.to_string() });
                }
                other => other?,
            }
        }
        tables.seconds = begun.elapsed().as_secs_f64();
        Ok(tables)
    }

    fn scene(
        &mut self,
        paper: &PaperScene,
        options: &PaperOptions,
        device: &mut Offered<'_>,
        (observer, part): (Observer<'_>, Part<'_>),
    ) -> Result<(), EvaluateError> {
        part(0.0, "loading");
        let scene = Arc::new(paper.load()?);
        part(0.02, "reference");
        let watch = observer.watch();
        let truth = truth(&scene, self.error_size, self.reference_spp, &options.cache, watch)?;
        self.scenes.push(SceneRow {
            scene: paper.name,
            paper_polygons: paper.polygons.0,
            paper_vertices: paper.polygons.1,
            triangles: scene.geometry.triangles.len(),
            vertices: scene.geometry.vertices.len(),
            differs: paper.differs,
            reference_noise: truth.noise.full,
        });
        let base = Point::of_scene(&scene, options.threads);
        let point = |text: String| {
            base.parse(&text).map_err(|reason| EvaluateError::Point { text: text.clone(), reason })
        };
        let columns = if options.quick { 1 } else { VSLS.len() };
        let mut errors = Vec::new();
        let mut small = Bench::new(Arc::clone(&scene), self.error_size);
        for (column, vsls) in VSLS.into_iter().take(columns).enumerate() {
            part(0.1 + 0.1 * column as f64 / columns as f64, &format!("error of {vsls} lights"));
            let mut error = |kernel: &str| {
                let settings = format!("photon-streaming:vsls={vsls},pool={POOL_PATHS},{kernel}");
                let shot = small.shoot(&point(settings)?, watch)?;
                Ok::<_, EvaluateError>(compare(&shot.film, &truth.film, "full")?.whole.rel_rmse)
            };
            let paper = error("kernel=paper,visibility=none")?;
            errors.push((paper, error("kernel=patch,visibility=octahedral")?));
        }
        let sizes = if options.quick { 1 } else { SIZES.len() };
        for (table, size) in SIZES.into_iter().take(sizes).enumerate() {
            let (width, height) = if options.quick { QUICK_SIZE } else { size };
            let mut bench = Bench::new(Arc::clone(&scene), (width, height));
            for (column, vsls) in VSLS.into_iter().take(columns).enumerate() {
                let done = (table * columns + column) as f64 / (sizes * columns) as f64;
                part(0.2 + 0.8 * done, &format!("{width} x {height}, {vsls} lights"));
                let settings = format!("vsls={vsls},pool={POOL_PATHS},kernel=paper,visibility=none");
                let mut per_s = Vec::new();
                match device {
                    Ok(device) => {
                        let mut ways = device.ways();
                        ways.retain(|way| way.interleave == 1);
                        // Deferred ones first, as in the paper.
                        ways.sort_by_key(|way| way.accumulation == "forward");
                        for way in ways {
                            let name = way.accumulation;
                            let point = point(format!(
                                "photon-streaming-gpu:{settings},accumulation={name},interleave=1"
                            ))?;
                            let ms = bench.time_on(&mut **device, &point, watch)?;
                            per_s.push((name, 1e3 / ms));
                        }
                    }
                    Err(_) => {
                        let shot = bench.shoot(&point(format!("photon-streaming:{settings}"))?, watch)?;
                        per_s.push(("cpu".into(), 1e3 / shot.times.picture_ms));
                    }
                }
                let (deferred, whole) = paper.per_s[table][column];
                self.pictures.push(PictureRow {
                    scene: paper.name,
                    width,
                    height,
                    vsls,
                    paper_deferred_per_s: deferred,
                    paper_whole_per_s: whole,
                    per_s,
                    rel_rmse_paper: errors[column].0,
                    rel_rmse_octahedral: errors[column].1,
                });
            }
        }
        Ok(())
    }
}
