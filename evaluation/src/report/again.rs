//! Turns rows into the commands that repeat their numbers, folded away beside what shows them.

use super::{escape, figure, portrait::settings, series::kind, tables::framed, time};
use crate::results::Row;

/// One command, folded.
pub(super) fn command(command: &str) -> String {
    format!("<details class=\"again\"><summary>command</summary><code>{}</code></details>", escape(command))
}

/// The points of a chart or the numbers of a table, each with its settings and its command; folded. `error` is the error
/// that is shown, called `name`.
pub(super) fn points(what: &str, rows: &[&Row], name: &str, error: fn(&Row) -> f64) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut rows = rows.to_vec();
    rows.sort_by(|a, b| kind(a).cmp(&kind(b)).then(a.total_ms.total_cmp(&b.total_ms)));
    let body: String = rows
        .iter()
        .map(|row| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"words\">{}</td><td>{}</td><td>{}</td><td><code>{}</code></td></tr>",
                escape(&kind(row)),
                escape(&settings(row)),
                time(row.total_ms),
                figure(error(row)),
                escape(&row.command)
            )
        })
        .collect();
    format!(
        "<details><summary>The {} points {what}, each with its settings and the command that repeats it</summary>{}</details>",
        rows.len(),
        framed(&format!("Points {what}"), &["method", "settings", "time", name, "command"], &body)
    )
}
