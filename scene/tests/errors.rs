//! Checks what is said about each kind of mistake: file, line, column, field, found, expected, remedy.
#![allow(clippy::unwrap_used)]

use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError};
use std::path::{Path, PathBuf};

const VALID: &str = r#"[camera]
position_m = [0, 1, 4]
target_m = [0, 1, 0]
vertical_fov_deg = 40

[material.white]
albedo = 0.7

[object.ball]
material = "white"
sphere = { radius_m = 1, segments = 8 }

[light.lamp]
power_w = 10
point = { position_m = [0, 3, 0] }

[light.cone]
power_w = [1, 2, 3]
spot = { position_m = [0, 3, 0], direction = [0, -1, 0], outer_half_angle_deg = 30 }

[streaming]
vsls = 100
"#;

fn build(text: &str) -> Result<Scene, SceneError> {
    SceneConfig::from_text(text, Path::new("configs/x.toml"))?.build_with(&AssetRoots::default())
}

/// The message after replacing `from`, which must occur once, by `to`.
fn message(from: &str, to: &str) -> String {
    assert_eq!(VALID.matches(from).count(), 1, "{from}");
    match build(&VALID.replace(from, to)) {
        Ok(_) => panic!("accepted: {to}"),
        Err(error) => error.to_string(),
    }
}

fn check(from: &str, to: &str, expected: &str) {
    let message = message(from, to);
    assert!(message.starts_with(&format!("configs/x.toml{expected}")), "{to}\n{message}\n{expected}");
}

#[test]
fn the_unchanged_text_is_valid() {
    build(VALID).unwrap();
}

#[test]
fn misspelt_keys_name_the_nearest() {
    check(
        "radius_m",
        "radius",
        ":11:12: object.ball.sphere: unknown key \"radius\", did you mean \"radius_m\"?",
    );
    check(
        "power_w = 10",
        "power = 10",
        ":14:1: light.lamp: unknown key \"power\", did you mean \"power_w\"?",
    );
    check("vsls", "vsl", ":22:1: streaming: unknown key \"vsl\", did you mean \"vsls\"?");
    check("[camera]", "[camera ]\nfov_deg = 3", ":2:1: camera: unknown key \"fov_deg\"");
    check("[streaming]", "[steaming]", ":21:2: unknown key \"steaming\", did you mean \"streaming\"?");
    check(
        "radius_m",
        "qqq",
        ":11:12: object.ball.sphere: unknown key \"qqq\"; expected one of: radius_m, segments",
    );
}

#[test]
fn missing_keys_are_named_with_their_table() {
    check("target_m = [0, 1, 0]\n", "", ":1:2: camera: the key \"target_m\" is missing; add it");
    check("radius_m = 1, ", "", ":11:10: object.ball.sphere: the key \"radius_m\" is missing");
    check("material = \"white\"\n", "", ":9:9: object.ball: the key \"material\" is missing");
    check("power_w = 10\n", "", ":13:8: light.lamp: the key \"power_w\" is missing");
}

#[test]
fn wrong_types_say_what_was_found_and_expected() {
    check(
        "albedo = 0.7",
        "albedo = \"white\"",
        ":7:10: material.white.albedo: found string \"white\", expected a number",
    );
    check(
        "segments = 8",
        "segments = 8.5",
        ":11:37: object.ball.sphere.segments: found floating point `8.5`, expected u32",
    );
    check("vsls = 100", "vsls = -1", ":22:8: streaming.vsls: found integer `-1`, expected u32");
    check(
        "target_m = [0, 1, 0]",
        "target_m = [0, 1]",
        ":3:12: camera.target_m: found 2 numbers, expected three numbers [x, y, z]",
    );
    check("[0, 1, 0]", "[0, 1, 0, 0]", ":3:12: camera.target_m: found 4 numbers, expected three numbers");
    check("[0, 1, 0]", "[0, 1, 1e999]", ":3:19: camera.target_m: floating-point number overflowed");
    check("[0, 1, 0]", "7", ":3:12: camera.target_m: found integer `7`, expected three numbers");
    check(
        "vsls = 100",
        "sampling = \"sometimes\"",
        ":22:12: streaming.sampling: unknown sampling \"sometimes\"; expected one of: replay, fresh",
    );
    check(
        "material = \"white\"",
        "material = \"white\"\nsides = \"inside\"",
        ":11:9: object.ball.sides: unknown sides \"inside\"; expected one of: front, back, both",
    );
}

