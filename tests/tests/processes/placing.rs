//! Virtual point lights are placed in scene files and models, and people's changes of them are kept.

use crate::harness::{Ground, config, has_keys};
use std::fs;

const FEW: [&str; 4] = ["--population", "512", "--max", "30"];

fn place<'a>(config: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["place", config, "--out", out][..], &FEW, more].concat()
}

/// The same file for one thread and two, which is valid; a second run changes no byte of it, an edited, a deleted and a
/// hand-made light and a comment stay.
#[test]
fn placed_lights_can_be_edited() {
    let ground = Ground::new();
    let scene = config("cornell-ball.toml");
    let mut texts = Vec::new();
    for (out, threads) in [("one.toml", "1"), ("two.toml", "2")] {
        let mut command = ground.command(&place(&scene, out, &[]));
        command.env("RAYON_NUM_THREADS", threads);
        ground.start_command(command).wait().expect(0, &[]);
        texts.push(fs::read_to_string(ground.path(out)).unwrap());
    }
    assert!(texts[0] == texts[1] && texts[0].contains("object = \"sphere\""));
    let first = ground.json(&place(&scene, "one.toml", &["--json"]));
    has_keys(
        &first,
        &"scene scene_from out vpls attached by_hand edited deleted replaced left_out taken without_surface wants_population \
         spacing_m origins reflections seconds"
            .split_whitespace()
            .collect::<Vec<_>>(),
    );
    assert_eq!(first["replaced"], first["vpls"]);
    assert_eq!(fs::read_to_string(ground.path("one.toml")).unwrap(), texts[0]);
    ground.run(&["check", "one.toml"]).expect(0, &[]);

    let (before, after) = texts[0].split_once("\n[[vpl]]").unwrap();
    let (deleted, rest) = after.split_once("\n[[vpl]]").unwrap();
    let (edited, rest) = rest.split_once("\nalbedo").unwrap();
    assert!(deleted.contains("placed"));
    let by_hand = "[[vpl]] # mine\nposition_m = [0, 1, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n";
    let text = format!("# Kept.\n{before}\n{by_hand}\n[[vpl]]{edited}\nweight = 7 # more\nalbedo{}", {
        // The weight it had.
        let (values, rest) = rest.split_once("weight = ").unwrap();
        format!("{values}{}", rest.split_once('\n').unwrap().1)
    });
    ground.write("one.toml", &text);
    let again =
        ground.json(&["place", "one.toml", "--out", "one.toml", "--seed", "5", "--max", "40", "--json"]);
    let count = |key: &str| again[key].as_u64().unwrap();
    assert_eq!([count("by_hand"), count("edited"), count("deleted")], [1, 1, 1]);
    let text = fs::read_to_string(ground.path("one.toml")).unwrap();
    assert!(text.starts_with("# Kept.\n") && text.contains(by_hand) && text.contains("weight = 7 # more"));
    ground.run(&["check", "one.toml"]).expect(0, &[]);
    // It is no longer made of another scene.
    let other = config("two-rooms.toml");
    ground.run(&place(&other, "one.toml", &[])).expect(2, &["one.toml is there already"]);
}

/// What has changed in the scene file since comes into the file that was made from it, beside what was changed there by hand.
#[test]
fn changes_of_the_scene_come_along() {
    let ground = Ground::new();
    let scene = fs::read_to_string(config("cornell-box.toml")).unwrap();
    ground.write("room.toml", &scene);
    ground.run(&place("room.toml", "out.toml", &[])).expect(0, &[]);
    let placed = fs::read_to_string(ground.path("out.toml")).unwrap();
    let by_hand =
        |x: &str| format!("\n[[vpl]]\nposition_m = [{x}, 0.5, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n");
    // One light is made by hand in each file, one deleted, and a comment written; the camera has moved.
    let (before, after) = placed.split_once("\n[[vpl]]").unwrap();
    let after = after.split_once("\n[[vpl]]").unwrap().1;
    ground.write("out.toml", &format!("{before}\n[[vpl]] # mine{after}{}", by_hand("0.125")));
    let camera = scene.lines().find(|line| line.starts_with("vertical_fov_deg")).unwrap();
    let scene = scene.replace(camera, "vertical_fov_deg = 33") + &by_hand("0.25");
    ground.write("room.toml", &scene);
    for _ in 0..2 {
        let found = ground.json(&place("room.toml", "out.toml", &["--json"]));
        let count = |key: &str| found[key].as_u64().unwrap();
        assert_eq!([count("by_hand"), count("edited"), count("deleted")], [2, 1, 1]);
        assert_eq!(found["scene_from"], "room.toml");
        let text = fs::read_to_string(ground.path("out.toml")).unwrap();
        for once in ["vertical_fov_deg = 33\n", "[[vpl]] # mine\n", "[0.125, 0.5, 0]\n", "[0.25, 0.5, 0]\n"] {
            assert_eq!(text.matches(once).count(), 1, "{once}");
        }
    }
    ground.run(&["check", "out.toml"]).expect(0, &[]);
    // Changed there, it stays; on both sides, nothing is written.
    let text = fs::read_to_string(ground.path("out.toml")).unwrap().replace("deg = 33", "deg = 44");
    ground.write("out.toml", &text);
    let said = ground.run(&place("room.toml", "out.toml", &[]));
    said.expect(0, &[]);
    assert!(said.stdout.contains("the rest stays as in out.toml"), "{said:?}");
    assert_eq!(fs::read_to_string(ground.path("out.toml")).unwrap(), text);
    ground.write("room.toml", &scene.replace("deg = 33", "deg = 55"));
    ground
        .run(&place("room.toml", "out.toml", &[]))
        .expect(2, &["out.toml is there already", "both were changed"]);
    assert_eq!(fs::read_to_string(ground.path("out.toml")).unwrap(), text);
}

