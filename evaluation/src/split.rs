//! Turns pairs of pictures into what causes the error of streamed indirect light.
//!
//! All pictures are of indirect light; a part is a mean squared difference over the squared mean of the reference R.
//! M(…) is the mean of pictures with independent samples of the same virtual surface lights.
//! - variance: between those pictures, what a single one has.
//! - visibility: M(as set) − M(rays).
//! - discretisation: M(rays) − M(rays, many lights).
//! - bias: M(rays, many lights) − R: the kernel and all that does not vanish with more lights.
//! - mixed: twice the products of the last three, which may be negative. The total is the sum of all five.
//! - staleness: after an object has moved by its radius and so much tracing, against the light of a whole trace. It comes
//!   on top while something changes.
//!
//! Noise that all those means still hold is taken off where its size is known.

use crate::{
    EvaluateError,
    methods::{Bench, lights_of, render_streamed, with_scene_and_pool},
    plan::Effort,
    point::Point,
    results::Split,
    truth::Truth,
};
use glam::{DAffine3, DVec3, Vec3};
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, RenderOptions, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{ObjectId, Scene, Visibility};
use photonstream_simulator::{change::Change, simulation::Simulation};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Pictures of a mean.
const SEEDS: u64 = 4;
/// How many more lights are many.
const MANY: u32 = 8;
/// Time after a change at which staleness is measured: a frame at 60 Hz.
pub const STALE_AFTER: Duration = Duration::from_millis(16);

/// The split of `point`; `truth` is the reference of its size.
///
/// # Errors
/// Those of the renderer.
pub fn split(
    bench: &mut Bench,
    point: &Point,
    truth: &Truth,
    effort: Effort,
    watch: Watch<'_>,
) -> Result<Split, EvaluateError> {
    let r = &truth.film.layer(LayerKind::Indirect.name())?.pixels;
    let size = (truth.film.width(), truth.film.height());
    let options = |visibility: Visibility| {
        let mut options = RenderOptions::from_settings(&bench.scene.render);
        (options.width, options.height) = size;
        (options.kernel, options.visibility) = (point.kernel, visibility);
        options.layers = vec![LayerKind::Indirect];
        options
    };
    let (as_set, rays) = (options(point.visibility), options(Visibility::Rays));
    let simulation = bench.simulation(point);
    let many_vsls = point.vsls.saturating_mul(if effort == Effort::Quick { 4 } else { MANY });
    // The pool grows with the lights, so that the flux of each is as certain.
    let many_pool = point.pool.saturating_mul(many_vsls / point.vsls).min(1 << 20);
    let many = bench.simulation(&Point { vsls: many_vsls, pool: many_pool, ..point.clone() });
    let mean_sq = mean(r).powi(2).max(f64::MIN_POSITIVE);
    let (mut set_sum, mut rays_sum) = (Vec::new(), Vec::new());
    let mut pictures = Vec::new();
    for seed in 1..=SEEDS {
        let lights = lights_of(&seeded(&simulation, seed))?.0;
        let picture = pixels(&render(&simulation.scene, &lights, &as_set, watch)?.film)?;
        add(&mut set_sum, &picture, SEEDS);
        if as_set != rays {
            add(&mut rays_sum, &pixels(&render(&simulation.scene, &lights, &rays, watch)?.film)?, SEEDS);
        }
        pictures.push(picture);
    }
    let rays_mean = if as_set == rays { &set_sum } else { &rays_sum };
    let spread: f64 = pictures.iter().map(|p| difference(p, &set_sum)).sum();
    let variance = spread / (SEEDS - 1) as f64 / mean_sq;
    let many_picture = pixels(&render_streamed(&many, &rays, watch)?)?;
    let noise = truth.noise.indirect.powi(2);
    let over = |a: &[Vec3], b: &[Vec3], noise: f64| (difference(a, b) / mean_sq - noise).max(0.0);
    // A mean of pictures has its share of their variance; the one with many lights about as much as a single one.
    let of_mean = variance / SEEDS as f64;
    let visibility_part = over(&set_sum, rays_mean, 0.0);
    let discretisation = over(rays_mean, &many_picture, of_mean + variance);
    let bias = over(&many_picture, r, noise + variance);
    let systematic = over(&set_sum, r, noise + of_mean);
    let staleness = staleness(&simulation, &as_set, watch)?;
    Ok(Split {
        scene: bench.scene.name.clone(),
        kernel: point.kernel.name().into(),
        visibility: point.visibility.name().into(),
        vsls: point.vsls,
        pool_paths: point.pool,
        many_vsls,
        total: systematic + variance,
        variance,
        visibility_part,
        discretisation,
        bias,
        mixed: systematic - visibility_part - discretisation - bias,
        staleness: staleness.map(|squares| squares / mean_sq),
        staleness_after_ms: STALE_AFTER.as_secs_f64() * 1e3,
    })
}