#[test]
fn bad_toml_says_where() {
    check("vsls = 100", "vsls = ", ":22:8: not valid TOML: ");
    check("vsls = 100", "vsls = 1\nvsls = 2", ":23:1: not valid TOML: duplicate key");
    check("[streaming]", "[streaming", ":21:11: not valid TOML: ");
    check("[light.cone]", "[light.lamp]", ":17:8: not valid TOML: duplicate key");
    assert!(
        build("").unwrap_err().to_string().starts_with("configs/x.toml:1:1: the key \"camera\" is missing")
    );
}

#[test]
fn numbers_outside_their_domain_are_refused() {
    for (from, to, expected) in [
        (
            "[0, 1, 4]",
            "[0, nan, 4]",
            ":2:14: camera.position_m: found [0, NaN, 4], expected numbers within ±1e9 m",
        ),
        ("[0, 1, 4]", "[0, inf, 4]", ":2:14: camera.position_m: found [0, inf, 4], expected"),
        (
            "albedo = 0.7",
            "albedo = 1.5",
            ":7:10: material.white.albedo: found [1.5, 1.5, 1.5], expected albedos within [0, 1]",
        ),
        (
            "albedo = 0.7",
            "albedo = [0, -0.1, 0]",
            ":7:10: material.white.albedo: found [0, -0.1, 0], expected albedos",
        ),
        (
            "radius_m = 1",
            "radius_m = 0",
            ":11:23: object.ball.sphere.radius_m: found 0, expected a length in (0, 1e9] m",
        ),
        ("radius_m = 1", "radius_m = -2", ":11:23: object.ball.sphere.radius_m: found -2, expected a length"),
        (
            "segments = 8",
            "segments = 2",
            ":11:37: object.ball.sphere.segments: found 2, expected a whole number from 3 to 2048",
        ),
        (
            "power_w = 10",
            "power_w = -1",
            ":14:11: light.lamp.power_w: found [-1, -1, -1], expected values within [0, 1e15]",
        ),
        ("power_w = 10", "power_w = nan", ":14:11: light.lamp.power_w: found [NaN, NaN, NaN], expected"),
        (
            "vsls = 100",
            "vsls = 0",
            ":22:8: streaming.vsls: found 0, expected a whole number from 1 to 4000000",
        ),
        ("vsls = 100", "vsls = 4000001", ":22:8: streaming.vsls: found 4000001, expected"),
        (
            "vsls = 100",
            "pool_paths = 0",
            ":22:14: streaming.pool_paths: found 0, expected a whole number from 1 to 8388608",
        ),
        ("vsls = 100", "pool_paths = 8388609", ":22:14: streaming.pool_paths: found 8388609, expected"),
        (
            "vsls = 100",
            "placement_scale = 0",
            ":22:19: streaming.placement_scale: found 0, expected a factor in (0, 1]",
        ),
        (
            "vsls = 100",
            "publish_period_ms = 0",
            ":22:21: streaming.publish_period_ms: found 0, expected a time",
        ),
        (
            "vsls = 100",
            "fixed_step_ms = 0",
            ":22:17: streaming.fixed_step_ms: found 0, expected a time above 0",
        ),
        (
            "vsls = 100",
            "fixed_step_ms = nan",
            ":22:17: streaming.fixed_step_ms: found NaN, expected a time above",
        ),
        (
            "vsls = 100",
            "target_error = -0.1",
            ":22:16: streaming.target_error: found -0.1, expected a relative",
        ),
        (
            "vsls = 100",
            "latency_ms = 60001",
            ":22:14: streaming.latency_ms: found 60001, expected a time from 0",
        ),
        ("vsls = 100", "threads = 0", ":22:11: streaming.threads: found 0, expected a whole number"),
        (
            "vsls = 100",
            "seed = 9223372036854775808",
            ":22:8: streaming.seed: found 9223372036854775808, expected",
        ),
        ("vsls = 100", "[render]\nwidth_px = 0", ":23:12: render.width_px: found 0, expected a whole number"),
        ("vsls = 100", "[render]\nepsilon = -1", ":23:11: render.epsilon: found -1, expected a radiance"),
        (
            "vsls = 100",
            "[render]\nculling = \"some\"",
            ":23:11: render.culling: unknown culling \"some\"; expected one of: cut, stochastic",
        ),
        (
            "vsls = 100",
            "[render]\nshadow_map_px = 48",
            ":23:17: render.shadow_map_px: found 48, expected 32, 64, 128 or 256",
        ),
        ("vsls = 100", "[render]\nexposure_ev = 99", ":23:15: render.exposure_ev: found 99, expected stops"),
        (
            "outer_half_angle_deg = 30",
            "outer_half_angle_deg = 181",
            ":19:81: light.cone.spot.outer_half_angle_deg: found 181, expected half",
        ),
        (
            "outer_half_angle_deg = 30",
            "outer_half_angle_deg = 30, inner_half_angle_deg = 31",
            ":19:108: light.cone.spot.inner_half_angle_deg: found 31, expected an angle from 0 to outer_half_angle_deg = 30",
        ),
        (
            "direction = [0, -1, 0]",
            "direction = [0, 0, 0]",
            ":19:46: light.cone.spot.direction: found [0, 0, 0], expected a direction",
        ),
        (
            "material = \"white\"",
            "material = \"white\"\nscale = 0",
            ":11:9: object.ball.scale: found [0, 0, 0], expected factors other than 0",
        ),
        (
            "material = \"white\"",
            "material = \"white\"\nscale = [1, nan, 1]",
            ":11:9: object.ball.scale: found [1, NaN, 1], expected factors",
        ),
    ] {
        check(from, to, expected);
    }
}

