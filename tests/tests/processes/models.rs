//! A model without a scene file is shown, lit, and shown anew when its file changes.

use crate::harness::{Ground, wait_for};
use photonstream_film::Film;
use photonstream_protocol::{AccessMode, Runtime, Subscriber};
use rustix::process::Signal;

/// A box of the given height on a plane of 4 × 4 m, without light or camera.
fn model(height: f32) -> String {
    let h = height;
    format!(
        "v -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n\
         v -.5 0 .5\nv .5 0 .5\nv .5 0 -.5\nv -.5 0 -.5\nv -.5 {h} .5\nv .5 {h} .5\nv .5 {h} -.5\nv -.5 {h} -.5\n\
         f 5 6 10 9\nf 6 7 11 10\nf 7 8 12 11\nf 8 5 9 12\nf 9 10 11 12\n"
    )
}

/// `render model.obj` in the working folder, named relative to it: a picture that is neither black nor empty, whose middle
/// shows the box; `check` tells what was chosen; `config` writes a file that gives the same picture.
#[test]
fn a_model_alone_is_shown_and_lit() {
    let ground = Ground::new();
    ground.write("model.obj", &model(1.0));
    let options = ["--size", "40x30", "--vsls", "100", "--pool", "4096"];
    let render = |scene: &str, out: &str| {
        ground
            .run(&[&["render", scene, "--out", out, "--show", "full"][..], &options[..]].concat())
            .expect(0, &[]);
        let film = Film::read_exr(&ground.path(out)).unwrap();
        film.layer("full").unwrap().pixels.clone()
    };
    let pixels = render("model.obj", "a.exr");
    let middle = pixels[15 * 40 + 20];
    assert!(middle.min_element() > 0.0, "{middle}");
    let told = ground.json(&["check", "model.obj", "--json"]);
    let choices: Vec<_> = told["choices"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert!(choices.iter().any(|choice| choice.starts_with("light: a sun was added")), "{choices:?}");
    let text = ground.json(&["config", "model.obj", "--json"])["text"].as_str().unwrap().to_owned();
    ground.write("scene.toml", &text);
    assert_eq!(render("scene.toml", "b.exr"), pixels);
    ground.run(&["config", "scene.toml"]).expect(2, &["scene.toml is no model"]);
    ground.run(&["render", "nowhere.glb", "--out", "c.exr"]).expect(3, &["nowhere.glb: cannot be read"]);
}

/// The model is saved anew, broken, and whole again: the running simulation follows, and says what is wrong meanwhile.
#[test]
fn a_running_model_is_loaded_anew() {
    let ground = Ground::new();
    ground.write("model.obj", &model(1.0));
    let simulation =
        ground.start(&["simulate", "model.obj", "--channel", "live", "--vsls", "50", "--pool", "2048"]);
    ground.segment("live");
    let mut subscriber =
        Subscriber::attach_in(&Runtime::at(ground.runtime()), &"live".parse().unwrap(), AccessMode::Mapped)
            .unwrap();
    // A frame with its hash and what is wrong.
    let mut frame = move || {
        // A segment may be replaced while it is read.
        let _ = subscriber.read();
        subscriber.frame().map(|frame| (frame.scene_hash, frame.notice.to_string()))
    };
    let (first, _) = wait_for("a frame", &mut frame);
    ground.write("model.obj", &model(2.0));
    wait_for("another scene", || frame().filter(|(hash, _)| *hash != first));
    ground.write("model.obj", "v 1 2\n");
    let (_, notice) = wait_for("the notice", || frame().filter(|(_, notice)| !notice.is_empty()));
    assert!(notice.contains("model.obj") && notice.contains("export it anew"), "{notice}");
    ground.write("model.obj", &model(1.0));
    wait_for("the first scene", || frame().filter(|(hash, notice)| *hash == first && notice.is_empty()));
    simulation.signal(Signal::TERM);
    simulation.wait().expect(0, &[]);
}
