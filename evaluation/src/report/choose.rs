//! Turns rows into two tables to choose settings from: by an error that may be, and by a time that may be taken.

use super::{again, escape, portrait::settings, series::kind, tables::cards, time};
use crate::{pareto, point::Method, results::Row};

/// Relative RMSE of the full picture that somebody may accept.
const ERRORS: [f64; 3] = [0.02, 0.05, 0.1];
/// Times that a picture may take, ms.
const TIMES_MS: [f64; 4] = [16.0, 33.0, 100.0, 1000.0];

/// What is chosen among; a row belongs to the first group that takes it.
struct Group {
    name: &'static str,
    takes: fn(&str) -> bool,
}

const GROUPS: [Group; 5] = [
    Group { name: "Photon streaming", takes: |method| method == Method::PhotonStreaming.name() },
    Group {
        name: "Photon streaming on the GPU",
        takes: |method| method == Method::PhotonStreamingGpu.name(),
    },
    Group { name: "Path tracing", takes: |method| method == Method::PathTracing.name() },
    Group { name: "Path tracing, denoised", takes: |method| method == Method::PathTracingDenoised.name() },
    Group { name: "Best of the others", takes: |_| true },
];

/// Both tables; `noise` is the relative RMSE of the reference.
pub(super) fn tables(rows: &[&Row], noise: f64) -> String {
    let mut groups: Vec<(&str, Vec<&Row>)> = Vec::new();
    for (index, group) in GROUPS.iter().enumerate() {
        let is_first = |row: &&Row| GROUPS.iter().position(|g| (g.takes)(&row.method)) == Some(index);
        let members: Vec<&Row> = rows.iter().copied().filter(is_first).collect();
        if !members.is_empty() {
            groups.push((group.name, members));
        }
    }
    let mut head = vec![""];
    head.extend(groups.iter().map(|g| g.0));
    let table = |label: &str, corner: &'static str, lines: Vec<(String, Vec<String>)>| {
        let mut head = head.clone();
        head[0] = "At most";
        let line = |(name, cells): &(String, Vec<String>)| {
            let cell = |(cell, name): (&String, &&str)| format!("<td data-name=\"{name}\">{cell}</td>");
            let cells: String = cells.iter().zip(&head[1..]).map(cell).collect();
            format!("<tr><th scope=\"row\">{corner} {name}</th>{cells}</tr>")
        };
        cards(label, &head, &lines.iter().map(line).collect::<String>())
    };
    let by_error =
        ERRORS.map(|error| (percent(error), groups.iter().map(|(_, rows)| fastest(rows, error)).collect()));
    let by_time =
        TIMES_MS.map(|budget| (time(budget), groups.iter().map(|(_, rows)| best(rows, budget)).collect()));
    let device = rows.iter().find_map(|row| row.adapter.as_ref()).map_or(String::new(), |adapter| {
        format!(" The GPU is {}; the others have the processor's cores alone.", escape(adapter))
    });
    format!(
        "<h3>Settings for an error and a time</h3><p>Relative RMSE of the full picture; time is light and picture.{device} The \
         reference's own noise is {}: an error near or below that is not told apart from it, more <code>--spp</code> \
         would be.</p><h4>Fastest settings for an error</h4>{}<h4>Smallest error within a time</h4>{}",
        percent(noise),
        table("Fastest settings for an error", "Error ≤", by_error.into()),
        table("Smallest error within a time", "Time ≤", by_time.into()),
    )
}

fn fastest(rows: &[&Row], error: f64) -> String {
    let fitting = rows.iter().filter(|row| row.rel_rmse <= error);
    match fitting.min_by(|a, b| a.total_ms.total_cmp(&b.total_ms)) {
        Some(row) => found(row, &time(row.total_ms), &percent(row.rel_rmse)),
        None => {
            let least = rows.iter().min_by(|a, b| a.rel_rmse.total_cmp(&b.rel_rmse));
            let least = least.map(|row| format!("{} in {}", percent(row.rel_rmse), time(row.total_ms)));
            format!("not reached; least: {}", least.unwrap_or_default())
        }
    }
}

fn best(rows: &[&Row], budget: f64) -> String {
    let points: Vec<(f64, f64)> = rows.iter().map(|row| (row.total_ms, row.rel_rmse)).collect();
    match pareto::best_within(&points, budget).map(|i| rows[i]) {
        Some(row) => found(row, &percent(row.rel_rmse), &time(row.total_ms)),
        None => {
            let fastest = rows.iter().min_by(|a, b| a.total_ms.total_cmp(&b.total_ms));
            let fastest = fastest.map(|row| format!("{}, {}", time(row.total_ms), percent(row.rel_rmse)));
            format!("none; fastest: {}", fastest.unwrap_or_default())
        }
    }
}

/// A cell: what was asked for, what it costs, with which settings and by which command.
fn found(row: &Row, answer: &str, cost: &str) -> String {
    let name = if GROUPS[..3].iter().any(|group| (group.takes)(&row.method)) {
        String::new()
    } else {
        format!("{}: ", escape(&kind(row)))
    };
    format!(
        "<strong>{answer}</strong> ({cost})<br>{name}{}{}",
        escape(&settings(row)),
        again::command(&row.command)
    )
}

/// A share for people: `2 %`, `11.8 %`.
fn percent(share: f64) -> String {
    let text = format!("{:.1}", 100.0 * share);
    format!("{} %", text.strip_suffix(".0").unwrap_or(&text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::row;

    #[test]
    fn the_fastest_for_an_error_and_the_best_for_a_time() {
        let rows = [
            row("photon-streaming", 10.0, 0.09),
            row("photon-streaming", 30.0, 0.04),
            row("photon-streaming", 90.0, 0.045),
            row("path-tracing", 500.0, 0.08),
            row("paper-a", 20.0, 0.3),
            row("instant-radiosity", 25.0, 0.2),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let is = |cell: &str, text: &str| assert!(cell.starts_with(text), "{cell}: {text}");
        is(&fastest(&rows[..3], 0.1), "<strong>10 ms</strong> (9 %)");
        is(&fastest(&rows[..3], 0.05), "<strong>30 ms</strong> (4 %)");
        is(&fastest(&rows[..3], 0.02), "not reached; least: 4 % in 30 ms");
        is(&best(&rows[..3], 16.0), "<strong>9 %</strong> (10 ms)");
        is(&best(&rows[..3], 1000.0), "<strong>4 %</strong> (30 ms)");
        is(&best(&rows[3..4], 100.0), "none; fastest: 500 ms, 8 %");
        let page = tables(&rows, 0.016);
        assert!(page.contains("noise is 1.6 %") && page.contains(">Path tracing</th>"));
        assert!(!page.contains("on the GPU"), "a group without rows has no column");
        assert!(page.contains("Instant radiosity: ") && page.matches("class=\"again\"").count() >= 8);
    }
}
