//! What commands tell, to people and to programs.

use crate::harness::{Ground, config, has_keys};

const COMMANDS: [&str; 15] = [
    "run",
    "simulate",
    "render",
    "reference",
    "compare",
    "inspect",
    "record",
    "replay",
    "set",
    "check",
    "config",
    "place",
    "channels",
    "clean",
    "bench",
];

#[test]
fn every_command_has_help() {
    let ground = Ground::new();
    let help = ground.run(&["--help"]);
    help.expect(0, &[]);
    for part in COMMANDS.iter().chain(&["Examples:", "Exit codes:"]) {
        assert!(help.stdout.contains(part), "{part}: {}", help.stdout);
    }
    for command in COMMANDS {
        let help = ground.run(&[command, "--help"]);
        help.expect(0, &[]);
        assert!(
            help.stdout.contains("Usage: photonstream") && help.stdout.contains("JSON"),
            "{}",
            help.stdout
        );
    }
    let version = ground.run(&["--version"]);
    assert!(version.stdout.starts_with("photonstream 0."), "{version:?}");
}

#[test]
fn json_reports_have_their_documented_keys() {
    let ground = Ground::new();
    let scene = config("two-rooms.toml");
    let small = ["--vsls", "60", "--pool", "2048"];
    let keys = |text: &'static str| text.split_whitespace().collect::<Vec<_>>();

    let check = ground.json(&["check", &scene, "--json"]);
    has_keys(
        &check,
        &keys(
            "scene scene_hash objects triangles materials lights method method_reasons published_lights vpls blockers \
             proxies vsls pool_paths width_px height_px kernel visibility origin_m extent_m choices notices decisions",
        ),
    );
    has_keys(&check["decisions"][0], &keys("what modelled reason"));
    // Like all commands that take a scene: with other settings.
    let cell = config("cell.toml");
    let methods = ["static-vpl", "phantom-vpl"].map(|method| {
        let check = ground.json(&["check", &cell, "--method", method, "--json"]);
        (check["method"].as_str() == Some(method), check["published_lights"].as_u64().unwrap())
    });
    assert!(methods[0].0 && methods[1].0 && methods[0].1 > methods[1].1, "{methods:?}");

    let render = ground
        .json(&[&["render", &scene, "--out", "r.exr", "--size", "12x8", "--json"], &small[..]].concat());
    has_keys(
        &render,
        &keys(
            "scene scene_hash pictures frame vsls photon_paths rays_per_s converged simulation_ms first_picture_s \
             render_ms total_s width_px height_px range_loss_share range_error",
        ),
    );
    assert_eq!((&render["vsls"], &render["converged"]), (&60.into(), &true.into()));

    let reference =
        ground.json(&["reference", &scene, "--out", "t.exr", "--size", "12x8", "--spp", "4", "--json"]);
    has_keys(
        &reference,
        &keys(
            "scene scene_hash pictures samples_per_pixel noise_rel_rmse noise_direct_rel_rmse noise_indirect_rel_rmse \
             rays render_ms width_px height_px",
        ),
    );

    let compare = ground.json(&["compare", "r.exr", "t.exr", "--json"]);
    has_keys(
        &compare,
        &keys(
            "picture reference layer rel_rmse rel_mse bias worst_1pct flip maps mean_a mean_b red green blue \
             reference_noise_rel_rmse at_noise_floor",
        ),
    );

    let run = ground.json(&[&["run", &scene, "--headless", "--size", "8x8", "--json"], &small[..]].concat());
    has_keys(&run, &keys("scene channel total_s simulator_restarts renderers recording"));
    has_keys(&run["renderers"][0], &keys("name folder pictures restarts failed replaced_by"));

    has_keys(&ground.json(&["channels", "--json"]), &keys("runtime_dir channels"));
    has_keys(&ground.json(&["clean", "--json"]), &keys("removed"));

    let paper = ground.json(&["bench", "--paper", "--quick", "--cache", "cache", "--json"]);
    has_keys(
        &paper,
        &keys("machine adapter without_adapter seconds error_size reference_spp scenes pictures skipped"),
    );
    assert_eq!(
        (&paper["scenes"][0]["paper_polygons"], &paper["scenes"][0]["triangles"]),
        (&2006.into(), &2006.into())
    );
    let picture = &paper["pictures"][0];
    has_keys(
        picture,
        &keys(
            "scene width height vsls paper_deferred_per_s paper_whole_per_s per_s rel_rmse_paper rel_rmse_octahedral",
        ),
    );
    assert!(picture["per_s"][0][1].as_f64().unwrap() > 0.0, "{paper}");

    let simulation = ground.start(&[&["simulate", &scene, "--channel", "r", "--json"], &small[..]].concat());
    ground.segment("r");
    let channels = ground.json(&["channels", "--json"]);
    has_keys(
        &channels["channels"][0],
        &keys("name state pid epoch frame heartbeat_age_ms segment_bytes problem"),
    );
    let inspect = ground.json(&["inspect", "--channel", "r", "--json"]);
    has_keys(
        &inspect,
        &keys(
            "channel state state_reason abi epoch frame config_generation notice frame_age_ms scene scene_hash vsls \
             method shining update_us \
             objects lights threads converged simulation_time_s paths_total rays_total deposits_total escaped rejected \
             truncated absorbed_back paths_per_s rays_per_s deposits_per_s pool_paths pool_capacity pool_valid \
             refined_paths stale_share mean_age_s greatest_age_s relative_error target_error retraced_paths rays_saved \
             latency_ms latency_target_ms change \
             total_flux_w decisions",
        ),
    );
    assert_eq!(inspect["method"], "photon-streaming");
    ground.json(&["set", "streaming.method=instant-radiosity", "--channel", "r", "--json"]);
    let text = ground.run(&["inspect", "--channel", "r"]).stdout;
    assert!(text.contains("method   instant-radiosity: ") && !text.contains("paths/s"), "{text}");
    simulation.signal(rustix::process::Signal::TERM);
    let summary = serde_json::from_str::<serde_json::Value>(&simulation.wait().stdout).unwrap();
    assert_eq!(summary["ending"], "stopped");
    assert!(summary["frames"].as_u64().unwrap() > 0 && summary["paths"].as_u64().unwrap() > 0, "{summary}");
}

#[test]
fn results_go_to_stdout_and_logs_to_stderr() {
    let ground = Ground::new();
    let scene = config("two-rooms.toml");
    let arguments = ["render", &scene, "--out", "r.png", "--size", "8x8", "--vsls", "60", "--pool", "2048"];
    let said = ground.run(&arguments);
    said.expect(0, &["simulating"]);
    let lines: Vec<_> = said.stdout.lines().collect();
    assert!(lines.len() == 2 && lines[0] == "r.png" && lines[1].contains("60 VSLs"), "{said:?}");
    let quiet = ground.run(&[&arguments[..], &["-q"]].concat());
    assert_eq!(quiet.stderr, "", "{quiet:?}");
    // A reader that goes away early is no error.
    let script = format!("{} check {scene} | true", crate::harness::PHOTONSTREAM);
    let status =
        std::process::Command::new("bash").args(["-c", &format!("set -o pipefail; {script}")]).status();
    assert!(status.unwrap().success());
}
