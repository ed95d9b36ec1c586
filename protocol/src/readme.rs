//! Turns the record structures into the tables of `README.md`, and compares.

use std::fmt::Write;

use crate::layout::ABI_MAJOR;
use crate::record::{ArrayKind, FieldType, LAYOUT_HASH};

fn tables() -> String {
    let mut text = String::new();
    for kind in ArrayKind::ALL.into_iter().filter(|kind| !kind.fields().is_empty()) {
        let number = kind as u64;
        writeln!(text, "**`{}`** (kind {number}, {} bytes)\n", kind.name(), kind.record_bytes()).unwrap();
        text.push_str("| byte | field | type |\n|---|---|---|\n");
        for field in kind.fields() {
            let (name, size) = match field.kind {
                FieldType::U32 => ("u32", 4),
                FieldType::U64 => ("u64", 8),
                FieldType::F32 => ("f32", 4),
                FieldType::F64 => ("f64", 8),
            };
            let count = if field.size == size { String::new() } else { format!(" × {}", field.size / size) };
            writeln!(text, "| {} | `{}` | {name}{count} |", field.offset, field.name).unwrap();
        }
        text.push('\n');
    }
    text
}

#[test]
fn the_readme_shows_the_records_as_they_are() {
    let readme = include_str!("../README.md");
    assert!(readme.contains(tables().trim()), "expected in README.md:\n{}", tables());
    assert!(readme.contains(&format!("{LAYOUT_HASH:#018x}")), "layout hash {LAYOUT_HASH:#018x}");
    for words in
        [format!("ABI {ABI_MAJOR};"), format!("ABI major = {ABI_MAJOR} "), format!("\"abi\":{ABI_MAJOR}}}")]
    {
        assert!(readme.contains(&words), "{words}");
    }
}
