//! Turns `tests/hard-cases.md` into its rows.

use std::sync::OnceLock;

const TEXT: &str = include_str!("../../../tests/hard-cases.md");

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// What is hard.
    pub case: String,
    /// The test: FILE::NAME, the file from the root of the repository.
    pub test: String,
    /// What the test suite found at this version.
    pub figure: String,
    /// What it may be.
    pub tolerance: String,
    /// Why that much.
    pub reason: String,
    /// What would break without the measure taken.
    pub breaks: String,
}

impl HardCase {
    /// The command that runs the test; `None` where the file is not in one of the places that Cargo knows.
    pub fn command(&self) -> Option<String> {
        let (file, test) = self.test.split_once("::")?;
        let (package, rest) = file.split_once('/')?;
        let target = match rest.split_once('/')? {
            ("src", _) => "--lib".to_owned(),
            ("tests", file) => {
                let name = file.split_once('/').map_or(file.strip_suffix(".rs")?, |(folder, _)| folder);
                format!("--test {name}")
            }
            _ => return None,
        };
        Some(format!("cargo test -p photonstream-{package} {target} {test} -- --nocapture"))
    }
}

/// The rows of the table, in its order.
///
/// # Panics
/// If the table that was compiled in is broken, which a test excludes.
pub fn cases() -> &'static [HardCase] {
    static CASES: OnceLock<Vec<HardCase>> = OnceLock::new();
    CASES.get_or_init(|| read(TEXT).expect("invariant: a test reads the table"))
}

/// The rows of the one table of `text`; a row that has not six filled cells is an error that holds it.
fn read(text: &str) -> Result<Vec<HardCase>, String> {
    let rows = text.lines().filter(|line| line.starts_with('|'));
    // The names of the columns, and the line below them.
    rows.skip(2).map(|line| row(line).ok_or_else(|| line.to_owned())).collect()
}

fn row(line: &str) -> Option<HardCase> {
    let cells: Vec<&str> = line.strip_prefix("| ")?.strip_suffix(" |")?.split(" | ").map(str::trim).collect();
    let [case, test, figure, tolerance, reason, breaks]: [&str; 6] = cells.try_into().ok()?;
    let test = test.strip_prefix('`')?.strip_suffix('`').filter(|test| test.contains("::"))?;
    let cells = [case, test, figure, tolerance, reason, breaks].map(str::to_owned);
    if cells.iter().any(String::is_empty) {
        return None;
    }
    let [case, test, figure, tolerance, reason, breaks] = cells;
    Some(HardCase { case, test, figure, tolerance, reason, breaks })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every line of the file that begins with a bar is a row, but the head's two: none is dropped in silence.
    #[test]
    fn every_row_is_read() {
        let rows = read(TEXT).unwrap();
        assert_eq!(rows.len(), TEXT.lines().filter(|line| line.starts_with('|')).count() - 2);
        assert!(rows.len() > 60 && rows == cases());
        for row in &rows {
            assert!(row.command().is_some(), "{}", row.test);
        }
    }

    #[test]
    fn a_broken_row_is_an_error() {
        let head = "| case | test | figure | tolerance | reason | breaks |\n|---|---|---|---|---|---|\n";
        let good = "| a | `tests/tests/hard/x.rs::y` | 1 | 2 | b | c |\n";
        assert_eq!(read(&format!("{head}{good}")).unwrap().len(), 1);
        for broken in ["| a | b |", "| a | `x` | 1 | 2 | b | c |", "| a | `x::y` | 1 |  | b | c |"] {
            assert_eq!(read(&format!("{head}{good}{broken}\n")).unwrap_err(), broken);
        }
    }

    #[test]
    fn commands_name_package_and_target() {
        let command = |test: &str| HardCase { test: test.into(), ..cases()[0].clone() }.command();
        let expected = "cargo test -p photonstream-tests --test hard y -- --nocapture";
        assert_eq!(command("tests/tests/hard/x.rs::y").as_deref(), Some(expected));
        let expected = "cargo test -p photonstream-scene --test errors y -- --nocapture";
        assert_eq!(command("scene/tests/errors.rs::y").as_deref(), Some(expected));
        let expected = "cargo test -p photonstream-scene --lib y -- --nocapture";
        assert_eq!(command("scene/src/bvh/tests/watertight.rs::y").as_deref(), Some(expected));
        assert_eq!(command("scene/benches/x.rs::y"), None);
    }
}
