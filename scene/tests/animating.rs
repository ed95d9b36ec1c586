//! Checks that an animated scene at any time is the one of the config frozen there, bit for bit, and that bad animations
//! are told.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{AssetRoots, Scene, SceneConfig};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// Every kind of target, property, interpolation and repetition.
const TEXT: &str = r#"
[camera]
position_m = [0, 0, 4]
target_m = [0, 0, 0]
vertical_fov_deg = 40
[material.white]
albedo = 0.7
[object.room]
material = "white"
sides = "back"
box = { size_m = [6, 6, 6] }
[object.ball]
material = "white"
sphere = { radius_m = 0.3, segments = 24 }
[object.crate]
material = "white"
position_m = [0.5, 0, 0]
box = { size_m = [0.3, 0.7, 0.4], centre_m = [0.15, 0, 0] }
[object.file]
material = "white"
obj = { path = "pair.obj" }
[light.bulb]
power_w = 3
point = { position_m = [0.7, 0.9, 0.1] }
[light.cone]
power_w = 5
spot = { position_m = [0.1, 1.3, 0.2], direction = [0, -1, 0], outer_half_angle_deg = 40 }
[light.lamp]
power_w = 5
rectangle = { corner_m = [-0.1, 1.3, -0.1], edge_u_m = [0.3, 0, 0], edge_v_m = [0, 0, 0.3] }
[light.sun]
irradiance_w_m2 = 2
directional = { direction = [1, -3, 2] }
[[animation]]
object = "ball"
property = "position_m"
orbit = { centre_m = [0.1, 0.2, 0.3], axis = [0.3, 1, 0.1], radius_m = 0.7, period_s = 3, phase_deg = 20 }
[[animation]]
object = "ball"
property = "scale"
times_s = [0, 1, 2.5]
values = [1, [0.5, 1.5, 0.7], 1.3]
[[animation]]
object = "crate"
property = "rotation_deg"
times_s = [0.5, 2]
values = [[0, 0, 0], [10, 200, -30]]
interpolation = "smooth"
repeat = "bounce"
[[animation]]
object = "crate"
property = "scale"
times_s = [0, 1.5, 3]
values = [1, -1, [1, 2, -1]]
interpolation = "step"
[[animation]]
object = "file"
property = "position_m"
times_s = [0, 2]
values = [[0, -1, 0], [0.3, -0.4, 0.1]]
repeat = "once"
[[animation]]
light = "bulb"
property = "position_m"
orbit = { centre_m = [0, 0.4, 0], axis = [1, 0, 0], radius_m = 0.3, period_s = 1.7 }
repeat = "bounce"
[[animation]]
light = "bulb"
property = "power_w"
times_s = [0, 0.3, 1]
values = [0, [3, 2, 1], 0]
interpolation = "smooth"
[[animation]]
light = "cone"
property = "target_m"
times_s = [0, 1, 4]
values = [[0, 0, 0], [1, -1, 0], [0, 0, 0]]
[[animation]]
light = "cone"
property = "position_m"
times_s = [0, 2]
values = [[0, 1.1, 0], [0.3, 1.4, 0.2]]
[[animation]]
light = "lamp"
property = "rotation_deg"
times_s = [0, 3]
values = [[0, 0, 0], [0, 360, 40]]
[[animation]]
light = "lamp"
property = "power_w"
times_s = [0, 3]
values = [1, 2]
[[animation]]
light = "lamp"
property = "scale"
times_s = [0, 3]
values = [-1, [-2, -1, -1]]
[[animation]]
light = "sun"
property = "direction"
times_s = [0, 5]
values = [[1, -3, 2], [-1, -3, 2]]
[[animation]]
light = "sun"
property = "irradiance_w_m2"
times_s = [0, 5]
values = [2, [1, 0, 7]]
"#;

/// The config of `text`, and the folder of its asset, which goes when it is dropped.
fn config(text: &str) -> (SceneConfig, AssetRoots, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 2 3\ng b\nf 1 2 4\n";
    std::fs::write(folder.path().join("pair.obj"), obj).unwrap();
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    (SceneConfig::from_text(text, Path::new("test.toml")).unwrap_or_else(|e| panic!("{e}")), roots, folder)
}

fn error(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let roots = AssetRoots { folders: vec![folder.path().to_owned()] };
    let built = SceneConfig::from_text(text, Path::new("test.toml")).and_then(|c| c.build_with(&roots));
    built.expect_err("an error").to_string()
}

fn assert_same(animated: &Scene, frozen: &Scene, time: f64) {
    assert!(animated.geometry == frozen.geometry, "vertices, normals or triangles differ at {time} s");
    assert_eq!((animated.origin_m, animated.bounds), (frozen.origin_m, frozen.bounds), "{time} s");
    assert_eq!((&animated.objects, &animated.lights), (&frozen.objects, &frozen.lights), "{time} s");
    assert_eq!((&animated.materials, animated.camera), (&frozen.materials, frozen.camera), "{time} s");
}

