//! A running scene is edited over the control socket: every process shows the edited scene, as if it had been loaded.

use crate::harness::{Ground, config, files, wait_for};
use photonstream_film::Film;
use photonstream_protocol::{
    AccessMode, ControlClient, Reading, Reply, Request, Runtime, Subscriber, VslFrame,
};
use serde_json::{Value, json};
use std::{fs, time::Duration};

const PATIENCE: Duration = Duration::from_secs(60);

/// A channel with a simulator, as its clients have it.
struct Channel<'g> {
    ground: &'g Ground,
    name: &'static str,
}

impl Channel<'_> {
    fn connect(&self) -> ControlClient {
        let runtime = Runtime::at(self.ground.runtime());
        wait_for("the control socket", || {
            ControlClient::connect_in(&runtime, &self.name.parse().unwrap()).ok()
        })
    }

    /// The first frame that satisfies `wanted`.
    fn frame(&self, wanted: impl Fn(&VslFrame) -> bool) -> VslFrame {
        let runtime = Runtime::at(self.ground.runtime());
        let name = self.name.parse().unwrap();
        let mut subscriber =
            Subscriber::attach_wait_in(&runtime, &name, AccessMode::Mapped, PATIENCE, &|| false).unwrap();
        wait_for("a frame", || {
            subscriber.wait(Duration::from_millis(20));
            (subscriber.read().unwrap() == Reading::New).then_some(())?;
            subscriber.frame().filter(|frame| wanted(frame)).cloned()
        })
    }

    /// The picture of the light as it is.
    fn picture(&self) -> Film {
        let out = format!("{}.exr", self.name);
        let arguments =
            ["render", "--channel", self.name, "--out", &out, "--size", "32x32", "--show", "full"];
        self.ground.json(&[&arguments[..], &["--json"]].concat());
        Film::read_exr(&self.ground.path(&out)).unwrap()
    }
}

fn is_converged(frame: &VslFrame) -> bool {
    frame.statistics.converged == 1
}

fn edit(client: &mut ControlClient, request: &Value) -> Reply {
    client.request(&serde_json::from_value::<Request>(request.clone()).unwrap(), PATIENCE).unwrap()
}

/// Cornell box, 60 lights, 8 192 paths, seed 1: sphere, box and lamp are moved while it runs, in several steps; the frame
/// promised has them in their places, and once converged frame and picture are those of a simulation of the edited
/// config. Exact: no tolerance.
#[test]
fn an_edited_scene_is_the_scene_of_the_edited_config() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let small = ["--vsls", "60", "--pool", "8192", "--threads", "2"];
    let simulate = |scene: &str, channel: &'static str| {
        ground.start(&[&["simulate", scene, "--channel", channel], &small[..]].concat())
    };
    let running = simulate(&scene, "edited");
    let edited = Channel { ground: &ground, name: "edited" };
    let mut client = edited.connect();
    let before = edited.frame(is_converged);
    let original = edited.picture();
    let mut promised = 0;
    for request in [
        json!({ "type": "move_object", "name": "sphere", "values": { "position_m": [0.1, 0.9, 0.1] } }),
        json!({ "type": "set_light", "name": "lamp", "values": { "position_m": [-0.4, 1.8, 0.2] } }),
        json!({ "type": "move_object", "name": "sphere", "values": { "position_m": [0.3, 0.5, 0.45] } }),
        json!({ "type": "move_object", "name": "box", "values": { "rotation_deg": [0, 40, 0] } }),
        json!({ "type": "set_light", "name": "lamp", "values": { "power_w": [10, 12.5, 14] } }),
    ] {
        let Reply::Ok { frame } = edit(&mut client, &request) else { panic!("{request}") };
        assert!(frame > before.frame);
        promised = frame;
    }
    let shown = edited.frame(|frame| frame.frame >= promised);
    let settled = edited.frame(|frame| frame.frame >= promised && is_converged(frame));
    assert_eq!((&shown.objects, &shown.lights), (&settled.objects, &settled.lights));

    let text = fs::read_to_string(&scene).unwrap();
    let changed = [
        ("[0.42, 0.36, 0.3]", "[0.3, 0.5, 0.45]"),
        ("rotation_deg = [0, 18, 0]", "rotation_deg = [0, 40, 0]"),
        ("position_m = [0.15, 1.95, 0.1]", "position_m = [-0.4, 1.8, 0.2]"),
        ("power_w = [14, 12.5, 10]", "power_w = [10, 12.5, 14]"),
    ]
    .iter()
    .fold(text, |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    let changed = ground.write("changed.toml", &changed);
    let anew = simulate(changed.to_str().unwrap(), "loaded");
    let loaded = Channel { ground: &ground, name: "loaded" };
    let expected = loaded.frame(is_converged);
    let places = |frame: &VslFrame| frame.objects.iter().map(|o| o.world_from_object).collect::<Vec<_>>();
    assert_eq!(places(&settled), places(&expected));
    assert_ne!(places(&settled), places(&before));
    let light = |frame: &VslFrame| {
        frame.vsls.iter().map(|v| (v.position, v.normal, v.area, v.flux, v.object)).collect::<Vec<_>>()
    };
    assert_eq!(light(&settled), light(&expected));
    let pixels = |film: &Film| film.layers().iter().map(|l| l.pixels.clone()).collect::<Vec<_>>();
    assert!(pixels(&edited.picture()) == pixels(&loaded.picture()));
    assert!(pixels(&edited.picture()) != pixels(&original));
    for simulation in [running, anew] {
        simulation.signal(rustix::process::Signal::TERM);
        simulation.wait().expect(0, &[]);
    }
}

