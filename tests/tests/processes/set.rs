//! `photonstream set`: a running simulation is changed from the command line, and mistakes are told with their place.

use crate::harness::{Ground, config, has_keys, wait_for};
use photonstream_protocol::{AccessMode, Runtime, Subscriber, VslFrame};
use rustix::process::Signal;
use serde_json::json;

/// The newest frame of a channel from number `least` on.
fn frame(ground: &Ground, channel: &str, least: u64) -> VslFrame {
    let runtime = Runtime::at(ground.runtime());
    let mut subscriber =
        Subscriber::attach_in(&runtime, &channel.parse().unwrap(), AccessMode::Mapped).unwrap();
    wait_for("the frame promised", || {
        subscriber.read().unwrap();
        subscriber.frame().filter(|frame| frame.frame >= least).cloned()
    })
}

#[test]
fn a_running_simulation_is_changed_and_waited_for() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let simulation =
        ground.start(&["simulate", &scene, "--channel", "demo", "--vsls", "50", "--pool", "4096"]);
    ground.segment("demo");
    let set =
        |arguments: &[&str]| ground.json(&[&["set", "--channel", "demo", "--json"], arguments].concat());

    let first = set(&[
        "light.lamp.power_w=[2,4,8]",
        "object.sphere.position_m=[.1,0.9,0.1]",
        "light.lamp.enabled=true",
        "--wait",
    ]);
    has_keys(&first, &["channel", "frame", "requests", "waited_ms", "converged"]);
    assert_eq!(first["converged"], true);
    let requests = first["requests"].as_array().unwrap();
    assert_eq!(requests.len(), 2, "{first}");
    has_keys(&requests[0], &["type", "name", "values", "frame"]);
    assert_eq!(requests[0]["values"], json!({ "power_w": [2, 4, 8], "enabled": true }));
    assert_eq!((&requests[1]["type"], &requests[1]["name"]), (&json!("move_object"), &json!("sphere")));
    let shown = frame(&ground, "demo", first["frame"].as_u64().unwrap());
    assert_eq!((shown.lights[0].power, shown.statistics.converged), ([2.0, 4.0, 8.0], 1));

    let said = ground.run(&["set", "--channel", "demo", "light.lamp.enabled=false"]);
    said.expect(0, &[]);
    let number =
        said.stdout.trim().strip_prefix("light.lamp: visible from frame ").expect("the frame").parse();
    assert_eq!(frame(&ground, "demo", number.unwrap()).lights[0].enabled, 0);

    let state = || ground.json(&["channels", "--json"])["channels"][0]["state"].clone();
    assert_eq!(set(&["--pause", "--wait"])["requests"][0]["type"], "pause");
    wait_for("the pause", || (state() == "paused").then_some(()));
    set(&["--resume"]);
    wait_for("its end", || (state() == "running").then_some(()));

    let refused = |argument: &str, code: i32, parts: &[&str]| {
        ground.run(&["set", "--channel", "demo", argument]).expect(code, parts);
    };
    refused("light.sun.enabled=true", 1, &["light.sun was refused on channel 'demo' (unknown-name)", "lamp"]);
    refused("light.lamp.colour=3", 1, &["(unknown-key)"]);
    refused("lamp.power_w=3", 2, &["\"lamp\" is no kind of thing", "light, object, material, streaming"]);
    refused("light.lamp.power_w=[1,", 2, &["light.lamp.power_w=[1,\n", "^ character 2"]);
    simulation.signal(Signal::TERM);
    simulation.wait().expect(0, &[]);
    refused("light.lamp.power_w=3", 4, &["channel 'demo' does not exist"]);
    ground.run(&["set", "--channel", "demo"]).expect(2, &["KEY=VALUE"]);
    ground.run(&["set", "--pause", "light.lamp.power_w=3"]).expect(2, &["cannot be used with"]);
}
