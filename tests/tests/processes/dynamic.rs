//! Scenes that change under running renderers: nothing stalls, nothing goes dark, nothing is left behind, and what rests
//! rests.

use crate::harness::{Ground, config, files, wait_for};
use photonstream_film::Film;
use photonstream_protocol::{
    AccessMode, ControlClient, Reading, Reply, Request, Runtime, Subscriber, VslFrame,
};
use photonstream_renderer_wgpu::test_gpu;
use rustix::process::Signal;
use serde_json::{Value, json};
use std::{
    fs,
    time::{Duration, Instant},
};

const PATIENCE: Duration = Duration::from_secs(60);

fn attach(ground: &Ground, channel: &str) -> Subscriber {
    let runtime = Runtime::at(ground.runtime());
    Subscriber::attach_wait_in(&runtime, &channel.parse().unwrap(), AccessMode::Mapped, PATIENCE, &|| false)
        .unwrap()
}

fn frame_where(subscriber: &mut Subscriber, wanted: impl Fn(&VslFrame) -> bool) -> VslFrame {
    wait_for("a frame", || {
        subscriber.wait(Duration::from_millis(20));
        (subscriber.read().unwrap() == Reading::New).then_some(())?;
        subscriber.frame().filter(|frame| wanted(frame)).cloned()
    })
}

fn send(ground: &Ground, channel: &str, request: Value) {
    let runtime = Runtime::at(ground.runtime());
    let connect = || ControlClient::connect_in(&runtime, &channel.parse().unwrap()).ok();
    let mut client = wait_for("the control socket", connect);
    let request: Request = serde_json::from_value(request).unwrap();
    let reply = client.request(&request, PATIENCE).unwrap();
    assert!(matches!(reply, Reply::Ok { .. }), "{reply:?}");
}

/// Mean of all channels of a picture's full layer.
fn brightness(film: &Film) -> f32 {
    let pixels = &film.layer("full").unwrap().pixels;
    pixels.iter().map(|pixel| pixel.element_sum()).sum::<f32>() / (3.0 * pixels.len() as f32)
}

