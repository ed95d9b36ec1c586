//! Turns a scene with predefined virtual point lights into the pictures of paper B's figures, as far as they can be remade.

use crate::{
    EvaluateError,
    flip::{Exposure, flip},
    methods::{Bench, few},
    metrics::compare,
    point::{Method, Point},
    truth::Truth,
};
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, RenderOptions, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{Animation, Scene, Visibility, VplSet, VplSettings, VplVisibility};
use photonstream_simulator::few_lights::FewLights;
use std::sync::Arc;

/// One of the paper's figures, remade.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its number in the paper, and what it shows.
    pub title: &'static str,
    /// Its pictures, from left to right.
    pub shots: Vec<FigureShot>,
}

/// A picture of a figure.
#[derive(Clone, Debug)]
pub struct FigureShot {
    /// What it is of.
    pub what: String,
    /// Layers full and indirect.
    pub film: Film,
    /// Lights that shine.
    pub lights: usize,
    /// Relative RMSE of the full picture and FLIP, where there is a reference that is not black: the scene as it is loaded.
    pub errors: Option<(f64, f64)>,
}

/// Moments of the figure of something that opens, as shares of its animation's first third.
const MOMENTS: [f64; 4] = [0.0, 0.3, 0.5, 1.0];

/// Distance of the second bounce where the scene has none, m: the paper's script.
const SECOND_BOUNCE_M: f32 = 1.0;

/// The photons of paper B's figure 12.
const PHOTONS: [u32; 3] = [1, 20, 200];

/// All figures of a scene, whose reference is of the moment `reference_s`; none without predefined VPLs.
///
/// # Errors
/// Those of the renderer, and of animations that cannot be followed.
pub fn figures(
    bench: &Bench,
    base: &Point,
    (animation, reference_s): (&Animation, f64),
    truth: &Truth,
    watch: Watch<'_>,
) -> Result<Vec<Figure>, EvaluateError> {
    let scene = &*bench.scene;
    if scene.vpls.vpls.is_empty() {
        return Ok(Vec::new());
    }
    let has_phantoms = few::is_possible(scene, Method::PhantomVpl);
    let own = if has_phantoms { Method::PhantomVpl } else { Method::StaticVpl };
    let studio = Studio { bench, truth, watch };
    let point = |method| Point { method, visibility: Visibility::Rays, ..base.clone() };
    let mut figures = Vec::new();
    let mut add = |title, shots: Vec<FigureShot>| figures.push(Figure { title, shots });

    let unshadowed = Point { visibility: Visibility::None, ..point(own) };
    add(
        "Figure 4: shadows of indirect light",
        vec![studio.shot("without", &unshadowed, scene)?, studio.shot("with, by rays", &point(own), scene)?],
    );
    if !scene.vpls.blockers.is_empty() {
        let ways = [
            ("nothing between lights and VPLs", VplVisibility::None),
            ("blockers", VplVisibility::Blockers),
            ("true rays", VplVisibility::Rays),
        ];
        let shots = ways.map(|(what, visibility)| {
            let scene = with(scene, |settings| settings.visibility = visibility);
            studio.shot(what, &point(Method::StaticVpl), &scene)
        });
        add("Figure 5: what keeps light from VPLs", shots.into_iter().collect::<Result<_, _>>()?);
    }
    let distance = Some(scene.vpls.settings.second_bounce_distance).filter(|&d| d > 0.0);
    let bounces = [("one", 0.0), ("two", distance.unwrap_or(SECOND_BOUNCE_M))].map(|(what, distance)| {
        let scene = with(scene, |settings| settings.second_bounce_distance = distance);
        studio.shot(what, &point(own), &scene)
    });
    add("Figure 6: bounces", bounces.into_iter().collect::<Result<_, _>>()?);
    if has_phantoms {
        add(
            "Figures 9 and 11: the variants",
            vec![
                studio.shot("static VPLs", &point(Method::StaticVpl), scene)?,
                studio.shot("phantom VPL", &point(Method::PhantomVpl), scene)?,
            ],
        );
    }
    let moves = !animation.is_empty() && scene.vpls.blockers.iter().any(|b| b.object.is_some());
    if let Some(end_s) = animation.end_s().or(animation.period_s()).filter(|_| moves) {
        let shots = MOMENTS.map(|share| {
            let time_s = share * end_s / 3.0;
            let mut edit = scene.edit();
            animation.apply(time_s, &mut edit)?;
            let shot =
                studio.shot(&format!("at {time_s:.1} s"), &point(Method::StaticVpl), &edit.finish())?;
            // The reference is of one moment.
            Ok::<_, EvaluateError>(FigureShot {
                errors: shot.errors.filter(|_| time_s == reference_s),
                ..shot
            })
        });
        add("Figure 10: blockers that move", shots.into_iter().collect::<Result<_, _>>()?);
    }
    let photons = PHOTONS.map(|vsls| {
        let point = Point { vsls, ..point(Method::FixedPhotons) };
        let plural = if vsls == 1 { "" } else { "s" };
        studio.shot(&format!("{vsls} photon{plural}"), &point, scene)
    });
    let mut shots: Vec<FigureShot> = photons.into_iter().collect::<Result<_, _>>()?;
    shots.push(studio.shot("predefined VPLs", &point(own), scene)?);
    add("Figure 12: instant radiosity", shots);
    Ok(figures)
}

