//! However a run ends, nothing of it stays: no process, no segment, no folder.

use crate::harness::{Ground, Running, config, files, kill, wait_for};
use rustix::process::Signal;
use std::path::PathBuf;

/// A run with two renderers in full swing, and its segment.
fn busy_run(ground: &Ground) -> (Running<'_>, PathBuf) {
    let scene = config("cornell-box.toml");
    let run = ground.start(&[
        "run",
        &scene,
        "--renderer",
        "cpu",
        "--renderer",
        "probe",
        "--headless",
        "--frames",
        "100000",
        "--sampling",
        "fresh",
        "--vsls",
        "50",
        "--size",
        "8x8",
        "--out",
        "film",
        "--channel",
        "ending",
    ]);
    let segment = ground.segment("ending");
    wait_for("pictures", || (files(&ground.path("film/cpu"), "exr") >= 2).then_some(()));
    wait_for("the probe", || ground.path("film/probe/probe.jsonl").exists().then_some(()));
    (run, segment)
}

#[test]
fn signals_end_everything_in_order() {
    for signal in [Signal::TERM, Signal::INT, Signal::HUP] {
        let ground = Ground::new();
        let (run, segment) = busy_run(&ground);
        run.signal(signal);
        run.wait().expect(130, &["interrupted"]);
        assert_eq!(ground.processes(), []);
        assert!(!segment.exists());
        assert_eq!(ground.json(&["channels", "--json"])["channels"].as_array().unwrap().len(), 0);
    }
}

#[test]
fn a_killed_launcher_leaves_no_process_and_nothing_to_clean() {
    let ground = Ground::new();
    let (run, segment) = busy_run(&ground);
    run.signal(Signal::KILL);
    // The children notice, and end in order: the simulator removes its segment.
    wait_for("all processes to end", || {
        ground.processes().iter().all(|(pid, _)| *pid == run.pid()).then_some(())
    });
    assert!(!segment.exists());
    let said = run.wait();
    assert!(!said.stderr.contains("panicked"), "{said:?}");
    assert_eq!(ground.json(&["channels", "--json"])["channels"].as_array().unwrap().len(), 0);
    ground.json(&["clean", "--json"]);
    assert_eq!(std::fs::read_dir(ground.runtime()).unwrap().count(), 0);
}

#[test]
fn crashed_leftovers_are_listed_and_cleaned_and_the_living_are_left_alone() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let start = |channel| {
        let arguments = ["simulate", &scene, "--channel", channel, "--vsls", "50", "--pool", "2048"];
        let run = ground.start(&arguments);
        (run, ground.segment(channel))
    };
    let (dead, dead_segment) = start("dead");
    let (living, living_segment) = start("living");
    dead.signal(Signal::KILL);
    dead.wait();
    assert!(dead_segment.exists(), "a killed simulator cannot clean");

    let listed = ground.json(&["channels", "--json"]);
    let states: Vec<_> = listed["channels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| (c["name"].as_str(), c["state"].as_str()))
        .collect();
    assert_eq!(states, [(Some("dead"), Some("left_over")), (Some("living"), Some("running"))], "{listed}");
    let text = ground.run(&["channels"]).stdout;
    assert!(text.contains("left over") && text.contains("photonstream clean"), "{text}");
    // The last light of the dead can still be seen.
    assert_eq!(ground.json(&["inspect", "--channel", "dead", "--json"])["state"], "gone");

    let cleaned = ground.json(&["clean", "--json"]);
    let removed = cleaned["removed"].as_array().unwrap();
    assert!(removed.iter().any(|r| r["channel"] == "dead" && r["segments"].as_array().unwrap().len() == 1));
    assert!(!removed.iter().any(|r| r["channel"] == "living"), "{cleaned}");
    assert!(!dead_segment.exists() && living_segment.exists());
    assert_eq!(ground.json(&["inspect", "--channel", "living", "--json"])["state"], "live");
    living.signal(Signal::TERM);
    living.wait().expect(0, &[]);
    assert!(!living_segment.exists());
}

#[test]
fn interrupted_work_says_so_and_writes_nothing() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let run = ground.start(&["reference", &scene, "--spp", "1000000", "--out", "never.exr", "-v"]);
    // Several threads: the work has begun.
    let threads = || std::fs::read_dir(format!("/proc/{}/task", run.pid())).map_or(0, |d| d.count());
    wait_for("the work", || (threads() > 2).then_some(()));
    kill(run.pid(), Signal::INT);
    run.wait().expect(130, &["interrupted"]);
    assert!(!ground.path("never.exr").exists());
}
