//! Turns a scene into the virtual lights of a method of few lights, as the simulator publishes them.

use super::photon_streaming;
use crate::{
    EvaluateError,
    point::{Method, Point},
};
use photonstream_renderer::{RenderError, VslSet};
use photonstream_scene::{Method as SceneMethod, Scene, StreamingSettings, Visibility};
use photonstream_simulator::{few_lights::FewLights, records};
use std::sync::Arc;

/// Updates of which the median time counts; one before them warms up.
const UPDATES: usize = 9;

/// The method of the simulator that a method of few lights measures.
pub(crate) fn method_of(method: Method) -> Option<SceneMethod> {
    match method {
        Method::StaticVpl => Some(SceneMethod::StaticVpl),
        Method::PhantomVpl => Some(SceneMethod::PhantomVpl),
        Method::FixedPhotons => Some(SceneMethod::InstantRadiosity),
        _ => None,
    }
}

/// Whether a scene has what a method of few lights needs.
pub(crate) fn is_possible(scene: &Scene, method: Method) -> bool {
    let has_vpls = !scene.vpls.vpls.is_empty();
    let has_spots =
        scene.lights.iter().any(|l| matches!(l.light.shape, photonstream_shading::LightShape::Spot { .. }));
    match method {
        Method::StaticVpl => has_vpls,
        Method::PhantomVpl => has_vpls && has_spots,
        _ => true,
    }
}

/// `scene` with the settings of `point`: photons, seed, and maps where renderers shadow by them.
pub(crate) fn with_settings(scene: &Scene, point: &Point) -> Scene {
    let mut scene = scene.clone();
    if point.method == Method::FixedPhotons {
        let mut vpls = photonstream_scene::VplSet::clone(&scene.vpls);
        vpls.settings.photons = point.vsls;
        scene.vpls = Arc::new(vpls);
    }
    scene.streaming.seed = point.seed;
    scene.streaming.distance_map_px = match point.visibility {
        Visibility::Octahedral => StreamingSettings::default_distance_map_px(1),
        _ => 0,
    };
    scene
}

/// The lights that shine of `few`, in the present state.
pub(crate) fn vsls_of(few: &FewLights) -> Result<VslSet, EvaluateError> {
    let distances = records::distance_records(&few.distance_maps());
    Ok(VslSet::from_records(&few.records(0))?.with_patches(&few.patches()).with_distances(&distances))
}

/// The lights, their number, and the time that an update takes, ms: the median of several.
pub(super) fn lights(scene: &Scene, point: &Point) -> Result<(VslSet, usize, f64), EvaluateError> {
    let method = method_of(point.method).expect("invariant: a method of few lights");
    if !is_possible(scene, point.method) {
        let (option, found) = ("method", point.method.name().to_owned());
        let expected = "another one: the scene has no [[vpl]] tables, or no spot";
        return Err(RenderError::Option { option, found, expected }.into());
    }
    let scene = with_settings(scene, point);
    let mut few = FewLights::new(&scene, method);
    few.update(&scene, 0.0);
    let mut times: Vec<f64> = (0..UPDATES)
        .map(|_| {
            few.update(&scene, 0.0);
            few.update_us()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    Ok((vsls_of(&few)?, few.shining(), times[UPDATES / 2] * 1e-3))
}

/// The lights of a whole pool in `scene`, a version of that of `base`: the same ones, unless something has another size.
pub(crate) fn streamed(
    base: &photonstream_simulator::simulation::Simulation,
    scene: Scene,
) -> Result<VslSet, EvaluateError> {
    let scene = Arc::new(scene);
    let version = if base.has_lights_of(&scene) { base.with_scene(scene) } else { base.reloaded(scene) };
    photon_streaming::lights_of(&version).map(|(vsls, _)| vsls)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use photonstream_scene::SceneConfig;
    use photonstream_simulator::simulation::Simulation;
    use std::path::Path;

    /// While a box over a floor grows, the lights are those of a simulation that begins with it in that size.
    #[test]
    fn what_changes_its_size_has_lights_of_that_size() {
        let scene = SceneConfig::from_text(
            "camera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }\n\
             origin_m = [0, 0, 0]\nmaterial.m.albedo = 0.5\n\
             object.floor = { material = \"m\", quad = { corner_m = [-4, 0, 4], edge_u_m = [8, 0, 0], edge_v_m = [0, 0, -8] } }\n\
             object.crate = { material = \"m\", position_m = [0, 1, 0], box = { size_m = [1, 1, 1] } }\n\
             light.l = { power_w = 9, point = { position_m = [0, 4, 0] } }\n\
             streaming = { vsls = 60, pool_paths = 512 }\n\
             animation = [{ object = \"crate\", property = \"scale\", times_s = [0, 1], values = [1, 1.5] }]\n",
            Path::new("scene.toml"),
        )
        .unwrap()
        .build()
        .unwrap();
        let base = Simulation::new(Arc::new(scene.clone()));
        for time_s in [0.0, 0.5, 1.0] {
            let mut edit = scene.edit();
            scene.animation.apply(time_s, &mut edit).unwrap();
            let now = edit.finish();
            let (of_size, _) = photon_streaming::lights_of(&Simulation::new(Arc::new(now.clone()))).unwrap();
            let streamed = streamed(&base, now).unwrap();
            assert!(streamed == of_size, "{time_s} s");
        }
    }
}
