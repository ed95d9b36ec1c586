//! Turns results into one page that needs nothing but itself: no network, no script, charts and pictures inside.

mod accumulation;
mod again;
mod bars;
mod charts;
mod choose;
mod few_lights;
mod figures;
mod hard_cases;
mod page;
mod portrait;
mod scene_section;
mod series;
mod tables;

pub use portrait::{Portrait, SceneSheet};

use crate::{EvaluateError, results::Results};
use std::path::Path;

/// Writes `index.html` into `folder`.
///
/// # Errors
/// [`EvaluateError::Write`], [`EvaluateError::Draw`].
pub fn write(results: &Results, sheets: &[SceneSheet], folder: &Path) -> Result<(), EvaluateError> {
    let path = folder.join("index.html");
    let page = page::page(results, sheets)?;
    std::fs::write(&path, page).map_err(|e| EvaluateError::write(&path, e))
}

/// Text as HTML shows it.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// A time for people: `0.42 ms`, `38 ms`, `1.3 s`.
fn time(ms: f64) -> String {
    match ms {
        ms if ms >= 9950.0 => format!("{:.0} s", ms * 1e-3),
        ms if ms >= 995.0 => format!("{:.1} s", ms * 1e-3),
        ms if ms >= 9.95 => format!("{ms:.0} ms"),
        ms if ms >= 0.995 => format!("{ms:.1} ms"),
        ms => format!("{ms:.2} ms"),
    }
}

/// An error or a share for people: three digits that mean something.
fn figure(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if v >= 9.995 => format!("{value:.1}"),
        v if v >= 0.9995 => format!("{value:.2}"),
        v if v >= 0.0995 => format!("{value:.3}"),
        v if v >= 0.000_95 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_readable() {
        let times = [0.123, 4.56, 45.6, 999.0, 1234.0, 12_345.0].map(time);
        assert_eq!(times, ["0.12 ms", "4.6 ms", "46 ms", "1.0 s", "1.2 s", "12 s"]);
        let figures = [0.0, 12.34, 1.234, 0.1234, 0.012_34, 0.000_123_4, -0.5].map(figure);
        assert_eq!(figures, ["0", "12.3", "1.23", "0.123", "0.0123", "1.2e-4", "-0.500"]);
        assert_eq!(escape("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    }
}
