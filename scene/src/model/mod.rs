//! Turns a model file into a scene config that shows and lights it.

mod enclosure;
mod exposure;
mod file;
mod floor;
mod frame;
mod lighting;
mod survey;
mod text;
mod view;

use crate::{
    bvh::Ray,
    config::{SceneConfig, UpAxis},
    error::SceneError,
    import::FileCamera,
    scene::Scene,
};
use file::{Kind, ModelFile};
use floor::Floor;
use glam::Vec3;
use lighting::Added;
use std::path::Path;
use survey::Survey;
use view::View;

/// What is known of a model file that the file does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelOptions {
    /// The axis of the file that points up; chosen where none is given.
    pub up_axis: Option<UpAxis>,
    /// Metres in a unit of the file; chosen where none is given.
    pub unit_m: Option<f64>,
}

/// A scene file for a model, and how it came about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelScene {
    /// The scene file: TOML, with what was chosen in comments.
    pub text: String,
    /// What was chosen, one sentence each.
    pub choices: Vec<String>,
}

/// Share of the camera's rays that may meet backs before both sides of a file without materials of its own reflect.
const BACKS_SEEN: f64 = 0.005;
/// The same of the rays from all fronts. Floors in bodies that stand on them see backs, too.
const BACKS_OF_ALL: f64 = 0.1;

/// Share of all rays that leave a room from within from which on it is open.
const OPEN: f64 = 0.03;

/// Whether `path` is called like a model: `.glb`, `.gltf`, `.obj` or `.ply`, in any case.
pub fn is_model(path: &Path) -> bool {
    Kind::of(path).is_some()
}

impl ModelScene {
    /// A scene of the model at `path`, relative to the working directory.
    ///
    /// Chosen are up axis and unit (OBJ and PLY), sides, camera (the file's first, if it has one), a floor below what lies
    /// on nothing, a sun or lamps where there is no light, the number of virtual surface lights, pool, and exposure. The
    /// same file gives the same text on every machine, but for its path.
    ///
    /// # Errors
    /// If the file cannot be read, or is no valid model.
    pub fn of(path: &Path, options: &ModelOptions) -> Result<Self, SceneError> {
        let mut file = ModelFile::open(path, options)?;
        let mut scene = file.scene()?;
        let mut choices = Vec::new();
        let is_interior = enclosure::is_interior(&scene);
        let mut survey = Survey::of(&scene);
        if file.choose_frame(options, &scene, &survey, is_interior, &mut choices) {
            scene = file.scene()?;
            survey = Survey::of(&scene);
        }
        if !scene.animation.is_empty() {
            choices.push("animation: the first of the file plays, again and again".into());
        }
        let (view, is_inside) = choose_view(&file, &scene, &survey, is_interior, &mut choices);
        choose_sides(&mut file, &scene, &view, &survey, &mut choices);
        let floor = if is_interior { None } else { Floor::below(&scene, &mut choices) };
        let added = choose_light(&scene, &view, is_interior, &mut choices);
        let vsls = choose_vsls(&file, &scene, &view, (survey, is_inside, &floor), &mut choices);
        let mut chosen = text::Chosen {
            file: &file,
            origin: scene.origin_m,
            view,
            floor,
            added,
            vsls,
            exposure_ev: 0.0,
            choices: Vec::new(),
        };
        let lit = SceneConfig::from_text(&chosen.text(), path)?.build().map_err(file::without_table)?;
        choices.push(match exposure::exposure_ev(&lit) {
            Some(stops) => {
                chosen.exposure_ev = stops;
                format!("exposure: {stops:+.1} stops make what the camera sees middle grey")
            }
            None => "exposure: 0 stops: the camera sees no light".into(),
        });
        chosen.choices = choices.clone();
        Ok(Self { text: chosen.text(), choices })
    }
}

/// The config that stands in for the scene file of a model.
pub(crate) fn config(path: &Path) -> Result<SceneConfig, SceneError> {
    let ModelScene { text, choices } = ModelScene::of(path, &ModelOptions::default())?;
    // Errors name the model, and no line of a text that nobody has seen.
    Ok(SceneConfig::from_text(&text, path)?.without_text(choices))
}

