//! Turns `tests/hard-cases.md` into the list of its tests, and checks that each exists and that none of these is missing.

use photonstream_evaluation::hard_cases;
use std::path::Path;

/// Every row names a test that is there and a command that Cargo understands; every test of this folder has a row. That
/// every row is read is tested where it is read.
#[test]
fn every_case_names_a_test_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut named = Vec::new();
    for case in hard_cases::cases() {
        let (file, test) = case.test.split_once("::").unwrap();
        let source = std::fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(source.contains(&format!("fn {test}(")), "{file} has no test {test}");
        // The command in the report is of a package and a target that exist.
        let command = case.command().unwrap();
        let (folder, _) = file.split_once('/').unwrap();
        let manifest = std::fs::read_to_string(root.join(folder).join("Cargo.toml")).unwrap();
        assert!(manifest.contains(&format!("name = \"photonstream-{folder}\"")), "{command}");
        if let Some(target) = command.split_once("--test ").and_then(|(_, rest)| rest.split(' ').next()) {
            let tests = root.join(folder).join("tests");
            let is_there =
                tests.join(target).join("main.rs").exists() || tests.join(format!("{target}.rs")).exists();
            assert!(is_there, "{command}");
        }
        named.push((file.to_owned(), test.to_owned()));
    }
    for entry in std::fs::read_dir(root.join("tests/tests/hard")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let file = format!("tests/tests/hard/{name}");
        let source = std::fs::read_to_string(root.join(&file)).unwrap();
        let tests =
            source.split("#[test]").skip(1).filter_map(|rest| rest.split_once("fn ")?.1.split_once('('));
        for (test, _) in tests.filter(|_| name != "table.rs") {
            assert!(
                named.contains(&(file.clone(), test.to_owned())),
                "{file}::{test} is missing in hard-cases.md"
            );
        }
    }
}