/// One simulator, a renderer on the CPU and one on the GPU: while the ball of the scene moves, the config is saved good and
/// broken, a light dragged and the number of lights changed. Both go on with pictures that have light, and both end with
/// the same scene: red light.
#[test]
fn two_renderers_follow_every_change_of_one_simulation() {
    if test_gpu::gpu().is_none() {
        return;
    }
    let ground = Ground::new();
    let text = fs::read_to_string(config("cornell-ball.toml")).unwrap();
    let scene = ground.write("scene.toml", &text);
    let line = "--renderer cpu --renderer wgpu --software --headless --frames 100000 --vsls 60 --pool 4096 --size 24x24 \
                --visibility none --shadows rays --channel dynamic --out film";
    let arguments: Vec<_> =
        ["run", scene.to_str().unwrap()].into_iter().chain(line.split_whitespace()).collect();
    let run = ground.start(&arguments);
    let folders = ["film/cpu", "film/wgpu"];
    let pictures = || folders.map(|folder| files(&ground.path(folder), "png"));
    let both_go_on = |what: &str| {
        let before = pictures();
        wait_for(what, || {
            let now = pictures();
            (now[0] >= before[0] + 2 && now[1] >= before[1] + 2).then_some(())
        });
    };
    both_go_on("the first pictures of both");
    let mut subscriber = attach(&ground, "dynamic");
    for step in 0..6 {
        match step {
            0 => {
                _ = ground.write("scene.toml", &text.replace("power_w = [14, 12.5, 10]", "power_w = [20, 10"))
            }
            1 => _ = ground.write("scene.toml", &text.replace("[0.63, 0.065, 0.05]", "[0.1, 0.1, 0.7]")),
            2 => {
                let values = json!({ "position_m": [0.4, 1.9, -0.2] });
                send(&ground, "dynamic", json!({ "type": "set_light", "name": "lamp", "values": values }));
            }
            3 => send(&ground, "dynamic", json!({ "type": "set_streaming", "values": { "vsls": 150 } })),
            4 => _ = ground.write("scene.toml", ""),
            _ => {
                _ = ground
                    .write("scene.toml", &text.replace("power_w = [14, 12.5, 10]", "power_w = [30, 0, 0]"))
            }
        }
        if step == 0 {
            frame_where(&mut subscriber, |frame| frame.notice.contains("scene.toml:"));
        }
        both_go_on(&format!("pictures after step {step}"));
    }
    let is_red = |frame: &VslFrame| frame.lights[0].power == [30.0, 0.0, 0.0] && frame.notice.is_empty();
    let red = frame_where(&mut subscriber, is_red).frame;
    wait_for("pictures of the last scene", || {
        let shows_it = |folder: &&str| {
            let newest = ground.path(format!("{folder}/frame-{:04}.exr", files(&ground.path(folder), "png")));
            Film::read_exr(&newest).is_ok_and(|film| film.metadata.frame.is_some_and(|frame| frame >= red))
        };
        folders.iter().all(shows_it).then_some(())
    });
    run.signal(Signal::TERM);
    run.wait().expect(130, &["scene.toml:"]);
    ground.wait_for_silence();
    for folder in folders {
        let count = files(&ground.path(folder), "exr");
        let film = |number| Film::read_exr(&ground.path(format!("{folder}/frame-{number:04}.exr"))).unwrap();
        let dark = (1..=count).filter(|&number| brightness(&film(number)) < 1e-3).count();
        assert_eq!(dark, 0, "{folder}: dark pictures among {count}");
        let last = film(count);
        assert!(last.metadata.frame.unwrap() >= red, "{folder}: {:?} of {red}", last.metadata.frame);
        let pixels = &last.layer("full").unwrap().pixels;
        assert!(pixels.iter().all(|pixel| pixel.y == 0.0 && pixel.z == 0.0), "{folder}: red light alone");
    }
}

/// Ticks of processor time of a process, and its memory in KiB, open files and threads.
fn usage(pid: i32) -> [u64; 4] {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    let number = |index: usize| fields[index].parse::<u64>().unwrap();
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = |key: &str| {
        let line = status.lines().find(|line| line.starts_with(key)).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
    };
    let files = fs::read_dir(format!("/proc/{pid}/fd")).unwrap().count() as u64;
    [number(11) + number(12), line("VmRSS:"), files, line("Threads:")]
}

/// A converged scene whose config is watched, and which was refined beyond the pool before: less than 1 % of one processor
/// over 5 s, that is under 5 ticks of 10 ms.
#[test]
fn a_converged_scene_uses_no_processor() {
    let ground = Ground::new();
    let scene = ground.write("scene.toml", &{
        let text = fs::read_to_string(config("cornell-box.toml")).unwrap();
        format!("{text}\n[streaming]\ntarget_error = 0.05\nvsls = 200\npool_paths = 8192\n")
    });
    let run = ground.start(&["simulate", scene.to_str().unwrap(), "--channel", "idle"]);
    let mut subscriber = attach(&ground, "idle");
    let frame = frame_where(&mut subscriber, |frame| frame.statistics.converged == 1);
    assert!(frame.statistics.refined_paths > 0 && frame.statistics.relative_error <= 0.05);
    let pid = ground.process(" simulate ", None);
    let before = usage(pid);
    std::thread::sleep(Duration::from_secs(5));
    let ticks = usage(pid)[0] - before[0];
    assert!(ticks < 5, "{ticks} ticks of 10 ms in 5 s");
    run.signal(Signal::TERM);
    run.wait();
}