fn with(scene: &Scene, change: impl FnOnce(&mut VplSettings)) -> Scene {
    let mut scene = scene.clone();
    let mut vpls = VplSet::clone(&scene.vpls);
    change(&mut vpls.settings);
    scene.vpls = Arc::new(vpls);
    scene
}

struct Studio<'a> {
    bench: &'a Bench,
    truth: &'a Truth,
    watch: Watch<'a>,
}

impl Studio<'_> {
    fn shot(&self, what: &str, point: &Point, scene: &Scene) -> Result<FigureShot, EvaluateError> {
        let method = few::method_of(point.method).expect("invariant: a method of few lights");
        let scene = few::with_settings(scene, point);
        let mut lights = FewLights::new(&scene, method);
        lights.update(&scene, 0.0);
        let options: RenderOptions = self.bench.options(point);
        let film = render(&scene, &few::vsls_of(&lights)?, &options, self.watch)?.film;
        let full = LayerKind::Full.name();
        // A black reference is no measure of anything.
        let rel_rmse = compare(&film, &self.truth.film, full).ok().map(|c| c.whole.rel_rmse);
        let exposure = Exposure { ev: scene.render.exposure_ev, tone_map: scene.render.tone_map };
        let (own, truth) = (&film.layer(full)?.pixels, &self.truth.film.layer(full)?.pixels);
        let flip = flip(film.width(), film.height(), own, truth, exposure).mean;
        Ok(FigureShot {
            what: what.to_owned(),
            lights: lights.shining(),
            errors: rel_rmse.map(|rel_rmse| (rel_rmse, flip)),
            film,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::truth::truth;
    use photonstream_scene::SceneConfig;
    use std::path::Path;

    /// The figures of the door room, with a reference of the moment `time_s`, 32 × 24 pixels of 16 paths.
    fn figures_at(time_s: f64) -> Vec<Figure> {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/door-room.toml");
        let config = SceneConfig::from_file(&config).unwrap();
        let animation = config.clone().build().unwrap().animation;
        let mut scene = config.at(time_s).unwrap().build().unwrap();
        scene.animation = Arc::default();
        let scene = Arc::new(scene);
        let folder = tempfile::tempdir().unwrap();
        let truth = truth(&scene, (32, 24), 16, folder.path(), Watch::default()).unwrap();
        let bench = Bench::new(Arc::clone(&scene), (32, 24));
        let base = Point::of_scene(&scene, 1);
        figures(&bench, &base, (&animation, time_s), &truth, Watch::default()).unwrap()
    }

    /// A reference of the open door says how wrong the picture of that moment is, and of no other.
    #[test]
    fn errors_are_of_the_moment_of_the_reference() {
        let figures = figures_at(5.0);
        let door = figures.iter().find(|figure| figure.title.starts_with("Figure 10")).unwrap();
        let has_errors: Vec<bool> = door.shots.iter().map(|shot| shot.errors.is_some()).collect();
        assert_eq!(has_errors, [false, false, false, true], "at 0, 1.5, 2.5 and 5 s");
    }

    /// The door room has all figures but those of spots; closed, the room has no light, open it has.
    #[test]
    fn a_scene_with_blockers_has_its_figures() {
        let figures = figures_at(0.0);
        let titles: Vec<_> = figures.iter().map(|f| f.title.split(':').next().unwrap()).collect();
        assert_eq!(titles, ["Figure 4", "Figure 5", "Figure 6", "Figure 10", "Figure 12"]);
        let door = &figures[3].shots;
        assert!(door.windows(2).all(|pair| pair[1].lights >= pair[0].lights), "{door:?}");
        let counts: Vec<usize> = door.iter().map(|shot| shot.lights).collect();
        assert!(door[1..].iter().all(|shot| shot.errors.is_none()), "the reference is of the beginning");
        assert!(counts[3] > counts[0] + 3, "{counts:?}");
        // Without anything between, the sun shines into the closed room.
        let between: Vec<usize> = figures[1].shots.iter().map(|shot| shot.lights).collect();
        assert!(between[0] > between[1], "{between:?}");
    }
}