#[test]
fn degenerate_cameras_are_explained() {
    check("[0, 1, 0]", "[0, 1, 4]", ":3:12: camera.target_m: found the camera's own position");
    check("[0, 1, 0]", "[0, 9, 4]", ":1:2: camera.up: found a direction along the view");
    check("[0, 1, 0]", "[0, 1, 0]\nup = [0, 0, 1]", ":4:6: camera.up: found a direction along the view");
    check("fov_deg = 40", "fov_deg = 180", ":4:20: camera.vertical_fov_deg: found 180, expected an angle");
}

#[test]
fn combinations_without_a_meaning_are_explained() {
    check(
        "sphere = { radius_m = 1, segments = 8 }",
        "sphere = { radius_m = 1 }\nbox = { size_m = [1, 1, 1] }",
        ":9:9: object.ball: found box and sphere, expected exactly one of quad, box, sphere, torus-knot, obj, ply, gltf",
    );
    check(
        "sphere = { radius_m = 1, segments = 8 }",
        "",
        ":9:9: object.ball: found none, expected exactly one of quad, box",
    );
    check(
        "point = { position_m = [0, 3, 0] }",
        "",
        ":13:8: light.lamp: found none, expected exactly one of spot",
    );
    check(
        "direction = [0, -1, 0]",
        "direction = [0, -1, 0], target_m = [0, 0, 0]",
        ":19:1: light.cone.spot: found target_m and direction, expected exactly one of",
    );
    check(
        "power_w = 10",
        "irradiance_w_m2 = 10",
        ":14:19: light.lamp.irradiance_w_m2: found irradiance_w_m2, expected power_w",
    );
    check(
        "sphere = { radius_m = 1, segments = 8 }",
        "torus-knot = { radius_m = 1, tube_radius_m = 0.1, p = 2, q = 4 }",
        ":11:62: object.ball.torus-knot.q: found p = 2 and q = 4, expected numbers without a common divisor",
    );
    check(
        "sphere = { radius_m = 1, segments = 8 }",
        "torus-knot = { radius_m = 1, tube_radius_m = 0.5 }",
        ":11:46: object.ball.torus-knot.tube_radius_m: found 0.5, expected less than half of radius_m = 1",
    );
    check(
        "sphere = { radius_m = 1, segments = 8 }",
        "quad = { corner_m = [0, 0, 0], edge_u_m = [1, 0, 0], edge_v_m = [2, 0, 0] }",
        ":11:65: object.ball.quad.edge_v_m: found edges that are parallel or zero",
    );
}

