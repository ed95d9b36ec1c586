//! Recordings: what a simulator published is published again, and pictures of it are the live ones.

use crate::harness::{Ground, config, files, has_keys, wait_for};
use photonstream_film::Film;
use photonstream_protocol::{AccessMode, ControlClient, Liveness, Reply, Request, Runtime, Subscriber};
use photonstream_recording::Recording;
use rustix::process::Signal;
use serde_json::{Value, json};
use std::{fs, io::Write, process::Stdio, time::Duration};

const PATIENCE: Duration = Duration::from_secs(60);

/// The picture of a channel as it is.
fn picture(ground: &Ground, channel: &str) -> Film {
    let out = format!("{channel}.exr");
    ground.json(&["render", "--channel", channel, "--out", &out, "--size", "24x24", "--json"]);
    Film::read_exr(&ground.path(&out)).unwrap()
}

/// The picture's colours, bit by bit.
fn colours(film: &Film) -> Vec<[u32; 3]> {
    film.layer("full").unwrap().pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

fn connect(ground: &Ground, channel: &str) -> ControlClient {
    let runtime = Runtime::at(ground.runtime());
    wait_for("the control socket", || ControlClient::connect_in(&runtime, &channel.parse().unwrap()).ok())
}

/// Cornell box, 50 lights, 4 096 paths: recorded while its lamp changes; the recording's last frame, held on another
/// channel, gives the live picture bit for bit.
#[test]
fn replayed_pictures_are_the_live_ones() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let simulation =
        ground.start(&["simulate", &scene, "--channel", "live", "--vsls", "50", "--pool", "4096"]);
    ground.segment("live");
    let recorder = ground.start(&["record", "--channel", "live", "--out", "a.photons", "--json"]);
    let bytes = || fs::metadata(ground.path("a.photons")).map_or(0, |m| m.len());
    wait_for("the first frame in the file", || (bytes() > 1000).then_some(()));
    let set = |arguments: &[&str]| {
        ground.json(&[&["set", "--channel", "live", "--wait", "--json"], arguments].concat())
    };
    set(&["light.lamp.power_w=[3,2,1]"]);
    set(&["object.sphere.position_m=[0.3,0.5,0.45]"]);
    let live = colours(&picture(&ground, "live"));
    let flux = ground.json(&["inspect", "--channel", "live", "--json"])["total_flux_w"].clone();
    // The recorder has read the last frame when it ends.
    recorder.signal(Signal::INT);
    let said = recorder.wait();
    said.expect(0, &[]);
    let taken: Value = serde_json::from_str(&said.stdout).unwrap();
    has_keys(&taken, &["file", "frames", "skipped_frames", "bytes", "seconds"]);
    let frames = taken["frames"].as_u64().unwrap();
    assert!(frames >= 3 && taken["bytes"].as_u64() == Some(bytes()), "{taken}");
    simulation.signal(Signal::TERM);
    simulation.wait().expect(0, &[]);

    let last = frames.to_string();
    let replay =
        ground.start(&["replay", "a.photons", "--channel", "again", "--frames", &last, "--hold", "--json"]);
    let mut client = connect(&ground, "again");
    assert!(colours(&picture(&ground, "again")) == live, "another picture");
    assert_eq!(ground.json(&["inspect", "--channel", "again", "--json"])["total_flux_w"], flux);
    let edit = ground.run(&["set", "--channel", "again", "light.lamp.enabled=false"]);
    edit.expect(
        1,
        &["light.lamp was refused", "this is a replay of a.photons", "simulate the scene instead"],
    );
    assert!(matches!(client.request(&Request::Shutdown, PATIENCE).unwrap(), Reply::Ok { .. }));
    let said = replay.wait();
    said.expect(0, &[]);
    let report: Value = serde_json::from_str(&said.stdout).unwrap();
    has_keys(&report, &["file", "channel", "ending", "shown_frames", "rounds", "total_s", "damage"]);
    assert_eq!((&report["ending"], &report["shown_frames"]), (&json!("shutdown"), &json!(1)));
    ground.wait_for_silence();
}