/// The file's camera, else one in its room, else one outside; and whether it is in the room.
fn choose_view(
    file: &ModelFile,
    scene: &Scene,
    survey: &Survey,
    is_interior: bool,
    choices: &mut Vec<String>,
) -> (View, bool) {
    if let Some((camera, view)) = file.view(scene.origin_m) {
        let FileCamera { node, .. } = camera;
        choices.push(format!("camera: \"{node}\", the first of the file"));
        return (view, is_interior);
    }
    let is_open_sideways = survey.open_share > OPEN && survey.opening.y.abs() < 0.5;
    if is_interior
        && is_open_sideways
        && let Some(view) = view::through_opening(scene, survey.opening)
    {
        choices.push("camera: into the room, from the side to which it is open".into());
        return (view, false);
    }
    if is_interior && let Some(view) = view::inside(scene) {
        choices.push("camera: inside, along the farthest view: rays from the middle hardly leave it".into());
        return (view, true);
    }
    choices.push(
        "camera: outside, from the right of its front (+z) and above, with all of it in the picture".into(),
    );
    (view::outside(scene.bvh.bounds()), false)
}

fn choose_sides(
    file: &mut ModelFile,
    scene: &Scene,
    view: &View,
    survey: &Survey,
    choices: &mut Vec<String>,
) {
    if file.kind == Kind::Gltf {
        return;
    }
    let directions = view.directions(128, 96);
    let sees_back = |direction: &&Vec3| {
        let ray = Ray { origin: view.position, direction: **direction, t_max: f32::INFINITY };
        let hit = scene.bvh.closest(&ray);
        hit.is_some_and(|hit| scene.geometry.normals[hit.triangle as usize].dot(**direction) > 0.0)
    };
    let backs = directions.iter().filter(sees_back).count() as f64 / directions.len().max(1) as f64;
    file.two_sided = backs > BACKS_SEEN || survey.backs_seen > BACKS_OF_ALL;
    choices.push(if file.two_sided {
        "sides: both, as backs of faces are seen".into()
    } else {
        "sides: front, as hardly any backs of faces are seen".into()
    });
}

fn choose_light(scene: &Scene, view: &View, is_interior: bool, choices: &mut Vec<String>) -> Option<Added> {
    if scene.lights.iter().any(|light| light.light.power.max_element() > 0.0) {
        choices.push(format!("light: what the file has: {}", scene.lights.len()));
        return None;
    }
    let added = if is_interior { lighting::of_room(scene, view) } else { lighting::over_the_shoulder(view) };
    choices.push(match &added {
        Added::Sun { .. } if is_interior => {
            "light: a sun was added, as the file has none; from where it lights most of what is seen".into()
        }
        Added::Sun { .. } => {
            "light: a sun was added, as the file has none; from behind the camera, over its shoulder".into()
        }
        Added::Lamps(lamps) => {
            let number = lamps.len();
            format!("light: point lights were added to the closed room, as the file has none: {number}")
        }
    });
    Some(added)
}

/// So many that they are a fifteenth of the radius of what is shown apart; in a room an eighth of the mean distance.
fn choose_vsls(
    file: &ModelFile,
    scene: &Scene,
    view: &View,
    (survey, is_inside, floor): (Survey, bool, &Option<Floor>),
    choices: &mut Vec<String>,
) -> u32 {
    let spacing = if is_inside {
        let directions = view.directions(32, 24).into_iter();
        let distances: Vec<f32> = directions
            .filter_map(|direction| {
                let ray = Ray { origin: view.position, direction, t_max: f32::INFINITY };
                scene.bvh.closest(&ray).map(|hit| hit.t)
            })
            .collect();
        f64::from(distances.iter().sum::<f32>() / distances.len().max(1) as f32) / 8.0
    } else {
        f64::from(scene.bounds.radius) / 15.0
    };
    let sides = if file.two_sided { 2.0 } else { 1.0 };
    let area = survey.area_sq_m * sides + floor.as_ref().map_or(0.0, Floor::area_sq_m);
    let vsls = ((area / (spacing * spacing) / 500.0).round() * 500.0).clamp(1000.0, 8000.0) as u32;
    choices.push(format!(
        "streaming: {vsls} virtual surface lights and {} paths for its area",
        text::pool_paths(vsls)
    ));
    vsls
}
