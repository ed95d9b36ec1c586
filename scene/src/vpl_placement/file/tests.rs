#![allow(clippy::unwrap_used)]

use super::*;
use crate::{
    AssetRoots, SceneConfig,
    vpl_placement::{PlacedVpl, VplPlacementSettings, place_vpls},
};

/// A closed room, with comments, hand-made VPLs and odd spacing, which all have to stay.
pub(super) const FILE: &str = "\
# A room.
[object.room]   # closed
material = \"white\"
sides = \"back\"
box = { size_m = [2, 2, 2] }

[[vpl]] # by hand
position_m = [0, -1, 0]  # the middle of the floor
normal = [0, 2, 0]
albedo = 0.25

[streaming]
vsls = 100

[camera]
position_m = [0, 0, 0]
target_m = [0, 0, -1]
vertical_fov_deg = 60

[material.white]
albedo = 0.5

[light.lamp]
power_w = 1
point = { position_m = [0, 0.5, 0] }
# The end.
";

pub(super) fn scene() -> Scene {
    let start = FILE.find("[[vpl]]").unwrap();
    let end = FILE.find("[streaming]").unwrap();
    let text = FILE[..start].to_owned() + &FILE[end..];
    let config = SceneConfig::from_text(&text, Path::new("room.toml")).unwrap();
    config.build_with(&AssetRoots::default()).unwrap()
}

pub(super) fn parse(text: &str) -> VplFile {
    VplFile::parse(text, Path::new("room.toml")).unwrap()
}

/// A run of `place`: the file again, and what was placed.
pub(super) fn run(text: &str, settings: &VplPlacementSettings) -> (String, Vec<PlacedVpl>) {
    let (scene, file) = (scene(), parse(text));
    let placement = place_vpls(&scene, settings, &file.taken(&scene)).unwrap();
    (file.with(&scene, &placement, 1.0), placement.vpls)
}

pub(super) fn settings() -> VplPlacementSettings {
    VplPlacementSettings { population: 1024, spacing_m: Some(0.6), ..VplPlacementSettings::default() }
}

/// The text of the entry that holds `needle`, with its comment.
pub(super) fn entry_with(text: &str, needle: &str) -> String {
    let at = text.find(needle).unwrap();
    let start = text[..at].rfind("\n# ").unwrap();
    let end = text[at..].find("\n\n").map_or(text.len(), |end| at + end + 1);
    text[start..end].to_owned()
}

#[test]
fn what_was_there_stays_as_it_was() {
    let (text, vpls) = run(FILE, &settings());
    // Every line of the file, in order, and new ones only after them.
    let (before, end) = FILE.split_at(FILE.find("# The end.").unwrap());
    assert!(text.starts_with(before) && text.ends_with(end));
    let document: DocumentMut = text.parse().unwrap();
    assert_eq!(document["vpl"].as_array_of_tables().unwrap().len(), vpls.len() + 1);
    assert_eq!(
        parse(&text).counts,
        VplFileCounts { by_hand: 1, replaced: vpls.len() as u32, ..Default::default() }
    );
    // None where the one made by hand stands.
    let middle = glam::Vec3::new(0.0, -1.0, 0.0) - scene().origin_m.as_vec3();
    assert!(vpls.iter().all(|vpl| vpl.position.distance(middle) >= 0.6 || vpl.normal.y < 0.7));
}

#[test]
fn a_second_run_changes_nothing() {
    let (text, vpls) = run(FILE, &settings());
    assert_eq!(run(&text, &settings()), (text, vpls));
}

#[test]
fn other_settings_replace_what_was_placed() {
    let (text, few) = run(FILE, &settings());
    let finer = VplPlacementSettings { spacing_m: Some(0.4), ..settings() };
    let (again, many) = run(&text, &finer);
    assert!(many.len() > few.len());
    assert_eq!((again, many), run(FILE, &finer));
}

