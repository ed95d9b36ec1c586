//! Turns hard cases into a section: those that this evaluation ran itself, and those of the test suite, told apart.

use super::{escape, figure, tables::cards};
use crate::hard_cases::{Checked, Figure, HardCase, cases};

/// Names of the columns; on narrow pages each cell says its own.
const HEAD: [&str; 6] =
    ["Case", "Verdict", "Figure", "Tolerance and its reason", "Without the measure", "Repeat"];

/// The section; `checked` is what was run here.
pub(super) fn section(checked: &[Checked]) -> String {
    let of = |case: &HardCase| checked.iter().find(|c| c.test == case.test);
    let here: String = cases().iter().filter_map(|case| of(case).map(|c| row(case, Some(c)))).collect();
    let others: Vec<String> = cases().iter().filter(|c| of(c).is_none()).map(|c| row(c, None)).collect();
    let failed = checked.iter().filter(|c| !c.holds()).count();
    let verdict = match (checked.len(), failed) {
        (0, _) => "None was run by this evaluation.".to_owned(),
        (all, 0) => format!("All {all} that this evaluation ran are within their tolerance."),
        (all, failed) => {
            format!("<strong>{failed} of {all} that this evaluation ran are out of tolerance.</strong>")
        }
    };
    let class = if failed > 0 { " class=\"warning\"" } else { "" };
    let mut out = format!(
        "<section id=\"hard-cases\"><h2>Hard cases</h2><p>What is known to break renderers, how near its limit it comes, and \
         what would break without the measure taken.</p><p{class}>{verdict}</p>"
    );
    if !checked.is_empty() {
        let samples = checked.iter().map(|c| c.samples).max().unwrap_or_default();
        out.push_str(&format!(
            "<h3>Run by this evaluation</h3><p>Closed forms evaluated in f32 and in f64, {} samples each: the verdict \
             is that of this program on this machine. Every <code>photonstream evaluate</code> runs them again with the same \
             samples; the command beside each takes ten times as many. ulp: 2⁻²³, relative, or of what the figure names.</p>{}",
            grouped(samples),
            cards("Hard cases run by this evaluation", &HEAD, &here)
        ));
    }
    out.push_str(&format!(
        "<h3>Of the test suite</h3><details class=\"suite\"><summary>{} more cases, not run here: figures that the test suite \
         had when they were written down, each with the command that runs it</summary>{}</details></section>",
        others.len(),
        cards("Hard cases of the test suite, not run by this evaluation", &HEAD, &others.concat())
    ));
    out
}

fn row(case: &HardCase, checked: Option<&Checked>) -> String {
    let (class, verdict) = match checked {
        Some(checked) if checked.holds() => ("yes", "pass"),
        Some(_) => ("fail", "FAIL"),
        None => ("no", "not run here"),
    };
    let (found, tolerance) = match checked {
        Some(checked) => {
            let lines: Vec<String> = checked.figures.iter().map(measured).collect();
            (lines.join("<br>"), prose(&case.reason))
        }
        None => (prose(&case.figure), format!("{}: {}", prose(&case.tolerance), prose(&case.reason))),
    };
    let command = case.command().map_or("–".into(), |c| format!("<code>{}</code>", escape(&c)));
    let verdict = format!("<span class=\"verdict {class}\">{verdict}</span>");
    let cells = [verdict, found, tolerance, prose(&case.breaks), command];
    let cells: String = cells
        .iter()
        .zip(&HEAD[1..])
        .map(|(cell, name)| format!("<td data-name=\"{name}\">{cell}</td>"))
        .collect();
    format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", prose(&case.case))
}

fn measured(found: &Figure) -> String {
    format!(
        "{}: <strong>{}</strong> of at most {}",
        escape(&found.what),
        figure(found.found),
        figure(found.limit)
    )
}

/// A count with its thousands apart: `20 000`.
fn grouped(count: u64) -> String {
    match (count / 1000, count % 1000) {
        (0, ones) => ones.to_string(),
        (thousands, ones) => format!("{thousands}\u{a0}{ones:03}"),
    }
}

/// Text of the table as HTML: what stands between backticks is code.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate();
    parts
        .map(|(i, part)| if i % 2 == 1 { format!("<code>{}</code>", escape(part)) } else { escape(part) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(found: f64) -> Checked {
        let figures = vec![Figure { what: "a < b".into(), found, limit: 4.0 }];
        Checked { test: "tests/tests/hard/kernels.rs::ranges_are_within_ulps".into(), samples: 9, figures }
    }

    /// Every row is there once; only what was run has a verdict, and a failure is one.
    #[test]
    fn only_what_was_run_passes() {
        let none = section(&[]);
        assert_eq!(none.matches("not run here</span>").count(), cases().len());
        assert!(!none.contains(">pass<") && none.contains("None was run"));
        let passed = section(&[checked(1.5)]);
        assert_eq!(passed.matches(">pass</span>").count(), 1);
        assert_eq!(passed.matches("not run here</span>").count(), cases().len() - 1);
        assert!(passed.contains("a &lt; b: <strong>1.50</strong> of at most 4.00"), "{passed}");
        let failed = section(&[checked(f64::INFINITY)]);
        assert!(
            failed.contains(">FAIL</span>") && failed.contains("1 of 1 that this evaluation ran are out")
        );
        assert!(!failed.contains(">pass<"));
        assert_eq!(prose("kernel `a<b` & c"), "kernel <code>a&lt;b</code> &amp; c");
    }
}