/// A scene that moves and never converges (each step makes up to a fifth of a million paths stale, more than one thread traces
/// until the next), paused in the middle by the control socket: less than 1 % of one processor over
/// 5 s, that is under 5 ticks of 10 ms; then it goes on.
#[test]
fn a_paused_scene_uses_no_processor() {
    let ground = Ground::new();
    let scene = config("cornell-ball.toml");
    let line = "--channel paused --vsls 200 --pool 1048576 --threads 1 --sampling fresh";
    let arguments: Vec<_> = ["simulate", &scene].into_iter().chain(line.split_whitespace()).collect();
    let run = ground.start(&arguments);
    let mut subscriber = attach(&ground, "paused");
    frame_where(&mut subscriber, |frame| frame.statistics.simulation_time_s > 0.1);
    send(&ground, "paused", json!({ "type": "pause" }));
    let runtime = Runtime::at(ground.runtime());
    let mut client = ControlClient::connect_in(&runtime, &"paused".parse().unwrap()).unwrap();
    let mut paths = || match client.request(&Request::Query, PATIENCE).unwrap() {
        Reply::State { state } => {
            assert_eq!((&state["paused"], &state["converged"]), (&json!(true), &json!(false)));
            state["paths"].as_u64().unwrap()
        }
        other => panic!("{other:?}"),
    };
    // What is in flight still arrives.
    let mut before = paths();
    wait_for("the last paths", || {
        std::thread::sleep(Duration::from_millis(200));
        let last = std::mem::replace(&mut before, paths());
        (last == before).then_some(())
    });
    let pid = ground.process(" simulate ", None);
    let used = usage(pid);
    std::thread::sleep(Duration::from_secs(5));
    let ticks = usage(pid)[0] - used[0];
    assert!(ticks < 5, "{ticks} ticks of 10 ms in 5 s");
    assert_eq!(paths(), before);
    send(&ground, "paused", json!({ "type": "resume" }));
    frame_where(&mut subscriber, |frame| frame.statistics.paths_total > before);
    run.signal(Signal::TERM);
    run.wait();
}

/// A moving light for 2·10⁷ deposits (10⁹ with `PHOTONSTREAM_LONG=1`), then off: exactly nothing is left; memory, files and
/// threads are those of the first tenth.
#[test]
fn a_long_run_leaves_nothing_behind() {
    let deposits = if std::env::var_os("PHOTONSTREAM_LONG").is_some() { 1_000_000_000 } else { 20_000_000 };
    let ground = Ground::new();
    let scene = config("cornell-light.toml");
    let line = "--channel long --vsls 300 --pool 16384 --sampling fresh";
    let arguments: Vec<_> = ["simulate", &scene].into_iter().chain(line.split_whitespace()).collect();
    let run = ground.start(&arguments);
    let mut subscriber = attach(&ground, "long");
    let pid = ground.process(" simulate ", None);
    let mut reach = |part: u64| {
        let begun = Instant::now();
        loop {
            subscriber.wait(Duration::from_millis(100));
            subscriber.read().unwrap();
            if subscriber.frame().is_some_and(|f| f.statistics.deposits_total >= part) {
                return;
            }
            assert!(begun.elapsed() < Duration::from_secs(3600), "no {part} deposits");
        }
    };
    reach(deposits / 10);
    let early = usage(pid);
    reach(deposits);
    let late = usage(pid);
    // Arenas fill up their last blocks in the beginning: a tenth, and 4 MiB for small totals.
    assert!(late[1] <= early[1] * 11 / 10 + 4096, "KiB: {early:?} {late:?}");
    assert_eq!(late[2..], early[2..], "files and threads");
    let off = json!({ "type": "set_light", "name": "lamp", "values": { "enabled": false } });
    send(&ground, "long", off);
    let mut subscriber = attach(&ground, "long");
    let dark = frame_where(&mut subscriber, |frame| frame.lights[0].enabled == 0);
    assert!(dark.vsls.iter().all(|vsl| vsl.flux == [0.0; 3] && vsl.standard_error == 0.0));
    run.signal(Signal::TERM);
    run.wait();
}