#[test]
fn edited_entries_stay_and_nothing_is_put_beside_them() {
    let (text, vpls) = run(FILE, &settings());
    let old = entry_with(&text, "placed = ");
    let line = old.lines().find(|line| line.starts_with("albedo")).unwrap();
    let new = old.replace(line, "albedo = [0.1, 0.2, 0.3] # darker");
    let edited = text.replace(&old, &new);
    let (again, after) = run(&edited, &settings());
    assert!(again.contains(&new) && again.starts_with(&FILE[..20]));
    assert_eq!(after.len(), vpls.len() - 1);
    let counts = parse(&again).counts;
    assert_eq!((counts.by_hand, counts.edited, counts.deleted), (1, 1, 0));
    // Also after it was moved away: its old place stays empty.
    let line = old.lines().find(|line| line.starts_with("position_m")).unwrap();
    let moved = text.replace(&old, &old.replace(line, "position_m = [0, 5, 0]"));
    let (again, after) = run(&moved, &settings());
    assert!(again.contains("position_m = [0, 5, 0]"));
    assert_eq!(after.len(), vpls.len() - 1);
    assert_eq!(run(&again, &settings()), (again, after));
}

#[test]
fn deleted_entries_stay_deleted() {
    let (text, vpls) = run(FILE, &settings());
    let entry = entry_with(&text, "placed = ");
    let hash = entry.split("placed = \"").nth(1).unwrap()[..16].to_owned();
    let (again, after) = run(&text.replace(&entry, ""), &settings());
    assert_eq!(after.len(), vpls.len() - 1);
    assert_eq!(parse(&again).counts.deleted, 1);
    // Also with another seed and spacing, which gives other hashes.
    let other = VplPlacementSettings { seed: 9, spacing_m: Some(0.5), ..settings() };
    let (third, placed) = run(&again, &other);
    assert_eq!(parse(&third).counts.deleted, 1);
    let site = parse(&third).former[0].site;
    let at = (site.position - scene().origin_m).as_vec3();
    let normal = site.normal.as_vec3();
    assert!(placed.iter().all(|vpl| vpl.position.distance(at) >= 0.5 || vpl.normal.dot(normal) < 0.7));
    // Until its line is deleted, too.
    let line = again.lines().find(|line| line.contains(&format!("\"{hash} "))).unwrap();
    let (restored, _) = run(&again.replace(&format!("{line}\n"), ""), &settings());
    assert_eq!(restored, text);
}

/// An edited copy stays, and does not take away what it was copied from.
#[test]
fn copies_leave_their_original() {
    let (text, vpls) = run(FILE, &settings());
    let entry = entry_with(&text, "placed = ");
    let line = entry.lines().find(|line| line.starts_with("position_m")).unwrap();
    // Outside the room, where nothing is placed.
    let copy = entry.replace(line, "position_m = [0, 5, 0]");
    let (again, after) = run(&format!("{text}{copy}"), &settings());
    assert!(again.contains(&entry) && again.contains("position_m = [0, 5, 0]"));
    assert_eq!(after, vpls);
    let counts = parse(&again).counts;
    assert_eq!((counts.by_hand, counts.edited, counts.deleted), (1, 1, 0));
    assert_eq!(run(&again, &settings()).0, again);
}