/// A floor that loses its red and its blue while the CPU renderer takes picture after picture: those before the edit have
/// all three, those from the promised frame on have green alone. Exact: a reflectance of 0 leaves nothing.
#[test]
fn pictures_follow_a_material() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line = "--renderer cpu --headless --frames 100000 --sampling fresh --vsls 20 --pool 512 --size 24x24 \
                --visibility none --channel painted --out film";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split_whitespace()).collect();
    let run = ground.start(&arguments);
    let painted = Channel { ground: &ground, name: "painted" };
    // A picture's PNG is written after its EXR.
    let pictures = || files(&ground.path("film"), "png");
    let picture = |number: usize| {
        let film = Film::read_exr(&ground.path(format!("film/frame-{number:04}.exr"))).unwrap();
        // The floor before the sphere, one row above the picture's lower edge.
        (film.metadata.frame.unwrap(), film.layer("full").unwrap().pixels[22 * 24 + 12])
    };
    let mut client = painted.connect();
    wait_for("two pictures", || (pictures() >= 2).then_some(()));
    for number in 1..=2 {
        let (_, floor) = picture(number);
        assert!(floor.min_element() > 0.0, "picture {number}: {floor}");
    }
    let request = json!({ "type": "set_material", "name": "white", "values": { "albedo": [0, 0.75, 0] } });
    let Reply::Ok { frame: promised } = edit(&mut client, &request) else { panic!("{request}") };
    let last = wait_for("three pictures after the edit", || {
        let count = pictures();
        (count >= 3 && picture(count - 2).0 >= promised).then_some(count)
    });
    for number in last - 2..=last {
        let (frame, floor) = picture(number);
        assert!(frame >= promised && floor.y > 0.0, "picture {number}: {floor}");
        assert_eq!((floor.x, floor.z), (0.0, 0.0), "picture {number}");
    }
    run.signal(rustix::process::Signal::TERM);
    run.wait().expect(130, &[]);
    ground.wait_for_silence();
}

#[test]
fn bad_edits_are_refused_with_what_would_be_good() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let running = ground.start(&["simulate", &scene, "--channel", "edited", "--vsls", "20", "--pool", "512"]);
    let edited = Channel { ground: &ground, name: "edited" };
    let mut client = edited.connect();
    for (request, expected_code, part) in [
        (
            json!({ "type": "move_object", "name": "spere", "values": { "position_m": [0, 0, 0] } }),
            "unknown-name",
            "object: no object is called \"spere\", did you mean \"sphere\"?",
        ),
        (
            json!({ "type": "set_light", "name": "lamp", "values": { "power": 1 } }),
            "unknown-key",
            "light.lamp: unknown key \"power\", did you mean \"power_w\"?",
        ),
        (
            json!({ "type": "set_light", "name": "lamp", "values": { "outer_half_angle_deg": 200 } }),
            "invalid-value",
            "light.lamp.spot.outer_half_angle_deg: found 200, expected half an opening angle",
        ),
        (
            json!({ "type": "move_object", "name": "sphere", "values": { "position_m": [1, 2] } }),
            "invalid-value",
            "object.sphere.position_m: found [1,2], expected three numbers [x, y, z]",
        ),
    ] {
        match edit(&mut client, &request) {
            Reply::Error { code, message } => {
                assert_eq!(code, expected_code, "{message}");
                assert!(message.contains(part), "{message}");
            }
            other => panic!("{request}: {other:?}"),
        }
    }
    running.signal(rustix::process::Signal::TERM);
    running.wait().expect(0, &[]);
}
