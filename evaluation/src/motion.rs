//! Turns the methods of the simulator into one line each, after paper B's figure 12: what an update takes, how many lights
//! there are, what a frame takes, how wrong it is, and how it flickers while things move.

use crate::{
    EvaluateError,
    methods::{Bench, few},
    point::{Method, Point},
    results::Row,
};
use glam::Vec3;
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, RenderOptions, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{Animation, Scene};
use photonstream_simulator::few_lights::FewLights;
use serde::{Deserialize, Serialize};

/// One method in one scene. Keys of JSON are the fields' names, which carry the units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodLine {
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Time of a whole update of the light, µs: for photon streaming of all paths of the pool.
    pub update_us: f64,
    /// Virtual lights that shine, or are placed.
    pub lights: usize,
    /// Time of the picture, ms.
    pub frame_ms: f64,
    /// Mean FLIP of the full picture.
    pub flip: f64,
    /// Relative RMSE of the full picture.
    pub rel_rmse: f64,
    /// Relative RMSE of the indirect light.
    pub rel_rmse_indirect: f64,
    /// How indirect light jerks from frame to frame while the scene moves: [`flicker`]; `None` where nothing moves.
    pub flicker: Option<f64>,
}

impl MethodLine {
    /// The line of a row of results.
    pub fn of_row(row: &Row, flicker: Option<f64>) -> Self {
        Self {
            scene: row.scene.clone(),
            method: row.method.clone(),
            update_us: row.light_ms * 1e3,
            lights: row.vsls_placed.unwrap_or(0),
            frame_ms: row.picture_ms,
            flip: row.flip,
            rel_rmse: row.rel_rmse,
            rel_rmse_indirect: row.rel_rmse_indirect,
            flicker,
        }
    }
}

/// Seconds from one frame to the next.
pub const STEP_S: f64 = 1.0 / 30.0;

/// The root of the mean square of the second differences in time of all values, over their mean: 0 for light that stands
/// still or changes evenly, the larger the more it jumps. `None` for fewer than three frames, or where all is dark.
pub fn flicker(frames: &[Vec<Vec3>]) -> Option<f64> {
    let (mut square, mut sum, mut count) = (0.0f64, 0.0f64, 0usize);
    for triple in frames.windows(3) {
        for ((before, now), after) in triple[0].iter().zip(&triple[1]).zip(&triple[2]) {
            let jerk = (*before - *now * 2.0 + *after).as_dvec3();
            square += jerk.length_squared();
            sum += f64::from(now.element_sum());
            count += 3;
        }
    }
    let (square, mean) = (square / count.max(1) as f64, sum / count.max(1) as f64);
    (mean > 0.0).then(|| square.sqrt() / mean)
}

/// The flicker of `point` while `scene` moves by `animation`, over `frames` frames in small pictures; `None` where nothing
/// moves.
///
/// # Errors
/// Those of the renderer, and [`EvaluateError::Scene`] for an animation that cannot be followed.
pub fn flicker_of(
    bench: &mut Bench,
    point: &Point,
    animation: &Animation,
    frames: usize,
    options: &RenderOptions,
    watch: Watch<'_>,
) -> Result<Option<f64>, EvaluateError> {
    if animation.is_empty() {
        return Ok(None);
    }
    let scene = few::with_settings(&bench.scene, point);
    let mut method = match few::method_of(point.method) {
        Some(method) => Lights::Few(Box::new(FewLights::new(&scene, method))),
        None => Lights::Streamed(Box::new(bench.simulation(point))),
    };
    // Beginning and middle are often rests: a fifth of the way in, something moves.
    let whole_s = animation.end_s().or(animation.period_s());
    let begin_s = whole_s.map_or(1.0, |whole| whole / 5.0);
    let mut pictures: Vec<Vec<Vec3>> = Vec::new();
    for frame in 0..frames {
        watch.check()?;
        let mut edit = scene.edit();
        animation.apply(begin_s + frame as f64 * STEP_S, &mut edit)?;
        let now = edit.finish();
        let film = method.picture(&now, options, watch)?;
        pictures.push(film.layer(LayerKind::Indirect.name())?.pixels.clone());
    }
    Ok(flicker(&pictures))
}

enum Lights {
    Few(Box<FewLights>),
    Streamed(Box<photonstream_simulator::simulation::Simulation>),
}

impl Lights {
    fn picture(
        &mut self,
        scene: &Scene,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Film, EvaluateError> {
        let vsls = match self {
            Self::Few(few) => {
                few.update(scene, STEP_S);
                few::vsls_of(few)?
            }
            Self::Streamed(base) => {
                // The settings of its own scene, in the places of this one.
                let mut version = scene.clone();
                version.streaming = base.scene.streaming.clone();
                few::streamed(base, version)?
            }
        };
        Ok(render(scene, &vsls, options, watch)?.film)
    }
}

/// The methods that a scene is compared by: photon streaming as it is asked for, and all of few lights that it can have.
pub fn methods(scene: &Scene, base: &Point) -> Vec<Point> {
    let photons = scene.vpls.settings.photons;
    let few = [Method::StaticVpl, Method::PhantomVpl, Method::FixedPhotons];
    let few = few.into_iter().filter(|&method| few::is_possible(scene, method));
    std::iter::once(base.clone())
        .chain(few.map(|method| Point { method, vsls: photons, ..base.clone() }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 1, 1, 1 and 1, 2, 3 do not flicker; of 1, 3, 1 the second difference is −4, over 3.
    #[test]
    fn even_changes_do_not_flicker() {
        let frames = |values: [f32; 3]| values.map(|v| vec![Vec3::splat(v)]).to_vec();
        assert_eq!(flicker(&frames([1.0; 3])), Some(0.0));
        assert_eq!(flicker(&frames([1.0, 2.0, 3.0])), Some(0.0));
        assert!((flicker(&frames([1.0, 3.0, 1.0])).unwrap() - 4.0 / 3.0).abs() < 1e-6);
        assert_eq!(flicker(&frames([0.0; 3])), None);
        assert_eq!(flicker(&frames([1.0; 3])[..2]), None);
    }
}