/// Comments stay wherever they are: below the last entry, at and in the list of what was placed, and at placed entries, which
/// then stay as they are.
#[test]
fn comments_stay() {
    let (text, vpls) = run(FILE, &settings());
    let deleted = entry_with(&text, "placed = ");
    let (without, _) = run(&text.replace(&deleted, ""), &settings());
    let (entries, list) = without.split_at(without.find("\n# What `photonstream place`").unwrap());
    let mut sites: Vec<String> = list.lines().map(|line| line.to_owned() + "\n").collect();
    let first = sites.iter().position(|line| line.starts_with("    \"")).unwrap();
    sites[first] = sites[first].replace('\n', " # of no use\n");
    sites[first + 1] = format!("    # the second\n{}", sites[first + 1]);
    let end = sites.iter().position(|line| line == "]\n").unwrap();
    sites[end] = "    # the last\n] # all\n".into();
    let list = sites
        .concat()
        .replace("[vpls.placed]", "[vpls.placed] # machine")
        .replace("sites =", "# which\nsites =");
    let edited = format!("{entries}\n# below all\n\n# still below\n{list}");
    let (again, after) = run(&edited, &settings());
    assert_eq!(after.len(), vpls.len() - 1);
    assert_eq!(again, edited);
    // What its line no longer has stays in the list.
    let other = VplPlacementSettings { spacing_m: Some(0.4), ..settings() };
    let (other, _) = run(&edited, &other);
    for comment in [
        "# of no use",
        "# the second",
        "# the last",
        "] # all",
        "# machine",
        "# which",
        "# below all\n\n# still below\n",
    ] {
        assert_eq!(other.matches(comment).count(), 1, "{comment}");
    }
    assert!(parse(&other).counts.deleted == 1);

    // Comments at an entry.
    let line = deleted.lines().find(|line| line.starts_with("normal")).unwrap();
    let at = |comment: &str| match comment {
        "above" => deleted.replacen("\n# ", "\n# Mine.\n# ", 1),
        "instead" => format!("\n# Mine.\n{}", &deleted[deleted.find("[[vpl]]").unwrap()..]),
        "header" => deleted.replace("[[vpl]]", "[[vpl]] # Mine."),
        "key" => deleted.replace(line, &format!("# Mine.\n{line}")),
        "value" => deleted.replace(line, &format!("{line} # Mine.")),
        _ => deleted.replace(line, &line.replace(']', "# Mine.\n]")),
    };
    for place in ["above", "instead", "header", "key", "value", "array"] {
        let commented = text.replace(&deleted, &at(place));
        let (again, after) = run(&commented, &settings());
        assert!(again.contains(&at(place)), "{place}\n{again}");
        assert_eq!((after.len(), parse(&again).counts.edited), (vpls.len() - 1, 1), "{place}");
    }
    // Only without its own comment it is still as it was written.
    let bare = text.replace(&deleted, &format!("\n{}", &deleted[deleted.find("[[vpl]]").unwrap()..]));
    assert_eq!(run(&bare, &settings()).0, text);
}

/// Tables that are written inline get headers; comments beside them go beside those, others above.
#[test]
fn comments_at_inline_tables_stay() {
    let inline = "\
# The lights.
vpl = [
    # One.
    { position_m = [0, -1, 0], normal = [0, 1, 0], albedo = 0.3 }, # low
    # Two.
    { position_m = [0, 1, 0], normal = [0, -1, 0], albedo = 0.3 } # high
] # mine
# How.
vpls = { softening_m2 = 0.01 } # soft
";
    let expected = "
# The lights.
# One.
[[vpl]] # low
position_m = [0, -1, 0]
normal = [0, 1, 0]
albedo = 0.3

# Two.
[[vpl]] # high
# mine
position_m = [0, 1, 0]
normal = [0, -1, 0]
albedo = 0.3

# How.
[vpls] # soft
softening_m2 = 0.01
";
    let start = FILE.find("[[vpl]]").unwrap();
    let rest = FILE[..start].to_owned() + &FILE[FILE.find("[streaming]").unwrap()..];
    let (text, _) = run(&format!("{inline}{rest}"), &settings());
    assert!(text.contains(expected), "{text}");
    assert_eq!(run(&text, &settings()).0, text);
    let (text, _) = run(
        &format!("vpl = [{{ position_m = [0, -1, 0], normal = [0, 1, 0], albedo = 0.3 }}] # mine\n{rest}"),
        &settings(),
    );
    assert!(text.starts_with("[[vpl]] # mine\n"), "{text}");
    let (text, _) = run(&format!("vpl = [] # mine\n{rest}"), &settings());
    assert!(text.contains("# mine\n"), "{text}");
}

#[test]
fn line_ends_stay() {
    let (text, _) = run(FILE, &settings());
    let (crlf, _) = run(&FILE.replace('\n', "\r\n"), &settings());
    assert_eq!(crlf, text.replace('\n', "\r\n"));
    assert_eq!(run(&crlf, &settings()).0, crlf);
}

/// The hash is that of values: order, spaces and the way numbers are written do not matter, other keys do.
#[test]
fn the_hash_is_that_of_the_values() {
    let hash = |text: &str| entry::hash(text.parse::<DocumentMut>().unwrap().as_table());
    let one = hash("position_m = [1.0, 2.0, 0.0]\nnormal = [0, 1, 0]\nobject = \"a\"\nplaced = \"x\"\n");
    assert_eq!(one, hash("object = 'a' # b\nnormal = [ 0.0, 1e0, -0.0 ]\nposition_m = [1, 2, 0]\n"));
    assert_ne!(one, hash("position_m = [1.0, 2.0, 0.001]\nnormal = [0, 1, 0]\nobject = \"a\"\n"));
    assert_ne!(one, hash("position_m = [1.0, 2.0, 0.0]\nnormal = [0, 1, 0]\nobject = \"b\"\n"));
    assert_ne!(one, hash("position_m = [1.0, 2.0, 0.0]\nnormal = [0, 1, 0]\nobject = \"a\"\nweight = 1\n"));
}

