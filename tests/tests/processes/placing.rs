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
        &"scene out vpls attached by_hand edited deleted replaced left_out taken without_surface spacing_m origins reflections \
         seconds"
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
    ground.run(&place(&scene, "a.toml", &["--from", "1,2"])).expect(2, &["expected three numbers of metres"]);
    ground.run(&place(&scene, "a.glb", &[])).expect(2, &["a.glb is called like a model"]);
    ground.run(&place("nowhere.toml", "a.toml", &[])).expect(3, &["nowhere.toml: cannot be read"]);
    assert!(!ground.path("a.toml").exists());
}
