//! What a user is told who makes a mistake: what, where, and what to do; once, and with the right exit code.

use crate::harness::{Ground, config};
use rustix::process::Signal;
use std::{fs, os::unix::fs::PermissionsExt};

/// Commands that load a scene.
const LOADING: [&[&str]; 6] = [
    &["check"],
    &["simulate"],
    &["run", "--headless"],
    &["render", "--out", "x.png"],
    &["reference", "--out", "x.exr"],
    &["bench"],
];

fn cornell() -> String {
    fs::read_to_string(config("cornell-box.toml")).unwrap()
}

/// Line of the first occurrence of `part`, from 1.
fn line_of(text: &str, part: &str) -> usize {
    text.lines().position(|line| line.contains(part)).unwrap() + 1
}

#[test]
fn a_misspelt_key_is_named_with_its_place_and_the_nearest_one() {
    let ground = Ground::new();
    let text = cornell().replace("radius_m", "radius");
    ground.write("room.toml", &text);
    let place = format!("room.toml:{}:", line_of(&text, "radius"));
    for command in LOADING {
        let said = ground.run(&[command, &["room.toml"]].concat());
        said.expect(3, &[&place, "unknown key \"radius\", did you mean \"radius_m\"?"]);
    }
    ground.wait_for_silence();
}

#[test]
fn nan_in_a_scene_is_named_with_its_place() {
    let ground = Ground::new();
    let power = |line: &str| {
        if line.starts_with("power_w") { "power_w = [28, nan, 20]".into() } else { line.to_owned() }
    };
    let text: String = cornell().lines().map(|line| power(line) + "\n").collect();
    ground.write("room.toml", &text);
    let place = format!("room.toml:{}:", line_of(&text, "nan"));
    for command in LOADING {
        ground.run(&[command, &["room.toml"]].concat()).expect(3, &[&place, "light.lamp.power_w"]);
    }
    ground.wait_for_silence();
    assert!(!ground.path("x.png").exists() && !ground.path("x.exr").exists());
}

#[test]
fn a_scene_that_cannot_be_read_is_named() {
    let ground = Ground::new();
    for command in LOADING {
        ground.run(&[command, &["missing.toml"]].concat()).expect(3, &["missing.toml: cannot be read"]);
    }
    fs::create_dir(ground.path("folder.toml")).unwrap();
    ground.run(&["check", "folder.toml"]).expect(3, &["folder.toml: cannot be read"]);
    let locked = ground.write("locked.toml", &cornell());
    fs::set_permissions(&locked, PermissionsExt::from_mode(0o000)).unwrap();
    if fs::read(&locked).is_err() {
        ground.run(&["check", "locked.toml"]).expect(3, &["locked.toml: cannot be read"]);
    }
}

#[test]
fn a_busy_channel_is_told_with_the_process_that_holds_it() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let first = ground.start(&["simulate", &scene, "--channel", "busy", "--vsls", "50", "--pool", "2048"]);
    let segment = ground.segment("busy");
    let words = ["channel 'busy' is in use by process", &first.pid().to_string(), "choose another --channel"];
    ground.run(&["simulate", &scene, "--channel", "busy"]).expect(4, &words);
    ground.run(&["run", &scene, "--channel", "busy", "--headless"]).expect(4, &words);
    // The simulation that was there is unharmed.
    assert!(segment.exists());
    assert_eq!(ground.json(&["channels", "--json"])["channels"][0]["pid"], first.pid());
    first.signal(Signal::TERM);
    first.wait().expect(0, &[]);
    assert!(!segment.exists());
}

#[test]
fn a_channel_that_does_not_exist_is_told() {
    let ground = Ground::new();
    let words = ["channel 'nobody' does not exist", "start a simulator on it"];
    ground.run(&["inspect", "--channel", "nobody"]).expect(4, &words);
    ground.run(&["render", "--channel", "nobody", "--out", "x.png"]).expect(4, &words);
}

#[test]
fn senseless_command_lines_are_refused_before_any_work() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let cases: [(&[&str], &str); 12] = [
        (&["rnder"], "render"),
        (&["render", &scene, "--out", "x.jpg"], ".exr (linear) or .png"),
        (&["render", "--out", "x.png"], "<CONFIG>"),
        (&["render", &scene, "--channel", "a", "--out", "x.png"], "cannot be used with"),
        (&["render", &scene, "--out", "x.png", "--size", "800"], "such as 800x600"),
        (&["render", &scene, "--out", "x.png", "--show", "ful"], "full, direct, indirect"),
        (&["render", &scene, "--out", "x.png", "--renderer", "mine"], "photonstream run --renderer"),
        (&["render", "--channel", "a", "--out", "x.png", "--vsls", "5"], "--vsls"),
        (&["reference", &scene, "--out", "x.exr", "--spp", "4", "--time", "1"], "cannot be used with"),
        (&["reference", &scene, "--out", "x.exr", "--error", "-1"], "error"),
        (&["run", &scene, "--frames", "0"], "0 is not in 1.."),
        (&["simulate", &scene, "--channel", "Not Good"], "a-z, 0-9 and '-'"),
    ];
    for (arguments, part) in cases {
        ground.run(arguments).expect(2, &[part]);
    }
}

#[test]
fn pictures_that_cannot_be_compared_or_written_are_told() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    ground.json(&["reference", &scene, "--size", "4x4", "--spp", "2", "--out", "a.exr", "--json"]);
    ground.json(&["reference", &scene, "--size", "4x5", "--spp", "2", "--out", "b.exr", "--json"]);
    ground.run(&["compare", "a.exr", "b.exr"]).expect(1, &["4 x 4", "4 x 5"]);
    ground.run(&["compare", "a.exr", "none.exr"]).expect(1, &["none.exr: cannot be read"]);
    ground.write("c.exr", "no picture");
    ground.run(&["compare", "a.exr", "c.exr"]).expect(1, &["c.exr: not a readable OpenEXR picture"]);
    ground.write("file", "");
    let said = ground.run(&["reference", &scene, "--size", "4x4", "--spp", "2", "--out", "file/x.exr"]);
    said.expect(1, &["file"]);
}