#[test]
fn inline_tables_are_read_and_settings_kept() {
    let inline = "vpl = [{ position_m = [0, -1, 0], normal = [0, 1, 0], albedo = 0.3 }]\nvpls = { softening_m2 = 0.01 }\n";
    let (text, vpls) =
        run(&format!("{inline}{FILE}").replace("[[vpl]] # by hand", "[material.unused]"), &settings());
    let document: DocumentMut = text.parse().unwrap();
    assert_eq!(document["vpl"].as_array_of_tables().unwrap().len(), vpls.len() + 1);
    assert_eq!(document["vpls"]["softening_m2"].as_float(), Some(0.01));
    assert_eq!(document["vpls"]["placed"]["sites"].as_array().unwrap().len(), vpls.len());
}

#[test]
fn what_cannot_be_read_is_named() {
    let error = VplFile::parse("[[vpl]]\nposition_m = [0, 1, 0]\n", Path::new("room.toml")).unwrap_err();
    let expected = "room.toml: vpl[0]: found no position_m and normal of three numbers each";
    assert_eq!(error.to_string(), expected);
    let error = VplFile::parse("[[vpl\n", Path::new("room.toml")).unwrap_err();
    assert!(error.to_string().starts_with("room.toml: not valid TOML"));
}

/// Written from one folder into another, the file finds its assets: beside it, below it, or anywhere else.
#[test]
fn assets_are_found_from_another_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["in/assets", "in/out", "other"] {
        std::fs::create_dir_all(path(name)).unwrap();
    }
    for name in ["in/a.obj", "in/assets/b.ply", "in/out/c.glb", "in/sky.exr"] {
        std::fs::write(path(name), "").unwrap();
    }
    let text = "\
[object.a]
obj = { path = \"a.obj\", up_axis = \"z\" } # kept
[object.b.ply]
path = 'b.ply'
[object.c]
gltf = { path = \"out/c.glb\" }
[object.d]
gltf = { path = \"missing.glb\" }
[light.sky]
sky = { map = \"sky.exr\" }
";
    let rebased = |to: &str| {
        let mut file = VplFile::parse(text, &path("in/x.toml")).unwrap();
        file.rebase_assets(&path("in/x.toml"), &path(to));
        file.document.as_table_mut().remove("vpl");
        file.document.to_string()
    };
    assert_eq!(rebased("in/y.toml"), text);
    let at = |name: &str| path(name).to_str().unwrap().to_owned();
    let expected = text
        .replace("\"a.obj\"", &format!("\"{}\"", at("in/a.obj")))
        .replace("'b.ply'", &format!("\"{}\"", at("in/assets/b.ply")))
        .replace("\"sky.exr\"", &format!("\"{}\"", at("in/sky.exr")));
    assert_eq!(rebased("in/out/y.toml"), expected.replace("out/c.glb", "c.glb"));
    assert_eq!(rebased("other/y.toml"), expected.replace("out/c.glb", &at("in/out/c.glb")));
}

/// The scene has the VPLs, and nothing of the notes about them; what saves a scene's VPLs into the file keeps those.
#[test]
fn a_placed_file_loads() {
    let (text, placed) = run(FILE, &settings());
    let scene = |text: &str| {
        let config = SceneConfig::from_text(text, Path::new("room.toml")).unwrap();
        config.build_with(&AssetRoots::default()).unwrap()
    };
    let whole = scene(&text);
    assert_eq!(whole.vpls.vpls.len(), placed.len() + 1);
    // Coordinates are written in millimetres' tenths, weights with three figures.
    for (vpl, placed) in whole.vpls.vpls[1..].iter().zip(&placed) {
        assert!((vpl.position - placed.position.as_dvec3()).length() < 1e-4);
        let area = placed.area_m2.unwrap();
        assert!((vpl.weight.unwrap() - area).abs() <= 0.005 * area);
    }
    assert!(!whole.resolved_text.contains("placed"));
    assert_eq!(whole.vpls.written_into(&text, Path::new("room.toml")).unwrap(), text);
}