fn at(scene: &Scene, time: f64) -> Scene {
    let mut edit = scene.edit();
    scene.animation.apply(time, &mut edit).unwrap();
    edit.finish()
}

/// 20 instants over about two rounds, forwards and back, so that each is reached from different states.
fn assert_frozen_where_animated(config: &SceneConfig, scene: &Scene, roots: &AssetRoots) {
    let build = |config: SceneConfig| config.build_with(roots).unwrap_or_else(|e| panic!("{e}"));
    let step = scene.animation.period_s().unwrap_or(7.0) / 9.7;
    let mut last = scene.clone();
    let mut changed = 0;
    for i in (0..20).chain((0..20).rev()) {
        let time = f64::from(i) * step;
        last = at(&last, time);
        last.bvh.validate().unwrap();
        let frozen = build(config.at(time).unwrap());
        assert_same(&last, &frozen, time);
        assert!(frozen.animation.is_empty() && frozen.features.moving_objects == 0);
        changed += u32::from(last.geometry != scene.geometry || last.lights != scene.lights);
    }
    assert!(changed > 20, "only {changed} of 40 differ from the beginning");
    assert_same(scene, &build(config.at(0.0).unwrap()), 0.0);
}

#[test]
fn an_animated_scene_is_the_frozen_config_at_every_time() {
    let (mut config, roots, _folder) = config(TEXT);
    let scene = config.clone().build_with(&roots).unwrap();
    // A config of an origin of its own, since `at` does not know the roots.
    config.origin_m = Some(scene.origin_m.into());
    assert_frozen_where_animated(&config, &scene, &roots);
    assert_ne!(at(&scene, 1.3).geometry, scene.geometry);
    assert_ne!(at(&scene, 1.3).lights, scene.lights);
    let resolved = SceneConfig::from_text(&scene.resolved_text, Path::new("resolved")).unwrap();
    assert_frozen_where_animated(&resolved, &scene, &roots);
}

#[test]
fn every_animated_config_is_the_frozen_config_at_every_time() {
    let mut count = 0;
    for name in ["cornell-light.toml", "cornell-ball.toml", "door-room.toml"] {
        let path = folder().join(name);
        let config = SceneConfig::from_file(&path).unwrap();
        let scene = Scene::load(&path).unwrap();
        assert!(scene.animation.period_s().is_some());
        let roots = AssetRoots::from_environment(&path);
        assert_frozen_where_animated(&config, &scene, &roots);
        count += 1;
    }
    assert_eq!(count, 3);
}

#[test]
fn animations_resolve_to_themselves_in_any_order() {
    let (config_a, roots, _folder) = config(TEXT);
    let scene = config_a.clone().build_with(&roots).unwrap();
    let again = Scene::from_resolved(&scene.resolved_text).unwrap();
    assert_eq!((again.hash, &again.resolved_text), (scene.hash, &scene.resolved_text));
    assert_eq!(again.animation, scene.animation);
    assert_same(&at(&again, 1.1), &at(&scene, 1.1), 1.1);
    let mut reversed = config_a.clone();
    reversed.animation.reverse();
    assert_eq!(reversed.build_with(&roots).unwrap().hash, scene.hash);
    // Numbers, or three equal ones; and what is animated need not be said otherwise.
    for (from, to) in [("values = [1, 2]", "values = [[1, 1, 1], 2]"), ("power_w = 3\n", "")] {
        let text = TEXT.replacen(from, to, 1);
        assert_ne!(text, TEXT);
        let same = SceneConfig::from_text(&text, Path::new("test.toml")).unwrap();
        assert_eq!(same.build_with(&roots).unwrap().hash, scene.hash, "{to}");
    }
    let other =
        SceneConfig::from_text(&TEXT.replace("period_s = 3", "period_s = 3.1"), Path::new("test.toml"));
    assert_ne!(other.unwrap().build_with(&roots).unwrap().hash, scene.hash);
}

#[test]
fn features_say_what_moves() {
    let (config, roots, _folder) = config(TEXT);
    let scene = config.build_with(&roots).unwrap();
    // Ball, crate, lamp and both parts of the file; bulb, cone, lamp, sun.
    assert_eq!((scene.features.moving_objects, scene.features.moving_lights), (5, 4));
    let motion = scene.features.decisions().into_iter().find(|d| d.what == "motion").unwrap();
    assert!(motion.modelled);
    assert_eq!(motion.reason, "5 of 6 objects and 4 of 4 lights move");
    let door = Scene::load(&folder().join("door-room.toml")).unwrap();
    assert_eq!((door.features.moving_objects, door.features.moving_lights), (2, 0));
}

