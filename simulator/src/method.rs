//! Turns a scene and the time that an update of its light may take into the method that is used, and into reasons.

use crate::few_lights;
use photonstream_scene::{Method, PhantomSurfaces, Scene, VplVisibility};
use photonstream_shading::LightShape;

/// The method that is used, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Never [`Method::Auto`].
    pub method: Method,
    /// Why, one sentence each; none where the config names the method.
    pub reasons: Vec<String>,
}

/// What an update costs on one core of about 3 GHz, ns: whole updates were measured, so these are orders of magnitude, which
/// is what tells the methods apart.
mod cost_ns {
    /// A path of a few bounces, traced and deposited.
    pub(super) const PATH: f64 = 1000.0;
    /// A ray.
    pub(super) const RAY: f64 = 350.0;
    /// A VPL and a light, or the same for a phantom's interpolation.
    pub(super) const VPL: f64 = 6.0;
    /// A blocker between them.
    pub(super) const BLOCKER: f64 = 3.5;
    /// A proxy and an axis.
    pub(super) const PROXY: f64 = 30.0;
    /// A comparison of two photons on the way to their areas, of which there are N^1.5.
    pub(super) const COMPARISON: f64 = 5.0;
}

/// The method of a scene: what its config names, and for `auto` the most exact one whose update is expected to fit into
/// `streaming.update_budget_us`.
///
/// Photon streaming comes first, which is exact in the limit; where all lights are spots, phantoms before static VPLs,
/// since they follow a beam; of what does not fit, the fastest.
pub fn choose(scene: &Scene) -> Choice {
    let named = scene.streaming.method;
    if named != Method::Auto {
        return Choice { method: named, reasons: Vec::new() };
    }
    let chosen = |method, reasons| Choice { method, reasons };
    let Some(budget_us) = scene.streaming.update_budget_us else {
        let reason =
            "no streaming.update_budget_us: photon-streaming, which is exact in the limit".to_owned();
        return chosen(Method::PhotonStreaming, vec![reason]);
    };
    let are_spots = !scene.lights.is_empty() && scene.lights.iter().all(few_lights::is_spot);
    let has_sky = scene.sky.is_some();
    let order: &[Method] = match (scene.vpls.vpls.is_empty() || has_sky, are_spots) {
        (true, _) => &[Method::PhotonStreaming, Method::InstantRadiosity],
        (false, true) => &[Method::PhotonStreaming, Method::PhantomVpl, Method::StaticVpl],
        (false, false) => &[Method::PhotonStreaming, Method::StaticVpl, Method::PhantomVpl],
    };
    let mut reasons = Vec::new();
    if scene.vpls.vpls.is_empty() {
        reasons.push("no [[vpl]] tables: static-vpl and phantom-vpl have nothing to light".to_owned());
    }
    if has_sky && !scene.vpls.vpls.is_empty() {
        reasons.push("a sky: it lights no VPL".to_owned());
    }
    let mut fastest = (f64::INFINITY, order[0]);
    for &method in order {
        let expected_us = expected_us(scene, method);
        let fits = expected_us <= budget_us;
        let than = if fits { "within" } else { "more than" };
        reasons.push(format!("{}: about {expected_us:.0} µs, {than} {budget_us} µs", method.name()));
        if fits {
            return chosen(method, reasons);
        }
        if expected_us < fastest.0 {
            fastest = (expected_us, method);
        }
    }
    reasons.push(format!("none fits: {}, the fastest", fastest.1.name()));
    chosen(fastest.1, reasons)
}

