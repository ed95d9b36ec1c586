//! The main job: photons in one process, pictures from another.

use crate::harness::{Ground, config, wait_for};
use photonstream_film::Film;

/// 131 072 paths, seed 1, 1 000 lights, kernel `patch`, shadow rays; 48 × 48 pixels against 512 paths a pixel, seed 1, whose own noise is 0.05.
#[test]
fn separate_processes_make_the_right_picture() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let film = ground.path("film");
    let arguments =
        ["run", &scene, "--headless", "--size", "48x48", "--out", "film", "--channel", "main", "--json"];
    let report = ground.json(&arguments);
    assert_eq!(report["channel"], "main");
    assert_eq!(report["simulator_restarts"], 0);
    assert_eq!(report["renderers"][0]["pictures"].as_array().unwrap().len(), 2, "{report}");
    ground.wait_for_silence();

    let picture = Film::read_exr(&film.join("frame-0001.exr")).unwrap();
    assert_eq!((picture.width(), picture.height()), (48, 48));
    let metadata = &picture.metadata;
    let check = ground.json(&["check", &scene, "--json"]);
    assert_eq!(format!("{:016x}", metadata.scene_hash.unwrap()), check["scene_hash"]);
    assert_eq!(metadata.scene_name.as_deref(), Some("Cornell box"));
    assert_eq!(metadata.method.as_deref(), Some("photon-streaming"));
    assert_eq!(metadata.kernel.as_deref(), Some("patch"));
    assert_eq!(metadata.visibility.as_deref(), Some("rays"));
    assert_eq!(metadata.photon_paths, Some(131_072));
    assert_eq!(metadata.vsls, Some(1000));
    assert_eq!(metadata.samples_per_pixel, Some(1));
    assert!(metadata.frame.is_some() && metadata.software.is_some(), "{metadata:?}");

    ground.json(&["reference", &scene, "--size", "48x48", "--spp", "512", "--out", "truth.exr", "--json"]);
    let compared = ground.json(&["compare", "film/frame-0001.exr", "truth.exr", "--json"]);
    // Direct light is exact in both. Measured are a bias of -0.005 and a relative RMSE of 0.054, of which 0.05 are the
    // reference's noise; not even twice that is allowed. A black, doubled or unshadowed picture is far outside.
    let bias = compared["bias"].as_f64().unwrap();
    assert!(bias.abs() < 0.01, "{compared}");
    assert!(compared["rel_rmse"].as_f64().unwrap() < 0.09, "{compared}");

    let png = std::fs::read(film.join("frame-0001.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
}

#[test]
fn simulator_and_renderer_are_processes_of_their_own() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let run = ground.start(&[
        "run",
        &scene,
        "--headless",
        "--frames",
        "100000",
        "--sampling",
        "fresh",
        "--size",
        "8x8",
        "--out",
        "film",
    ]);
    let simulator = ground.process(" simulate ", None);
    let renderer = ground.process(" renderer cpu ", None);
    assert!(simulator != renderer && simulator != run.pid() && renderer != run.pid());
    wait_for("pictures", || (crate::harness::files(&ground.path("film"), "exr") >= 3).then_some(()));
    run.signal(rustix::process::Signal::TERM);
    run.wait().expect(130, &[]);
}

#[test]
fn one_simulation_serves_pictures_of_a_running_channel() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let simulation =
        ground.start(&["simulate", &scene, "--channel", "demo", "--vsls", "50", "--pool", "2048"]);
    ground.segment("demo");
    let arguments = [
        "render",
        "--channel",
        "demo",
        "--out",
        "a/img.png",
        "--size",
        "16x12",
        "--show",
        "full,indirect,vsl",
    ];
    let report = ground.json(&[&arguments[..], &["--json"]].concat());
    let pictures: Vec<_> =
        report["pictures"].as_array().unwrap().iter().map(|p| p.as_str().unwrap()).collect();
    assert_eq!(pictures, ["a/img-full.png", "a/img-indirect.png", "a/img-vsl.png"]);
    assert!(pictures.iter().all(|path| ground.path(path).exists()));
    assert_eq!((&report["vsls"], &report["width_px"]), (&50.into(), &16.into()));
    let inspected = ground.json(&["inspect", "--channel", "demo", "--json"]);
    assert_eq!(inspected["vsls"], 50);
    simulation.signal(rustix::process::Signal::INT);
    simulation.wait().expect(0, &[]);
}

/// A scene that moves for ever is rendered as it is at a moment: at its beginning unless told otherwise, and the same each
/// time. With shadows of distance maps, which the simulator traces for that.
#[test]
fn what_moves_is_rendered_at_a_moment() {
    let ground = Ground::new();
    let scene = config("cornell-ball.toml");
    let picture = |name: &str, more: &[&str]| {
        let out = format!("{name}.exr");
        let size = ["--size", "40x30", "--vsls", "60", "--pool", "2000", "--visibility", "octahedral"];
        let arguments = ["render", scene.as_str(), "--out", out.as_str()];
        let arguments: Vec<&str> = arguments.into_iter().chain(size).chain(more.iter().copied()).collect();
        ground.run(&arguments).expect(0, &[]);
        Film::read_exr(&ground.path(&out)).unwrap().layers()[0].pixels.clone()
    };
    let first = picture("first", &[]);
    assert!(picture("again", &["--time", "0"]) == first);
    let later = picture("later", &["--time", "2.5"]);
    assert!(later != first && later == picture("later-again", &["--time", "2.5"]));
    let text = std::fs::read_to_string(config("cornell-ball.toml")).unwrap();
    assert!(text.contains("[[animation]]"));
}
