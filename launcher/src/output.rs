//! Turns results into lines on standard output; a reader that has gone (`| head`) is no error.

use crate::error::LauncherError;
use serde::Serialize;
use std::io::{ErrorKind, Write};

/// Writes one line.
pub(crate) fn line(text: impl std::fmt::Display) -> Result<(), LauncherError> {
    written(writeln!(std::io::stdout().lock(), "{text}"))
}

/// Writes a report: as one JSON object, or as the text that `text` makes of it.
pub(crate) fn report<T: Serialize>(
    json: bool,
    report: &T,
    text: impl FnOnce(&T) -> String,
) -> Result<(), LauncherError> {
    if !json {
        return line(text(report).trim_end_matches('\n'));
    }
    let text = serde_json::to_string_pretty(report).map_err(|e| LauncherError::Output(e.into()))?;
    line(text)
}

fn written(result: std::io::Result<()>) -> Result<(), LauncherError> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.map_err(LauncherError::Output),
    }
}

/// `1234567` as `1 234 567`: thin figures are hard to read.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// `1234567.0` as `1.23 M`, to be followed by the unit: `0.50 ` has its space already.
pub(crate) fn si(value: f64) -> String {
    let (factor, prefix) = match value.abs() {
        v if v >= 1e9 => (1e-9, " G"),
        v if v >= 1e6 => (1e-6, " M"),
        v if v >= 1e3 => (1e-3, " k"),
        _ => (1.0, " "),
    };
    let scaled = value * factor;
    let decimals = if scaled.abs() >= 100.0 { 0 } else { 2 };
    format!("{scaled:.decimals$}{prefix}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_readable() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_000), "1 000");
        assert_eq!(grouped(131_072), "131 072");
        assert_eq!(grouped(12_345_678), "12 345 678");
        assert_eq!(si(0.5), "0.50 ");
        assert_eq!(si(1_234_567.0), "1.23 M");
        assert_eq!(si(250_000.0), "250 k");
    }
}