#[test]
fn names_are_checked() {
    check(
        "material = \"white\"",
        "material = \"wite\"",
        ":10:12: object.ball.material: no material is called \"wite\", did you mean \"white\"?",
    );
    check(
        "material = \"white\"",
        "material = \"x\"",
        ":10:12: object.ball.material: no material is called \"x\"; expected one of: white",
    );
    check("[object.ball]", "[object.\"a/b\"]", ":9:9: object.a/b: found \"a/b\", expected a name");
    check("[light.lamp]", "[light.\"\"]", ":13:8: light.: found \"\", expected a name");
    check(
        "[light.lamp]\npower_w = 10\npoint = { position_m = [0, 3, 0] }",
        "[light.ball]\npower_w = 1\n\
         rectangle = { corner_m = [0, 3, 0], edge_u_m = [1, 0, 0], edge_v_m = [0, 0, 1] }",
        ":13:8: light.ball: found the name \"ball\" twice, for an object and for this rectangle",
    );
}

#[test]
fn empty_and_boundless_geometry_is_refused() {
    let none =
        VALID.replace("[object.ball]\nmaterial = \"white\"\nsphere = { radius_m = 1, segments = 8 }\n", "");
    assert!(
        build(&none)
            .unwrap_err()
            .to_string()
            .starts_with("configs/x.toml: found no object, expected at least one")
    );
    // Around an origin so far off, the corners of so small a ball round to one point.
    let collapsed =
        format!("origin_m = [1e3, 1e3, 1e3]\n{}", VALID.replace("radius_m = 1,", "radius_m = 1e-6,"));
    let error = build(&collapsed).unwrap_err().to_string();
    let expected = "configs/x.toml:10:9: object.ball: found 112 triangles, none with an area";
    assert!(error.starts_with(expected), "{error}");
    check(
        "material = \"white\"",
        "material = \"white\"\nscale = 1e9\nposition_m = [1e9, 0, 0]\nrotation_deg = [0, 0, 45]",
        ":9:9: object.ball: found a vertex",
    );
}

#[test]
fn a_missing_asset_says_where_it_was_looked_for() {
    let text = VALID.replace("sphere = { radius_m = 1, segments = 8 }", "obj = { path = \"no/where.obj\" }");
    let roots = AssetRoots { folders: vec![PathBuf::from("/scenes"), PathBuf::from("assets")] };
    let error = SceneConfig::from_text(&text, Path::new("x.toml")).unwrap().build_with(&roots).unwrap_err();
    assert_eq!(
        error.to_string(),
        "x.toml:11:16: object.ball.obj.path: found no file \"no/where.obj\"; looked at /scenes/no/where.obj, \
         assets/no/where.obj; set PHOTONSTREAM_SCENES to the folder that holds the scenes, or put the file into assets/ \
         (README.md, \"Scenes\", says where to get it)"
    );
    let absolute = text.replace("no/where.obj", "/no/where.obj");
    let error =
        SceneConfig::from_text(&absolute, Path::new("x.toml")).unwrap().build_with(&roots).unwrap_err();
    assert!(error.to_string().contains("looked at /no/where.obj; "), "{error}");
}

#[test]
fn an_unreadable_scene_file_is_named() {
    let error = Scene::load(Path::new("no/such/scene.toml")).unwrap_err().to_string();
    assert!(error.starts_with("no/such/scene.toml: cannot be read ("), "{error}");
}
