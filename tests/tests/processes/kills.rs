//! What happens when a process is killed: it comes back, and the others go on.

use crate::harness::{Ground, config, files, kill, wait_for};
use rustix::process::Signal;
use serde_json::Value;
use std::{
    fs,
    os::unix::fs::MetadataExt,
    path::Path,
    time::{Duration, Instant},
};

/// Lines that the probe plug-in has written.
fn probe_lines(folder: &Path) -> Vec<Value> {
    let text = fs::read_to_string(folder.join("probe.jsonl")).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

#[test]
fn a_killed_renderer_comes_back_and_pictures_continue() {
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
        "--vsls",
        "50",
        "--size",
        "8x8",
        "--out",
        "film",
    ]);
    let first = ground.process(" renderer cpu ", None);
    let picture = |number: usize| ground.path(format!("film/frame-{number:04}.png"));
    wait_for("pictures", || picture(2).exists().then_some(()));
    // Those of the first process stay the files that they were, and the numbers go on without a gap.
    let identity =
        |number| fs::metadata(picture(number)).map(|m| (m.ino(), m.mtime(), m.mtime_nsec())).unwrap();
    let made = files(&ground.path("film"), "png");
    let before: Vec<_> = (1..=made).map(identity).collect();
    kill(first, Signal::KILL);
    let second = ground.process(" renderer cpu ", Some(first));
    let newer = files(&ground.path("film"), "png") + 3;
    wait_for("pictures of the new process", || picture(newer).exists().then_some(()));
    assert_eq!((1..=made).map(identity).collect::<Vec<_>>(), before);
    (1..=newer).for_each(|number| assert!(picture(number).exists(), "{number} of {newer}"));
    let renderers: Vec<_> =
        ground.processes().into_iter().filter(|(_, line)| line.contains(" renderer cpu ")).collect();
    assert!(matches!(renderers[..], [(pid, _)] if pid == second), "one alone, the same still: {renderers:?}");
    run.signal(Signal::TERM);
    let said = run.wait();
    said.expect(130, &["cpu was ended by signal 9 (SIGKILL)", "starting it again"]);
    ground.wait_for_silence();
}

#[test]
fn a_killed_renderer_makes_the_remaining_pictures_only() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line = "--headless --frames 100 --sampling fresh --vsls 50 --size 8x8 --out film --json";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split(' ')).collect();
    let run = ground.start(&arguments);
    let renderer = ground.process(" renderer cpu ", None);
    wait_for("a picture", || ground.path("film/frame-0001.png").exists().then_some(()));
    kill(renderer, Signal::KILL);
    let said = run.wait();
    said.expect(0, &["cpu was ended by signal 9 (SIGKILL)"]);
    let report: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(report["renderers"][0]["restarts"], 1, "{report}");
    assert_eq!((files(&ground.path("film"), "exr"), files(&ground.path("film"), "png")), (100, 100));
    ground.wait_for_silence();
}

#[test]
fn renderers_survive_the_simulator_and_follow_its_successor() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let run = ground.start(&[
        "run",
        &scene,
        "--renderer",
        "probe",
        "--renderer",
        "cpu",
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
        "kills",
    ]);
    let folder = ground.path("film/probe");
    let first = ground.process(" simulate ", None);
    let renderer = ground.process(" renderer cpu ", None);
    let is_frame = |line: &Value| line["frame"].is_u64();
    wait_for("frames", || (probe_lines(&folder).iter().filter(|l| is_frame(l)).count() >= 3).then_some(()));
    let old_segment = ground.segment("kills");

    // A launcher that is stopped starts no successor: the probe has time to notice the death.
    run.signal(Signal::STOP);
    kill(first, Signal::KILL);
    let is_gone = |line: &&Value| line["gone"] == true;
    wait_for("the probe to notice", || probe_lines(&folder).iter().find(is_gone).map(|_| ()));
    run.signal(Signal::CONT);
    let continued = Instant::now();
    ground.process(" simulate ", Some(first));
    let started = continued.elapsed();
    let lines = wait_for("frames of the new simulator", || {
        let lines = probe_lines(&folder);
        let frames: Vec<_> = lines.iter().filter(|l| is_frame(l)).collect();
        let epochs = (frames.first()?["epoch"].as_u64()?, frames.last()?["epoch"].as_u64()?);
        (epochs.1 > epochs.0).then_some(lines)
    });
    let attached = continued.elapsed();
    let ms = |time: Duration| time.as_millis();
    println!("launcher goes on: simulator after {} ms, frame of it after {} ms", ms(started), ms(attached));
    // Both renderers are the processes they were.
    let pids: Vec<_> = lines.iter().filter_map(|line| line["pid"].as_u64()).collect();
    assert!(pids.windows(2).all(|pair| pair[0] == pair[1]), "{pids:?}");
    assert_eq!(ground.process(" renderer cpu ", None), renderer);
    // Whoever noticed the death still had the lights.
    let kept: Vec<_> = lines.iter().filter(is_gone).map(|line| &line["kept_vsls"]).collect();
    assert!(!kept.is_empty() && kept.iter().all(|&vsls| vsls == 50), "{kept:?}");
    let before = files(&ground.path("film/cpu"), "exr");
    wait_for("more pictures", || (files(&ground.path("film/cpu"), "exr") > before).then_some(()));
    wait_for("the old segment to be removed", || (!old_segment.exists()).then_some(()));

    let segment = ground.segment("kills");
    run.signal(Signal::TERM);
    run.wait().expect(130, &["simulator was ended by signal 9 (SIGKILL)"]);
    ground.wait_for_silence();
    assert!(!segment.exists());
}

#[test]
fn three_renderers_work_at_once() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let report = ground.json(&[
        "run",
        &scene,
        "--renderer",
        "cpu",
        "--renderer",
        "cpu",
        "--renderer",
        "probe",
        "--headless",
        "--frames",
        "2",
        "--vsls",
        "50",
        "--size",
        "8x8",
        "--sampling",
        "fresh",
        "--out",
        "film",
        "--json",
    ]);
    let renderers = report["renderers"].as_array().unwrap();
    let names: Vec<_> = renderers.iter().map(|r| r["folder"].as_str().unwrap()).collect();
    assert_eq!(names, ["film/cpu", "film/cpu-2", "film/probe"]);
    assert!(renderers.iter().all(|r| r["failed"] == false && r["restarts"] == 0), "{report}");
    for name in &names[..2] {
        assert_eq!(files(&ground.path(name), "exr"), 2, "{name}");
    }
    assert_eq!(probe_lines(&ground.path("film/probe")).len(), 2);
    ground.wait_for_silence();
}