/// `run --record` of a few pictures; then each recorded frame is shown by one step, in order, and by a whole replay; a cut
/// file gives what it has, and says where it ends.
#[test]
fn a_run_is_recorded_and_stepped_through() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line = "--headless --frames 3 --vsls 50 --pool 4096 --size 8x8 --visibility none --record run.photons --json";
    let run = ground.json(&["run", &scene].into_iter().chain(line.split(' ')).collect::<Vec<_>>());
    let frames = run["recording"]["frames"].as_u64().unwrap();
    assert!(frames >= 1 && files(&ground.path("out"), "exr") == 3, "{run}");

    let replay = ground.start(&["replay", "run.photons", "--channel", "steps", "--step"]);
    let mut client = connect(&ground, "steps");
    let runtime = Runtime::at(ground.runtime());
    let mut subscriber = Subscriber::attach_wait_in(
        &runtime,
        &"steps".parse().unwrap(),
        AccessMode::Mapped,
        PATIENCE,
        &|| false,
    )
    .unwrap();
    let mut paths = Vec::new();
    for number in 1..=frames {
        if number > 1 {
            assert_eq!(client.request(&Request::Step, PATIENCE).unwrap(), Reply::Ok { frame: number });
        }
        paths.push(wait_for("the frame", || {
            subscriber.read().unwrap();
            subscriber.frame().filter(|f| f.frame == number).map(|f| f.statistics.paths_total)
        }));
    }
    assert!(paths.is_sorted() && *paths.last().unwrap() >= 4096, "{paths:?}");
    assert_eq!(subscriber.liveness(), Liveness::Paused);
    let code = |reply: Reply| match reply {
        Reply::Error { code, .. } => code,
        other => panic!("{other:?}"),
    };
    assert_eq!(code(client.request(&Request::Step, PATIENCE).unwrap()), "at-end");
    assert_eq!(code(client.request(&Request::Reload, PATIENCE).unwrap()), "replay");
    let Reply::State { state } = client.request(&Request::Query, PATIENCE).unwrap() else {
        panic!("no state")
    };
    assert_eq!((&state["recorded_frame"], &state["paused"]), (&json!(frames), &json!(true)));
    client.request(&Request::Resume, PATIENCE).unwrap();
    assert_eq!(code(client.request(&Request::Step, PATIENCE).unwrap()), "not-paused");
    replay.signal(Signal::TERM);
    replay.wait().expect(0, &[]);

    // Two presses of Enter, and an end of the input that is none.
    let mut command =
        ground.command(&["replay", "run.photons", "--channel", "enter", "--step", "--loop", "--json"]);
    command.stdin(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"\n\n").unwrap();
    let mut client = connect(&ground, "enter");
    wait_for("three frames", || match client.request(&Request::Query, PATIENCE).unwrap() {
        Reply::State { state } => (state["shown"] == 3).then_some(()),
        other => panic!("{other:?}"),
    });
    client.request(&Request::Shutdown, PATIENCE).unwrap();
    let output = child.wait_with_output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["shown_frames"], &report["ending"]), (&json!(3), &json!("shutdown")), "{output:?}");

    let fast = ["replay", "run.photons", "--channel", "fast", "--speed", "1e6", "--json"];
    let report = ground.json(&fast);
    assert_eq!((&report["ending"], &report["shown_frames"]), (&json!("end"), &json!(frames)));
    // The mark of the end has 48 bytes.
    let whole = fs::read(ground.path("run.photons")).unwrap();
    let length = whole.len() - 48;
    fs::write(ground.path("run.photons"), &whole[..length]).unwrap();
    let said = ground.run(&fast);
    said.expect(1, &[&format!("the file ends at byte {length}")]);
    let report: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(report["shown_frames"], frames);
    assert!(report["damage"].as_str().unwrap().contains(&length.to_string()));
}

/// A simulation of 20 lights is killed; a run of 50 lights on its channel records its own frames alone, and knows how many
/// it has missed. One frame of it in a loop: a round takes 20 ms at least, however fast it is to be.
#[test]
fn a_run_after_a_crash_records_its_own_frames() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let small = ["--channel", "again", "--pool", "512"];
    let dead = ground.start(&[&["simulate", &scene, "--vsls", "20"], &small[..]].concat());
    let runtime = Runtime::at(ground.runtime());
    wait_for("a frame", || {
        let channel = "again".parse().unwrap();
        let mut subscriber = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).ok()?;
        subscriber.read().ok()?;
        subscriber.frame().map(drop)
    });
    dead.signal(Signal::KILL);
    assert!(!dead.wait().status.success());
    let line = "--headless --frames 2 --vsls 50 --size 8x8 --visibility none --record own.photons --json";
    let arguments = ["run", &scene].into_iter().chain(line.split(' ')).chain(small).collect::<Vec<_>>();
    let taken = &ground.json(&arguments)["recording"];
    let mut recording = Recording::open(&ground.path("own.photons")).unwrap();
    let mut numbers = Vec::new();
    while let Some(frame) = recording.next_frame().unwrap() {
        assert!(frame.vsls.len() > 20, "{} lights", frame.vsls.len());
        numbers.push(frame.frame);
    }
    assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    let skipped = numbers.last().unwrap() - numbers.len() as u64;
    assert_eq!((&taken["frames"], &taken["skipped_frames"]), (&json!(numbers.len()), &json!(skipped)));

    let line = "replay own.photons --channel round --frames 1 --loop --speed 1e6 --json";
    let replay = ground.start(&line.split(' ').collect::<Vec<_>>());
    let mut client = connect(&ground, "round");
    wait_for("ten rounds", || match client.request(&Request::Query, PATIENCE).unwrap() {
        Reply::State { state } => (state["shown"].as_u64()? > 10).then_some(()),
        other => panic!("{other:?}"),
    });
    client.request(&Request::Shutdown, PATIENCE).unwrap();
    let report: Value = serde_json::from_str(&replay.wait().stdout).unwrap();
    let (rounds, seconds) = (report["rounds"].as_f64().unwrap(), report["total_s"].as_f64().unwrap());
    // The round that was about to begin counts, too.
    assert!(rounds >= 10.0 && (rounds - 1.0) * 0.02 <= seconds, "{report}");
}

#[test]
fn senseless_replays_are_refused() {
    let ground = Ground::new();
    ground.write("text", "no recording, and long enough for the header of one");
    ground
        .run(&["replay", "text"])
        .expect(1, &["text: \"no recor\" in the first bytes", "photonstream record"]);
    ground.run(&["replay", "none"]).expect(1, &["cannot open none"]);
    ground.run(&["replay", "text", "--frames", "7..3"]).expect(2, &["3..7"]);
    ground.run(&["replay", "text", "--speed", "0"]).expect(2, &["a number above 0"]);
    ground
        .run(&["record", "--channel", "nobody", "--out", "x"])
        .expect(4, &["channel 'nobody' does not exist"]);
    assert!(!ground.path("x").exists());
}
