//! Renderers that are given up, while the others go on, and those that are not: also when the simulation has ended.

use crate::harness::{Ground, PHOTONSTREAM, config, files, kill, wait_for};
use rustix::process::Signal;
use std::fs;

#[test]
fn a_renderer_that_cannot_be_started_again_is_given_up_alone() {
    let ground = Ground::new();
    // A command that is removed while it runs can start nothing any more.
    let copy = ground.path("photonstream");
    fs::copy(PHOTONSTREAM, &copy).unwrap();
    let scene = config("cornell-box.toml");
    let line = "--renderer cpu --renderer cpu --headless --frames 100 --sampling fresh --vsls 50 --size 8x8";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split(' ')).collect();
    let run = ground.start_command(ground.command_of(&copy, &arguments));
    let lost = ground.process(" out/cpu-2 ", None);
    // Stopped, it is not done before it is killed.
    kill(lost, Signal::STOP);
    wait_for("pictures of the other one", || (files(&ground.path("out/cpu"), "exr") > 0).then_some(()));
    fs::remove_file(&copy).unwrap();
    kill(lost, Signal::KILL);
    let parts = ["cpu-2 was ended by signal 9 (SIGKILL)", "trying again", "cpu-2 could not be started again"];
    run.wait().expect(5, &parts);
    assert_eq!(files(&ground.path("out/cpu"), "exr"), 100, "the other one went on");
    ground.wait_for_silence();
}

#[test]
fn a_renderer_that_dies_after_the_simulation_has_ended_still_shows_its_last_light() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line =
        "--renderer cpu --renderer probe --headless --frames 100000 --sampling fresh --vsls 50 --size 8x8";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split(' ')).collect();
    let run = ground.start(&arguments);
    let renderer = ground.process(" renderer cpu ", None);
    wait_for("a picture", || (files(&ground.path("out/cpu"), "exr") > 0).then_some(()));
    // Stopped, it does not see the end of the channel.
    kill(renderer, Signal::STOP);
    let simulator = ground.process(" simulate ", None);
    kill(simulator, Signal::TERM);
    let ended = || ground.processes().iter().all(|(pid, _)| *pid != simulator).then_some(());
    wait_for("the simulator to end", ended);
    let before = files(&ground.path("out/cpu"), "exr");
    kill(renderer, Signal::KILL);
    // Its successor was not there while the simulation ran; nor may the probe have been, which ends as well.
    run.wait().expect(0, &["waiting for the last pictures", "cpu was ended by signal 9 (SIGKILL)"]);
    assert!(files(&ground.path("out/cpu"), "exr") > before, "the last light is shown");
    assert!(ground.path("out/probe/probe.jsonl").exists());
    ground.wait_for_silence();
    assert_eq!(ground.json(&["channels", "--json"])["channels"].as_array().unwrap().len(), 0);
    assert_eq!(fs::read_dir(ground.runtime()).unwrap().count(), 0, "the channel is removed");
}