#[test]
fn periods_are_common_to_all() {
    let load = |name: &str| Scene::load(&folder().join(name)).unwrap().animation;
    assert_eq!(load("door-room.toml").period_s(), Some(15.0));
    assert_eq!(load("cornell-box.toml").period_s(), None);
    let period = |periods: &[&str]| {
        let tables: String = periods
            .iter()
            .zip(["ball", "crate", "room"])
            .map(|(rest, name)| {
                format!("[[animation]]\nobject = \"{name}\"\nproperty = \"rotation_deg\"\nvalues = [[0, 0, 0], [1, 0, 0]]\n{rest}\n")
            })
            .collect();
        let text = format!("{}{tables}", TEXT.split_once("[[animation]]").unwrap().0);
        let (config, roots, _folder) = config(&text);
        config.build_with(&roots).unwrap().animation.period_s()
    };
    assert_eq!(period(&["times_s = [0, 2]", "times_s = [0, 3]"]), Some(6.0));
    assert_eq!(
        period(&["times_s = [0, 2]", "times_s = [0, 3]\nrepeat = \"bounce\"", "times_s = [0, 1.5]"]),
        Some(6.0)
    );
    assert_eq!(period(&["times_s = [0, 2]", "times_s = [0, 3]\nrepeat = \"once\""]), None);
    assert_eq!(period(&["times_s = [0, 3.14159]", "times_s = [0, 1.41421]"]), None);
}

/// The spot meets its own target after 1 s, in the middle of its way.
#[test]
fn a_time_that_cannot_be_shown_changes_nothing() {
    let cone = "[[animation]]\nlight = \"cone\"\nproperty = \"position_m\"\ntimes_s = [0, 2]\nvalues = [[0, 1, 0], [0, -1, 0]]\n";
    let target =
        "[[animation]]\nlight = \"cone\"\nproperty = \"target_m\"\ntimes_s = [0]\nvalues = [[0, 0, 0]]\n";
    let bulb = "[[animation]]\nlight = \"bulb\"\nproperty = \"power_w\"\ntimes_s = [0, 2]\nvalues = [1, 2]\n";
    let ball = "[[animation]]\nobject = \"ball\"\nproperty = \"scale\"\ntimes_s = [0, 2]\nvalues = [1, 2]\n";
    let text = format!("{}{cone}{target}{bulb}{ball}", TEXT.split_once("[[animation]]").unwrap().0);
    let (config, roots, _folder) = config(&text);
    let scene = config.build_with(&roots).unwrap();
    let mut edit = scene.edit();
    let error = scene.animation.apply(1.0, &mut edit).unwrap_err().to_string();
    assert!(error.contains("light.cone.spot.target_m: found the light's own position"), "{error}");
    assert_same(&edit.finish(), &scene, 1.0);
    assert_ne!(at(&scene, 1.5).lights, scene.lights);
}

#[test]
fn nothing_moves_without_time() {
    let scene = Scene::load(&folder().join("cornell-ball.toml")).unwrap();
    for time in [0.0, 9.0, -18.0] {
        assert!(std::sync::Arc::ptr_eq(&at(&scene, time).geometry, &scene.geometry), "{time}");
    }
    for time in [f64::NAN, f64::INFINITY] {
        let error = scene.animation.apply(time, &mut scene.edit()).unwrap_err().to_string();
        assert!(error.contains("time_s: found") && error.contains("expected a finite time"), "{error}");
        let config = SceneConfig::from_file(&folder().join("cornell-ball.toml")).unwrap();
        assert!(config.at(time).is_err());
    }
}

