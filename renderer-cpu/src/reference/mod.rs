//! Turns a scene into its true picture by path tracing, and says how noisy that picture is.
//!
//! Every vertex of a path takes one sample of the lights; emitters that a bounced ray happens to hit count for
//! nothing, so no light counts twice. Paths end by Russian roulette alone, nothing is clamped.
//!
//! Two halves of the samples come from independent sequences: half their difference has the same variance as their
//! mean, which is the picture.

mod lights;
mod options;
mod path;
mod sums;

pub use options::{PixelFilter, ReferenceOptions, Stop};

use crate::threads::on_threads;
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, RenderError, SOFTWARE, Watch};
use photonstream_scene::Scene;
use serde::Serialize;
use std::time::Instant;
use sums::Sums;

/// A path-traced picture and its own noise.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The layers asked for.
    pub film: Film,
    /// How noisy they are and what they took.
    pub stats: ReferenceStats,
}

/// How noisy a reference is and what it took. The keys of the serialised form are the fields' names.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct ReferenceStats {
    /// Paths per pixel.
    pub samples_per_pixel: u64,
    /// Estimated relative RMSE of the full picture, from sampling noise alone.
    pub noise_rel_rmse: f64,
    /// The same of the direct layer.
    pub noise_direct_rel_rmse: f64,
    /// The same of the indirect layer.
    pub noise_indirect_rel_rmse: f64,
    /// Rays traced, shadow rays among them.
    pub rays: u64,
    /// Time from call to picture.
    pub render_ms: f64,
}

/// Path-traces `scene`.
///
/// With [`Stop::Samples`] and [`Stop::Error`] the picture depends on `options` alone, not on the number of threads or
/// the time it took.
///
/// # Errors
/// [`RenderError`]: an option out of range, an impossible size, cancelled.
///
/// Source: METHODS §3 (roulette) and §8 (noise by two halves).
pub fn reference(
    scene: &Scene,
    options: &ReferenceOptions,
    watch: Watch<'_>,
) -> Result<Reference, RenderError> {
    let start = Instant::now();
    options.validate()?;
    let mut film = Film::new(options.width, options.height)?;
    let sums = on_threads(options.threads, || accumulate(scene, options, watch, start))?;
    for &kind in &options.layers {
        film.push(kind.name(), sums.mean(kind))?;
    }
    let stats = ReferenceStats {
        samples_per_pixel: 2 * sums.samples_per_half,
        noise_rel_rmse: sums.noise(LayerKind::Full),
        noise_direct_rel_rmse: sums.noise(LayerKind::Direct),
        noise_indirect_rel_rmse: sums.noise(LayerKind::Indirect),
        rays: sums.rays,
        render_ms: start.elapsed().as_secs_f64() * 1e3,
    };
    let metadata = &mut film.metadata;
    metadata.scene_name = Some(scene.name.clone());
    metadata.scene_hash = Some(scene.hash);
    metadata.method = Some("path-tracing".into());
    metadata.samples_per_pixel = Some(stats.samples_per_pixel);
    metadata.noise_rel_rmse = Some(match options.layers[0] {
        LayerKind::Direct => stats.noise_direct_rel_rmse,
        LayerKind::Indirect => stats.noise_indirect_rel_rmse,
        _ => stats.noise_rel_rmse,
    });
    metadata.software = Some(SOFTWARE.into());
    Ok(Reference { film, stats })
}

/// Adds passes until `options.stop` is content.
fn accumulate(
    scene: &Scene,
    options: &ReferenceOptions,
    watch: Watch<'_>,
    start: Instant,
) -> Result<Sums, RenderError> {
    let mut sums = Sums::new(options.width, options.height);
    let noise_of = options.layers[0];
    // Samples per half and pass double up to a limit, so that a pass neither lasts long nor costs bookkeeping.
    let mut pass = 4u64;
    loop {
        let most = options.stop.most_samples_per_half();
        let size = pass.min(most - sums.samples_per_half);
        let progress_before = progress(options, &sums, noise_of, start);
        // A pass in progress counts by its share of the most there will be; errors and times are told between passes.
        let weight = match options.stop {
            Stop::Samples(_) => size as f64 / most as f64,
            _ => 0.0,
        };
        let pass_progress = |share: f64| watch.report(progress_before + share * weight);
        let pass_watch = Watch { progress: Some(&pass_progress), cancelled: watch.cancelled };
        sums.add_pass(scene, options, size, pass_watch)?;
        watch.report(progress(options, &sums, noise_of, start));
        let finished = match options.stop {
            Stop::Samples(_) => false,
            Stop::Error { rel_rmse, .. } => {
                sums.samples_per_half >= MIN_SAMPLES_PER_HALF && sums.noise(noise_of) <= rel_rmse
            }
            Stop::Time(limit) => start.elapsed() >= limit,
        };
        if finished || sums.samples_per_half >= most {
            return Ok(sums);
        }
        if sums.samples_per_half >= 2 * pass {
            pass = (pass * 2).min(64);
        }
    }
}

/// Fewer samples than this say nothing reliable about their own noise.
const MIN_SAMPLES_PER_HALF: u64 = 16;

fn progress(options: &ReferenceOptions, sums: &Sums, layer: LayerKind, start: Instant) -> f64 {
    match options.stop {
        Stop::Samples(_) => sums.samples_per_half as f64 / options.stop.most_samples_per_half() as f64,
        // Noise falls with the root of the samples: so far, share of the samples that will be needed.
        Stop::Error { rel_rmse, .. } if sums.samples_per_half > 0 => {
            (rel_rmse / sums.noise(layer).max(1e-30)).powi(2).min(1.0)
        }
        Stop::Error { .. } => 0.0,
        Stop::Time(limit) => start.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9),
    }
}
