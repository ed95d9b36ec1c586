//! The GPU renderer as a process: the pictures of the CPU, every frame in order whatever happens to the simulator, and
//! clear words where there is no adapter.

use crate::harness::{Ground, config, files, kill, wait_for};
use photonstream_film::Film;
use photonstream_protocol::{ControlClient, Reply, Request, Runtime};
use photonstream_renderer_wgpu::test_gpu;
use rustix::process::Signal;
use serde_json::json;
use std::time::Duration;

/// Numbers of the frames that the pictures of a folder show, in the order of their names.
fn frames_shown(ground: &Ground, folder: &str) -> Vec<u64> {
    let count = files(&ground.path(folder), "exr");
    let frame = |number: usize| {
        let path = ground.path(format!("{folder}/frame-{number:04}.exr"));
        Film::read_exr(&path).unwrap_or_else(|e| panic!("{number} of {count}: {e}")).metadata.frame.unwrap()
    };
    (1..=count).map(frame).collect()
}

/// A lamp that moves, and a simulator that is killed and comes back: the pictures show frames of both, each at most once
/// and in the order in which they were published.
#[test]
fn frames_are_shown_once_and_in_order_while_the_simulator_is_killed() {
    if test_gpu::gpu().is_none() {
        return;
    }
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line = "--renderer wgpu --software --headless --frames 100000 --sampling fresh --vsls 50 --pool 4096 \
                --size 24x24 --visibility none --channel moving --out film";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split_whitespace()).collect();
    let run = ground.start(&arguments);
    let runtime = Runtime::at(ground.runtime());
    let pictures = || files(&ground.path("film"), "png");
    let mut moves = 0;
    let mut drag = |until: usize| {
        let connect = || ControlClient::connect_in(&runtime, &"moving".parse().unwrap()).ok();
        let mut client = wait_for("the control socket", connect);
        while pictures() < until {
            moves += 1;
            let x = 0.4 * f64::from(moves % 20) / 20.0;
            let values = json!({ "position_m": [x, 1.9, 0.1] }).as_object().unwrap().clone();
            let request = Request::SetLight { name: "lamp".into(), values };
            let reply = client.request(&request, Duration::from_secs(60)).unwrap();
            assert!(matches!(reply, Reply::Ok { .. }), "{reply:?}");
        }
    };
    drag(10);
    let simulator = ground.process(" simulate ", None);
    kill(simulator, Signal::KILL);
    ground.process(" simulate ", Some(simulator));
    let before = pictures();
    drag(before + 10);
    run.signal(Signal::TERM);
    run.wait().expect(130, &["simulator was ended by signal 9 (SIGKILL)"]);
    ground.wait_for_silence();
    let shown = frames_shown(&ground, "film");
    assert!(shown.len() >= 20);
    // A new simulator counts from the beginning, or goes on: at most one step is not upwards.
    let back: Vec<_> = shown.windows(2).filter(|pair| pair[1] <= pair[0]).collect();
    assert!(back.len() <= 1, "{shown:?}");
}

/// One channel, two renderers: with shadow rays for the lamp the pictures are the same but for pixels on edges, of which
/// the rasteriser may see the other side.
#[test]
fn both_renderers_make_the_same_picture() {
    if test_gpu::gpu().is_none() {
        return;
    }
    let ground = Ground::new();
    let scene = config("two-rooms.toml");
    let line = "--vsls 100 --pool 8192 --size 96x64 --visibility none --show full,normal --json";
    let render = |renderer: &[&str], out: &str| {
        let arguments = ["render", &scene, "--out", out];
        let all: Vec<_> =
            arguments.into_iter().chain(line.split(' ')).chain(renderer.iter().copied()).collect();
        let report = ground.json(&all);
        assert_eq!((report["width_px"].as_u64(), report["height_px"].as_u64()), (Some(96), Some(64)));
        let layer = |name: &str| {
            let path = ground.path(out.replace(".exr", &format!("-{name}.exr")));
            Film::read_exr(&path).unwrap().layer(name).unwrap().pixels.clone()
        };
        (layer("full"), layer("normal"))
    };
    let (cpu, cpu_normals) = render(&[], "cpu.exr");
    for accumulation in ["tiled", "splat", "forward"] {
        let options =
            ["--renderer", "wgpu", "--software", "--shadows", "rays", "--accumulation", accumulation];
        let (gpu, normals) = render(&options, "gpu.exr");
        let same = |i: &usize| (normals[*i] - cpu_normals[*i]).length() < 1e-3;
        let seen: Vec<_> = (0..cpu.len()).filter(same).collect();
        assert!(seen.len() * 100 > cpu.len() * 99);
        let off =
            seen.iter().filter(|&&i| (gpu[i] - cpu[i]).length() > 0.01 * cpu[i].length() + 1e-4).count();
        assert!(off * 500 < cpu.len(), "{accumulation}: {off} of {} pixels", cpu.len());
    }
}

#[test]
fn options_that_cannot_be_are_refused_in_words() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let render = ["render", &scene, "--out", "x.png", "--size", "8x8"];
    let said = ground.run(&[&render[..], &["--accumulation", "splat"]].concat());
    said.expect(2, &["--accumulation splat is for --renderer wgpu alone"]);
    let said = ground.run(&["run", &scene, "--rays", "4", "--headless"]);
    said.expect(2, &["--rays 4 is for --renderer wgpu alone"]);
    let said = ground.run(&[&render[..], &["--visibility", "ao"]].concat());
    said.expect(
        1,
        &["visibility: found ao, expected none, rays, octahedral or shadow-maps here", "--renderer wgpu"],
    );
    let gpu = [&render[..], &["--renderer", "wgpu"]].concat();
    let said = ground.run(&[&gpu[..], &["--adapter", "no such adapter"]].concat());
    said.expect(6, &["no graphics adapter can be used", "--renderer cpu"]);
    // A machine without any driver.
    let mut command = ground.command(&gpu);
    command.env("VK_DRIVER_FILES", "/nonexistent.json").env("VK_ICD_FILENAMES", "/nonexistent.json");
    let said = ground.start_command(command).wait();
    said.expect(6, &["no graphics adapter can be used", "install a Vulkan driver"]);
}

/// A graphics device that cannot draw is replaced by the CPU, which makes all the pictures and is named in the report.
#[test]
fn the_cpu_takes_the_place_of_a_device_that_cannot_draw() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let line = "--renderer wgpu --headless --frames 2 --vsls 50 --pool 4096 --size 24x24 --visibility none --out film --json";
    let arguments: Vec<_> = ["run", &scene].into_iter().chain(line.split_whitespace()).collect();
    let mut command = ground.command(&arguments);
    command.env("VK_DRIVER_FILES", "/nonexistent.json").env("VK_ICD_FILENAMES", "/nonexistent.json");
    let said = ground.start_command(command).wait();
    said.expect(0, &["no graphics adapter can be used", "cpu takes its place", "film"]);
    let report: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    let renderer = &report["renderers"][0];
    assert_eq!((&renderer["replaced_by"], &renderer["failed"]), (&json!("cpu"), &json!(false)));
    assert_eq!(files(&ground.path("film"), "png"), 2);
}