/// A link stays one, whether what it leads to is there or not; a file keeps its permissions.
#[cfg(unix)]
#[test]
fn links_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let ground = Ground::new();
    fs::create_dir(ground.path("far")).unwrap();
    symlink("far/file.toml", ground.path("link.toml")).unwrap();
    let scene = config("cornell-box.toml");
    for seed in ["1", "2"] {
        ground.run(&place(&scene, "link.toml", &["--seed", seed])).expect(0, &[]);
        assert!(ground.path("link.toml").symlink_metadata().unwrap().is_symlink());
        let file = ground.path("far/file.toml");
        assert!(fs::read_to_string(&file).unwrap().contains("[[vpl]]"));
        if seed == "2" {
            assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o640);
        }
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    }
}

/// What more paths would give, and what they leave without surface, is told.
#[test]
fn too_few_paths_are_told() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    let dense = ["--population", "64", "--max", "1000"];
    let said = ground.run(&[&["place", &scene, "--out", "a.toml"], &dense[..]].concat());
    said.expect(0, &[]);
    assert!(said.stdout.contains("more --population gives more"), "{said:?}");
    // A room without a way out: the one path is reflected.
    ground.write(
        "closed.toml",
        "[camera]\nposition_m = [0, 0, 0]\ntarget_m = [0, 0, -1]\nvertical_fov_deg = 60\n\
         [material.white]\nalbedo = 0.5\n\
         [object.room]\nmaterial = \"white\"\nsides = \"back\"\nbox = { size_m = [2, 2, 2] }\n\
         [light.lamp]\npower_w = 1\npoint = { position_m = [0, 0.5, 0] }\n",
    );
    let none = ["--population", "1", "--depth", "1", "--spacing-m", "1e-6"];
    ground
        .run(&[&["place", "closed.toml", "--out", "b.toml"], &none[..]].concat())
        .expect(1, &["more paths with --population"]);
    assert!(!ground.path("b.toml").exists());
}

/// A model in another folder, which the scene file finds.
#[test]
fn models_are_placed_in() {
    let ground = Ground::new();
    fs::create_dir(ground.path("models")).unwrap();
    ground.write("models/floor.obj", "v -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n");
    let said = ground.run(&place("models/floor.obj", "out/floor.toml", &[]));
    said.expect(0, &[]);
    assert!(said.stdout.contains("VPLs placed in floor"), "{said:?}");
    ground.run(&["check", "out/floor.toml"]).expect(0, &[]);
    let again = ground.json(&place("models/floor.obj", "out/floor.toml", &["--json"]));
    assert_eq!(again["replaced"], again["vpls"]);
}

#[test]
fn what_makes_no_sense_is_named() {
    let ground = Ground::new();
    let scene = config("cornell-box.toml");
    ground.run(&["place", &scene]).expect(2, &["--out"]);
    ground
        .run(&place(&scene, "a.toml", &["--depth", "0"]))
        .expect(2, &["depth: found 0, expected a whole number"]);
    ground
        .run(&place(&scene, "a.toml", &["--spacing-m", "-1"]))
        .expect(2, &["spacing_m: found -1, expected a length"]);
    ground.run(&place(&scene, "a.toml", &["--from", "1,2"])).expect(2, &["expected three numbers of metres"]);
    ground.run(&place(&scene, "a.glb", &[])).expect(2, &["a.glb is called like a model"]);
    ground.run(&place("nowhere.toml", "a.toml", &[])).expect(3, &["nowhere.toml: cannot be read"]);
    assert!(!ground.path("a.toml").exists());
}