#[test]
fn bad_animations_say_where_what_and_what_instead() {
    let head = TEXT
        .split_once("[[animation]]")
        .unwrap()
        .0
        .replace("obj = { path = \"pair.obj\" }", "sphere = { radius_m = 1 }");
    let line = head.matches('\n').count();
    let good =
        "[[animation]]\nobject = \"ball\"\nproperty = \"position_m\"\ntimes_s = [0]\nvalues = [[0, 0, 0]]\n";
    let keys = "times_s = [0, 1]\nvalues = [[1, 2, 3], [4, 5, 6]]";
    let orbit = "orbit = { centre_m = [0, 0, 0], axis = [0, 1, 0], radius_m = 1, period_s = 1 }";
    for (table, (row, column), expected) in [
        (
            "light = \"blub\"\nproperty = \"power_w\"".into(),
            (7, 9),
            "animation[1].light: no light is called \"blub\", did you mean \"bulb\"?",
        ),
        (
            "object = \"bal\"\nproperty = \"scale\"".into(),
            (7, 10),
            "animation[1].object: no object is called \"bal\", did you mean \"ball\"?",
        ),
        (
            format!("property = \"scale\"\n{keys}"),
            (6, 1),
            "animation[1]: found none, expected exactly one of light, object",
        ),
        (
            format!("light = \"cone\"\nobject = \"ball\"\nproperty = \"scale\"\n{keys}"),
            (6, 1),
            "animation[1]: found light and object",
        ),
        (format!("light = \"cone\"\n{keys}"), (6, 1), "animation[1]: the key \"property\" is missing"),
        (
            format!("light = \"cone\"\nproperty = \"colour\"\n{keys}"),
            (8, 12),
            "animation[1].property: unknown property \"colour\"; expected one of: position_m",
        ),
        (
            format!("light = \"cone\"\nproprety = \"power_w\"\n{keys}"),
            (8, 1),
            "animation[1]: unknown key \"proprety\", did you mean \"property\"?",
        ),
        (
            format!("light = \"sun\"\nproperty = \"power_w\"\n{keys}"),
            (8, 12),
            "found \"power_w\", expected what a directional light has: irradiance_w_m2, direction",
        ),
        (
            format!("object = \"ball\"\nproperty = \"position_m\"\n{keys}"),
            (8, 12),
            "found position_m besides position_m of \"ball\", expected one animation for each",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"".into(),
            (6, 1),
            "animation[1]: found neither, expected times_s with values, or an orbit",
        ),
        (
            format!("object = \"crate\"\nproperty = \"position_m\"\n{orbit}\n{keys}"),
            (9, 1),
            "animation[1].orbit: found an orbit and keyframes",
        ),
        (
            format!("object = \"crate\"\nproperty = \"scale\"\n{orbit}"),
            (9, 1),
            "animation[1].orbit: found an orbit of scale, expected position_m",
        ),
        (
            format!(
                "object = \"crate\"\nproperty = \"position_m\"\n{}",
                orbit.replace("radius_m = 1", "radius_m = 0")
            ),
            (9, 62),
            "animation[1].orbit.radius_m: found 0",
        ),
        (
            format!(
                "object = \"crate\"\nproperty = \"position_m\"\n{}",
                orbit.replace("radius_m", "raduis_m")
            ),
            (9, 51),
            "animation[1].orbit: unknown key \"raduis_m\", did you mean \"radius_m\"?",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [0]".into(),
            (6, 1),
            "animation[1]: the key \"values\" is missing",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [0]\nvalues = [1, 2]".into(),
            (10, 10),
            "animation[1].values: found 2 values, expected as many as times_s: 1",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = []\nvalues = []".into(),
            (9, 11),
            "animation[1].times_s: found no time",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [-1]\nvalues = [1]".into(),
            (9, 12),
            "animation[1].times_s[0]: found -1, expected a time from 0",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [0, 2, 2]\nvalues = [1, 1, 1]".into(),
            (9, 18),
            "animation[1].times_s[2]: found 2 after 2, expected times that increase",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [0, 2]\nvalues = [1, -1]".into(),
            (10, 14),
            "animation[1].values[1]: found [-1, -1, -1] after [1, 1, 1], expected factors of one sign",
        ),
        (
            "object = \"crate\"\nproperty = \"scale\"\ntimes_s = [0, 2]\nvalues = [1, [1, 2]]".into(),
            (10, 14),
            "animation[1].values: found 2 numbers, expected",
        ),
        (
            "object = \"crate\"\nproperty = \"position_m\"\ntimes_s = [0]\nvalues = [7]".into(),
            (10, 11),
            "animation[1].values[0]: found 7, expected three numbers",
        ),
        (
            "light = \"bulb\"\nproperty = \"power_w\"\ntimes_s = [0]\nvalues = [-7]".into(),
            (10, 11),
            "animation[1].values[0]: found [-7, -7, -7], expected values within",
        ),
        (
            "light = \"sun\"\nproperty = \"direction\"\ntimes_s = [0, 1]\nvalues = [[0, 1, 0], [0, -2, 0]]"
                .into(),
            (10, 22),
            "expected a direction that is not the opposite",
        ),
        (
            format!("light = \"sun\"\nproperty = \"direction\"\ninterpolation = \"cubic\"\n{keys}"),
            (9, 17),
            "unknown interpolation \"cubic\"; expected one of: linear, smooth, step",
        ),
    ] {
        let error = error(&format!("{head}{good}[[animation]]\n{table}\n"));
        assert!(error.contains(expected), "{error:?} lacks {expected:?}");
        let place = format!("test.toml:{}:{column}: ", line + row);
        assert!(error.starts_with(&place), "{error:?} is not at {place}");
    }
    let axis =
        "[[animation]]\nlight = \"cone\"\nproperty = \"direction\"\ntimes_s = [0]\nvalues = [[0, 1, 0]]\n";
    let target = axis.replace("direction", "target_m");
    assert!(error(&format!("{head}{axis}{target}")).contains("found target_m besides direction of \"cone\""));
}
