#![allow(clippy::unwrap_used)]

use super::{
    super::tests::{FILE, entry_with, parse, scene, settings},
    *,
};
use crate::vpl_placement::place_vpls;

/// `place` from a file of the text `config` onto one of the text `out`, and whether the rest of that stayed.
fn run(config: &str, out: &str) -> Result<(String, bool), VplMergeError> {
    let (file, keeps) = parse(config).merged(parse(out), "room.toml")?;
    let scene = scene();
    let placement = place_vpls(&scene, &settings(), &file.taken(&scene)).unwrap();
    Ok((file.with(&scene, &placement, 1.0), keeps))
}

fn first() -> String {
    let mut file = parse(FILE);
    file.made_from("room.toml");
    let scene = scene();
    let placement = place_vpls(&scene, &settings(), &file.taken(&scene)).unwrap();
    file.with(&scene, &placement, 1.0)
}

const BY_HAND: &str = "[[vpl]] # by hand
position_m = [0, -1, 0]  # the middle of the floor
normal = [0, 2, 0]
albedo = 0.25
";

const MORE: &str = "
[[vpl]] # new
position_m = [0.9, 0.9, -1]
normal = [0, 0, 1]
albedo = 0.75
";

fn with(text: &str, more: &str) -> String {
    text.replace(BY_HAND, &format!("{BY_HAND}{more}"))
}

#[test]
fn nothing_changes_where_nothing_has_changed() {
    let out = first();
    assert_eq!(run(FILE, &out), Ok((out, false)));
}

/// The rest is that of the file that has changed, whichever that is.
#[test]
fn what_has_changed_counts() {
    let out = first();
    let moved = |text: &str| text.replace("position_m = [0, 0, 0]", "position_m = [0, 0, 0.5] # moved");
    assert_eq!(run(&moved(FILE), &out), Ok((moved(&out).replace(&hash(FILE), &hash(&moved(FILE))), false)));
    let (kept, keeps_there) = run(FILE, &moved(&out)).unwrap();
    assert_eq!((kept, keeps_there), (moved(&out), true));
    // On both sides alike.
    assert!(!run(&moved(FILE), &moved(&out)).unwrap().1);
    let softer = format!("{FILE}\n[vpls]\nsoftening_m2 = 0.5\n");
    assert_eq!(run(&softer, &moved(&out)), Err(VplMergeError::BothChanged));
    let (softer, _) = run(&softer, &out).unwrap();
    assert!(softer.contains("[vpls]\nsoftening_m2 = 0.5\n"), "{softer}");
    // Made from another file, or from none.
    let other = out.replace(" room.toml", " other.toml");
    assert_eq!(run(&moved(FILE), &other), Err(VplMergeError::OtherScene));
    assert_eq!(run(&moved(FILE), FILE), Err(VplMergeError::OtherScene));
    assert!(run(FILE, &other).is_ok());
}

fn hash(text: &str) -> String {
    rest_of(&parse(text).document)
}

/// Made, edited or deleted by hand on either side, it is so in what comes of both, and nothing is there twice.
#[test]
fn both_sides_are_merged() {
    let out = first();
    let counts = |text: &str| {
        let counts = parse(text).counts;
        [counts.by_hand, counts.edited, counts.deleted]
    };
    // Added here; added there; added on both sides.
    for (config, there) in [
        (with(FILE, MORE), out.clone()),
        (FILE.into(), with(&out, MORE)),
        (with(FILE, MORE), with(&out, MORE)),
    ] {
        let (text, _) = run(&config, &there).unwrap();
        assert_eq!(text.matches("# new").count(), 1);
        assert_eq!(counts(&text), [2, 0, 0]);
        // And once more.
        assert_eq!(run(&config, &text).unwrap().0, text);
    }
    let darker = |text: &str| text.replace("albedo = 0.25", "albedo = 0.125");
    // Edited here; there; on both sides, where that there stays.
    for (config, there, albedo) in [
        (darker(FILE), out.clone(), "albedo = 0.125"),
        (FILE.into(), darker(&out), "albedo = 0.125"),
        (darker(FILE), out.replace("albedo = 0.25", "albedo = 0.5 # bright"), "albedo = 0.5 # bright"),
    ] {
        let (text, _) = run(&config, &there).unwrap();
        assert!(text.contains(albedo) && text.matches("position_m = [0, -1, 0]").count() == 1, "{text}");
        assert_eq!(counts(&text), [1, 0, 0]);
        assert_eq!(run(&config, &text).unwrap().0, text);
    }
    // Deleted here; there.
    let without = |text: &str| text.replace(BY_HAND, "");
    for (config, there) in [(without(FILE), out.clone()), (FILE.into(), without(&out))] {
        let (text, _) = run(&config, &there).unwrap();
        assert_eq!(counts(&text), [0, 0, 0]);
        assert_eq!(run(&config, &text).unwrap().0, text);
    }
    // What was placed and edited or deleted there, while the camera moves here.
    let moved = FILE.replace("position_m = [0, 0, 0]", "position_m = [0, 0, 0.5]");
    let entry = entry_with(&out, "placed = ");
    let (text, _) = run(&moved, &out.replace(&entry, "")).unwrap();
    assert!(text.contains("position_m = [0, 0, 0.5]"));
    assert_eq!(counts(&text), [1, 0, 1]);
    let edited = entry.replace("[[vpl]]", "[[vpl]] # mine");
    let (text, _) = run(&moved, &out.replace(&entry, &edited)).unwrap();
    assert!(text.contains(&edited));
    assert_eq!(counts(&text), [1, 1, 0]);
    // A comment at what is the same on both sides.
    let (text, _) = run(&moved, &out.replace("# by hand", "# by my hand")).unwrap();
    assert!(text.contains("[[vpl]] # by my hand"));
}

/// A file into which VPLs were placed is taken with what people made of them, and renews nothing but its own.
#[test]
fn marks_of_both_sides_stay() {
    let scene = scene();
    let placed = |file: VplFile| {
        let placement = place_vpls(&scene, &settings(), &file.taken(&scene)).unwrap();
        file.with(&scene, &placement, 1.0)
    };
    let config = placed(parse(FILE));
    let mut copy = parse(&config);
    copy.made_from("room.toml");
    let out = placed(copy);
    assert_eq!(run(&config, &out), Ok((out.clone(), false)));
    let entry = entry_with(&config, "placed = ");
    let (text, _) = run(&config.replace(&entry, ""), &out.replace(&entry, "")).unwrap();
    assert_eq!(parse(&text).counts.deleted, 1);
}
