//! Renderers that are not built in: found, missing, and failing.

use crate::harness::{Ground, config, wait_for};
use rustix::process::Signal;
use std::{fs, os::unix::fs::PermissionsExt, path::PathBuf};

/// Puts a shell script `photonstream-renderer-NAME` on the PATH of a command.
fn with_script(ground: &Ground, name: &str, body: &str, arguments: &[&str]) -> std::process::Command {
    let folder = ground.path("plug-ins");
    fs::create_dir_all(&folder).unwrap();
    let script: PathBuf = folder.join(format!("photonstream-renderer-{name}"));
    fs::write(&script, format!("#!/bin/sh\n{body}\n")).unwrap();
    fs::set_permissions(&script, PermissionsExt::from_mode(0o755)).unwrap();
    let mut command = ground.command(arguments);
    let path = std::env::var("PATH").unwrap_or_default();
    command.env("PATH", format!("{}:{path}", folder.display()));
    command
}

#[test]
fn an_unknown_renderer_is_refused_with_what_was_looked_for() {
    let ground = Ground::new();
    let said = ground.run(&["run", &config("cornell-box.toml"), "--renderer", "vulcan"]);
    said.expect(2, &["\"vulcan\"", "built in is cpu", "photonstream-renderer-vulcan", "/bin"]);
    assert!(!ground.path("out").exists(), "nothing was started");
}

#[test]
fn names_are_no_paths() {
    let ground = Ground::new();
    for name in ["../cpu", "a/b", "", "x y"] {
        ground
            .run(&["run", &config("cornell-box.toml"), "--renderer", name])
            .expect(2, &["no renderer is called"]);
    }
}

#[test]
fn a_plug_in_on_the_path_gets_the_documented_arguments() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let arguments = [
        "run",
        &scene,
        "--renderer",
        "script",
        "--headless",
        "--frames",
        "7",
        "--size",
        "20x10",
        "--kernel",
        "paper",
        "--visibility",
        "none",
        "--channel",
        "plug",
        "--out",
        "film",
        "--vsls",
        "50",
    ];
    let body = "echo \"$@\" > arguments.txt; echo a line of the plug-in";
    let said = ground.start_command(with_script(&ground, "script", body, &arguments)).wait();
    said.expect(0, &[]);
    assert!(said.stdout.contains("a line of the plug-in\n"), "{said:?}");
    let given = fs::read_to_string(ground.path("arguments.txt")).unwrap();
    let expected =
        "--channel plug --out film --headless --frames 7 --size 20x10 --kernel paper --visibility none";
    assert_eq!(given.trim(), expected);
    ground.wait_for_silence();
}

#[test]
fn a_plug_in_that_never_comes_up_is_given_up_with_its_last_words() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let arguments = ["run", &scene, "--renderer", "broken", "--headless", "--vsls", "50"];
    let body = "echo the graphics card is on fire >&2; exit 7";
    let said = ground.start_command(with_script(&ground, "broken", body, &arguments)).wait();
    said.expect(5, &["broken failed with exit code 7", "restarts", "the graphics card is on fire"]);
    ground.wait_for_silence();
}

#[test]
fn a_plug_in_that_ignores_sigterm_is_ended_by_force() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let arguments = ["run", &scene, "--renderer", "deaf", "--headless", "--vsls", "50"];
    let body = "trap 'touch asked' TERM; touch started; while :; do sleep 0.05; done";
    let run = ground.start_command(with_script(&ground, "deaf", body, &arguments));
    wait_for("the plug-in", || ground.path("started").exists().then_some(()));
    run.signal(Signal::INT);
    wait_for("the plug-in to be asked", || ground.path("asked").exists().then_some(()));
    // The second one does not wait for the grace period to pass.
    run.signal(Signal::INT);
    run.wait().expect(130, &["interrupted"]);
    ground.wait_for_silence();
}