/// What a whole update of the light is expected to take on one core, µs.
pub fn expected_us(scene: &Scene, method: Method) -> f64 {
    let set = &*scene.vpls;
    let vpls = set.vpls.len() as f64;
    let spots = scene.lights.iter().filter(|light| few_lights::is_spot(light)).count() as f64;
    let samples = |light: &photonstream_scene::SceneLight| match light.light.shape {
        LightShape::Sky { .. } => 0.0,
        _ if light.light.shape.is_delta() => 1.0,
        _ => f64::from(few_lights::POINTS),
    };
    let samples: f64 = scene.lights.iter().map(samples).sum();
    let between = match set.settings.visibility {
        VplVisibility::None => 0.0,
        VplVisibility::Blockers => cost_ns::BLOCKER * set.blockers.len() as f64,
        VplVisibility::Rays => cost_ns::RAY,
    };
    // Second bounces need what each light alone does.
    let updates = if set.settings.second_bounce_distance > 0.0 { 2.0 } else { 1.0 };
    let statics = |samples: f64| updates * vpls * samples * (cost_ns::VPL + between);
    let axis = match set.settings.phantom_surfaces {
        PhantomSurfaces::Scene => cost_ns::RAY,
        PhantomSurfaces::Proxies => cost_ns::PROXY * set.proxies.len() as f64,
    };
    let ns = match method {
        Method::PhotonStreaming | Method::Auto => f64::from(scene.streaming.pool_paths) * cost_ns::PATH,
        Method::StaticVpl => statics(samples),
        Method::PhantomVpl => statics(samples - spots) + spots * (axis + vpls * cost_ns::VPL),
        Method::InstantRadiosity => {
            let photons = f64::from(set.settings.photons);
            photons * cost_ns::RAY + photons.powf(1.5) * cost_ns::COMPARISON
        }
    };
    ns * 1e-3
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use photonstream_scene::SceneConfig;
    use std::path::Path;

    const SCENE: &str = r#"
        camera = { position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }
        material.m.albedo = 0.5
        object.floor = { material = "m", quad = { corner_m = [-2, 0, 2], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -4] } }
        light.l = { power_w = 10, spot = { position_m = [0, 2, 0], target_m = [0, 0, 0], outer_half_angle_deg = 20 } }
    "#;
    const VPL: &str = "[[vpl]]\nposition_m = [0, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n";

    fn chosen(streaming: &str, vpls: usize) -> Choice {
        let text = format!("{SCENE}\n[streaming]\n{streaming}\n{}", VPL.repeat(vpls));
        let config = SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap();
        choose(&config.build().unwrap())
    }

    /// The default pool takes about 0.13 s, 64 photons 25 µs, a phantom less than 1 µs.
    #[test]
    fn the_most_exact_method_that_fits_is_chosen() {
        let method = |streaming: &str, vpls| chosen(streaming, vpls).method;
        assert_eq!(method("method = \"auto\"", 3), Method::PhotonStreaming);
        assert_eq!(method("method = \"auto\"\nupdate_budget_us = 1e6", 3), Method::PhotonStreaming);
        assert_eq!(method("method = \"auto\"\nupdate_budget_us = 100", 3), Method::PhantomVpl);
        assert_eq!(method("method = \"auto\"\nupdate_budget_us = 100", 0), Method::InstantRadiosity);
        // Nothing fits into a nanosecond: three VPLs are faster lit than a ray is traced.
        assert_eq!(method("method = \"auto\"\nupdate_budget_us = 0.001", 3), Method::StaticVpl);
        let named = chosen("method = \"static-vpl\"\nupdate_budget_us = 100", 3);
        assert_eq!(named, Choice { method: Method::StaticVpl, reasons: vec![] });
        let reasons = chosen("method = \"auto\"\nupdate_budget_us = 100", 3).reasons;
        assert_eq!(reasons.len(), 2, "{reasons:?}");
        assert!(
            reasons[0].contains("more than 100 µs") && reasons[1].contains("within 100 µs"),
            "{reasons:?}"
        );
    }

    /// By hand, with the costs above: 100 photons take 35 µs and their areas 5 µs, 10 000 take 3.5 ms and theirs 5 ms; three
    /// VPLs 18 ns under one light, and as much again for a second bounce. Tolerance: roundings.
    #[test]
    fn all_that_an_update_does_is_expected() {
        let expected = |tables: &str, method| {
            let text = format!("{SCENE}\n{tables}\n{}", VPL.repeat(3));
            expected_us(
                &SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap().build().unwrap(),
                method,
            )
        };
        let is = |found: f64, us: f64| assert!((found / us - 1.0).abs() < 1e-9, "{found}, {us}");
        is(expected("vpls.photons = 100", Method::InstantRadiosity), 40.0);
        is(expected("vpls.photons = 10000", Method::InstantRadiosity), 8500.0);
        is(expected("", Method::StaticVpl), 0.018);
        is(expected("vpls.second_bounce_distance_m = 1", Method::StaticVpl), 0.036);
    }

    /// A sky lights no VPL: photons are traced there, however fast VPLs would be.
    #[test]
    fn a_sky_is_not_left_to_vpls() {
        let text = format!(
            "{SCENE}\nlight.s = {{ sky = {{ radiance_w_m2_sr = 1 }} }}\n[streaming]\nmethod = \"auto\"\nupdate_budget_us = 100\n{VPL}"
        );
        let config = SceneConfig::from_text(&text, Path::new("scene.toml")).unwrap();
        let choice = choose(&config.build().unwrap());
        assert_eq!(choice.method, Method::InstantRadiosity, "{:?}", choice.reasons);
        assert!(choice.reasons.iter().any(|reason| reason.contains("sky")), "{:?}", choice.reasons);
    }
}
