//! What is wrong with a simulation reaches everybody who looks at it, once.

use crate::harness::{Ground, config, files, wait_for};
use photonstream_protocol::{AccessMode, Runtime, Subscriber};
use photonstream_recording::Playback;
use rustix::process::Signal;
use serde_json::Value;

/// Five frames with the notices none, A, A, B, none: a renderer warns of A and of B once each, `inspect` shows B while it
/// lasts.
#[test]
fn renderers_warn_once_of_each_notice_and_inspect_shows_it() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let simulation =
        ground.start(&["simulate", &scene, "--channel", "live", "--vsls", "50", "--pool", "2048"]);
    ground.segment("live");
    let runtime = Runtime::at(ground.runtime());
    let mut subscriber =
        Subscriber::attach_in(&runtime, &"live".parse().unwrap(), AccessMode::Mapped).unwrap();
    let mut frame = wait_for("a frame", || {
        subscriber.read().unwrap();
        subscriber.frame().cloned()
    });
    simulation.signal(Signal::TERM);
    simulation.wait().expect(0, &[]);

    // Light that has converged would be drawn again without anything new.
    frame.statistics.converged = 0;
    let mut playback = Playback::start_in(&runtime, &"noticed".parse().unwrap(), &frame).unwrap();
    let line = "renderer cpu --channel noticed --out film --headless --frames 5 --size 8x8 --visibility none";
    let renderer = ground.start(&line.split(' ').collect::<Vec<_>>());
    let (a, b) = ("room.toml:3:7: no such key", "room.toml:9:1: unclosed table");
    let inspect = || ground.json(&["inspect", "--channel", "noticed", "--json"])["notice"].clone();
    for (count, notice) in (1..).zip(["", a, a, b, ""]) {
        frame.notice = notice.into();
        playback.show(&frame).unwrap();
        wait_for("its picture", || (files(&ground.path("film"), "png") == count).then_some(()));
        if notice == b {
            assert_eq!(inspect(), b);
            let said = ground.run(&["inspect", "--channel", "noticed"]);
            assert!(said.stdout.contains(&format!("notice   {b}\n")), "{}", said.stdout);
        }
    }
    assert_eq!(inspect(), Value::Null);
    let said = renderer.wait();
    said.expect(0, &[]);
    for notice in [a, b] {
        let told: Vec<_> = said.stderr.lines().filter(|line| line.contains(notice)).collect();
        assert!(told.len() == 1 && told[0].contains("WARN"), "{notice}: {said:?}");
    }
}