/// The same lights and pool with other samples.
fn seeded(simulation: &Simulation, seed: u64) -> Simulation {
    let mut scene = Scene::clone(&simulation.scene);
    scene.streaming.seed = seed;
    with_scene_and_pool(simulation, scene)
}

fn pixels(film: &Film) -> Result<Vec<Vec3>, EvaluateError> {
    Ok(film.layer(LayerKind::Indirect.name())?.pixels.clone())
}

fn add(sum: &mut Vec<Vec3>, picture: &[Vec3], count: u64) {
    sum.resize(picture.len(), Vec3::ZERO);
    for (sum, &pixel) in sum.iter_mut().zip(picture) {
        *sum += pixel / count as f32;
    }
}

fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|p| p.as_dvec3().element_sum()).sum::<f64>() / (3 * pixels.len()).max(1) as f64
}

/// Mean squared difference over all channels.
fn difference(a: &[Vec3], b: &[Vec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a.as_dvec3() - b.as_dvec3()).length_squared());
    squares.sum::<f64>() / (3 * a.len()).max(1) as f64
}

/// Mean squared difference of the picture [`STALE_AFTER`] after an object has moved from that of its whole light.
fn staleness(
    simulation: &Simulation,
    options: &RenderOptions,
    watch: Watch<'_>,
) -> Result<Option<f64>, EvaluateError> {
    let Some((id, to)) = movable(&simulation.scene) else { return Ok(None) };
    let Ok(moved) = simulation.scene.with_object_placed(id, to) else { return Ok(None) };
    let moved = simulation.with_scene(Arc::new(moved));
    let mut ledger = simulation.fill();
    let begun = Instant::now();
    ledger.revise(&moved, Change::between(simulation, &moved), None);
    // Some tasks at a time: about a millisecond of two threads.
    while begun.elapsed() < STALE_AFTER && !ledger.is_settled() {
        moved.advance(&mut ledger, 8);
    }
    let early = crate::methods::vsls_of(&moved, &ledger)?;
    while !ledger.is_settled() {
        moved.advance(&mut ledger, 1024);
    }
    let late = crate::methods::vsls_of(&moved, &ledger)?;
    let picture = |lights: &VslSet| pixels(&render(&moved.scene, lights, options, watch)?.film);
    Ok(Some(difference(&picture(&early)?, &picture(&late)?)))
}

/// The smallest body that emits no light, and where it goes: its radius along x, towards the middle of the scene.
fn movable(scene: &Scene) -> Option<(ObjectId, DAffine3)> {
    let half = |id: u32| {
        let corners = scene.objects[id as usize].triangles.clone().flat_map(|t| scene.geometry.triangle(t));
        let (low, high) =
            corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        0.5 * (high - low).as_dvec3()
    };
    let bodies = (0..scene.objects.len() as u32)
        .filter(|&id| scene.objects[id as usize].emitter.is_none() && half(id).min_element() > 0.0);
    let id = bodies.min_by(|&a, &b| half(a).length().total_cmp(&half(b).length()))?;
    let at = scene.world_from_loaded(ObjectId(id));
    let side = if scene.objects[id as usize].world_from_rest.translation.x > 0.0 { -1.0 } else { 1.0 };
    let shift = DAffine3::from_translation(DVec3::X * side * half(id).x);
    Some((ObjectId(id), shift * at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::truth;
    use photonstream_scene::SceneConfig;
    use std::path::Path;

    /// The parts sum to the whole by definition; what is tested is that each is zero where its cause is missing and not
    /// where it is not. 24 × 24 pixels, 60 lights, 2 048 paths, seed 1.
    #[test]
    fn parts_have_their_causes() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
        let scene = Arc::new(SceneConfig::from_file(&config).unwrap().build().unwrap());
        let folder = tempfile::tempdir().unwrap();
        let truth = truth(&scene, (24, 24), 64, folder.path(), Watch::default()).unwrap();
        let mut point = Point { vsls: 60, pool: 2048, ..Point::of_scene(&scene, 2) };
        let mut bench = Bench::new(scene, (24, 24));
        let mut of =
            |point: &Point| split(&mut bench, point, &truth, Effort::Quick, Watch::default()).unwrap();
        point.visibility = Visibility::Rays;
        let rays = of(&point);
        point.visibility = Visibility::None;
        let none = of(&point);
        assert_eq!(rays.visibility_part, 0.0);
        assert!(none.visibility_part > 0.01, "{none:?}");
        for split in [&rays, &none] {
            let parts =
                split.variance + split.visibility_part + split.discretisation + split.bias + split.mixed;
            assert!((parts - split.total).abs() < 1e-9 * split.total.max(1.0), "{split:?}");
            assert!(split.variance > 0.0 && split.discretisation > 0.0, "{split:?}");
        }
        point.pool *= 16;
        // 1/16 is expected. Pixels share their lights, so that four pictures may have as few as three degrees of freedom:
        // a quarter is beyond what a variance that does not fall would show.
        let more = of(&point);
        assert!(more.variance < none.variance / 4.0, "{} and {}", more.variance, none.variance);
    }
}
