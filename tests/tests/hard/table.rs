//! Turns `tests/hard-cases.md` into the list of its tests, and checks that each exists and that none of these is missing.

use std::path::Path;

/// Every row has its six columns and names a test that is there; every test of this folder has a row.
#[test]
fn every_case_names_a_test_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let table = std::fs::read_to_string(root.join("tests/hard-cases.md")).unwrap();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| line.starts_with("| ") && line.contains("::"))
        .map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect())
        .collect();
    assert!(rows.len() > 50, "{} rows", rows.len());
    let mut named = Vec::new();
    for row in &rows {
        assert_eq!(row.len(), 6, "{row:?}");
        assert!(row.iter().all(|cell| !cell.is_empty()), "{row:?}");
        let (file, test) = row[1].trim_matches('`').split_once("::").unwrap();
        let source = std::fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(source.contains(&format!("fn {test}(")), "{file} has no test {test}");
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
