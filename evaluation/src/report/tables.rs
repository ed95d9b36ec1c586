//! Turns rows into tables.

use super::{
    again, escape, figure,
    portrait::settings,
    series::{kind, kinds},
    time,
};
use crate::{
    pareto,
    point::Method,
    results::{Row, Split, StepChange},
};

/// A table in a frame that scrolls by itself, by keyboard, too.
pub(super) fn framed(label: &str, head: &[&str], body: &str) -> String {
    let head: String = head.iter().map(|h| format!("<th scope=\"col\">{}</th>", escape(h))).collect();
    format!(
        "<div class=\"scroll\" role=\"region\" aria-label=\"{}\" tabindex=\"0\"><table><thead><tr>{head}</tr></thead>\
         <tbody>{body}</tbody></table></div>",
        escape(label)
    )
}

/// The same, its rows shown as cards on narrow pages, where each cell says its column (`data-name`). Such rows are of words.
pub(super) fn cards(label: &str, head: &[&str], body: &str) -> String {
    // The role, because a table that is not laid out as one is none to some screen readers.
    framed(label, head, body).replacen("<table>", "<table class=\"cards\" role=\"table\">", 1)
}

/// Times a picture may take, ms.
pub(super) const BUDGETS: [f64; 9] = [1.0, 4.0, 16.0, 33.0, 100.0, 333.0, 1000.0, 3000.0, 10_000.0];

/// The least error of each kind within each time, the best of a column marked; and that of photon streaming over that of
/// path tracing.
pub(super) fn budgets(rows: &[&Row]) -> String {
    let kinds = kinds(rows);
    let head: Vec<String> = BUDGETS.iter().map(|&b| time(b)).collect();
    let mut names = vec!["within"];
    names.extend(head.iter().map(String::as_str));
    let best = |is: &dyn Fn(&Row) -> bool, budget: f64| {
        let rows: Vec<&&Row> = rows.iter().filter(|row| is(row)).collect();
        let points: Vec<_> = rows.iter().map(|row| (row.total_ms, row.rel_rmse)).collect();
        pareto::best_within(&points, budget).map(|i| *rows[i])
    };
    let mut body = String::new();
    let mut shown: Vec<&Row> = Vec::new();
    for name in &kinds {
        body.push_str(&format!("<tr><th scope=\"row\">{}</th>", escape(name)));
        for budget in BUDGETS {
            let of_all = best(&|_| true, budget).map(|row| row.rel_rmse);
            body.push_str(&match best(&|row| kind(row) == *name, budget) {
                Some(row) => {
                    let class = if Some(row.rel_rmse) == of_all { " class=\"best\"" } else { "" };
                    if !shown.iter().any(|known: &&Row| std::ptr::eq(*known, row)) {
                        shown.push(row);
                    }
                    let says = format!("{}, {}", settings(row), time(row.total_ms));
                    format!("<td{class} title=\"{}\">{}</td>", escape(&says), figure(row.rel_rmse))
                }
                None => "<td>–</td>".into(),
            });
        }
        body.push_str("</tr>");
    }
    let of =
        |method: Method, budget: f64| best(&|row| row.method == method.name(), budget).map(|r| r.rel_rmse);
    body.push_str("<tr><th scope=\"row\">Photon streaming over path tracing</th>");
    for budget in BUDGETS {
        body.push_str(&match (of(Method::PhotonStreaming, budget), of(Method::PathTracing, budget)) {
            (Some(ours), Some(theirs)) if theirs > 0.0 => format!("<td>{}</td>", figure(ours / theirs)),
            _ => "<td>–</td>".into(),
        });
    }
    body.push_str("</tr>");
    let table = framed("Least error within a time", &names, &body);
    table + &again::points("of this table", &shown, "rel. RMSE", |row| row.rel_rmse)
}

/// Everything that was measured, with the commands that measure it again.
pub(super) fn all(rows: &[&Row]) -> String {
    let head = [
        "method",
        "settings",
        "threads",
        "placing",
        "light",
        "picture",
        "total",
        "rel. RMSE",
        "indirect",
        "relMSE",
        "bias",
        "worst 1 %",
        "FLIP",
        "noise floor",
        "again",
    ];
    let body: String = rows
        .iter()
        .map(|row| {
            let cells = [
                escape(&settings(row)),
                row.threads.to_string(),
                time(row.place_ms),
                time(row.light_ms),
                time(row.picture_ms),
                time(row.total_ms),
                figure(row.rel_rmse),
                figure(row.rel_rmse_indirect),
                figure(row.rel_mse),
                format!("{:+.2} %", 100.0 * row.bias),
                figure(row.worst_1pct),
                figure(row.flip),
                if row.at_noise_floor { "yes" } else { "no" }.into(),
                format!("<code>{}</code>", escape(&row.command)),
            ];
            let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", escape(&row.method))
        })
        .collect();
    framed("All measurements", &head, &body)
}

/// The parts of each split.
pub(super) fn splits(splits: &[&Split]) -> String {
    let head = [
        "kernel, visibility",
        "whole",
        "variance",
        "visibility",
        "discretisation",
        "bias",
        "mixed",
        "staleness",
        "RMSE",
    ];
    let body: String = splits
        .iter()
        .map(|s| {
            let parts = [s.total, s.variance, s.visibility_part, s.discretisation, s.bias, s.mixed];
            let cells: String = parts.iter().map(|&p| format!("<td>{}</td>", figure(p))).collect();
            let stale = s.staleness.map_or("–".into(), figure);
            let root = figure(s.total.max(0.0).sqrt());
            let name = escape(&format!("{}, {}", s.kernel, s.visibility));
            format!("<tr><th scope=\"row\">{name}</th>{cells}<td>{stale}</td><td>{root}</td></tr>")
        })
        .collect();
    framed("Error by cause", &head, &body)
}

/// Step changes.
pub(super) fn changes(changes: &[&StepChange]) -> String {
    let head = ["change", "first frame", "t95", "nothing old left", "rays / whole pool", "whole pool"];
    let body: String = changes
        .iter()
        .map(|c| {
            let f = &c.figures;
            let cells = [
                time(f.first_frame_ms),
                time(f.t95_ms),
                time(f.whole_ms),
                figure(f.rays_share),
                time(c.full_trace_ms),
            ];
            let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", escape(&f.event))
        })
        .collect();
    framed("Step changes", &head, &body)
}

/// One setting with nothing else changed: threads, sampling.
pub(super) fn sweep(label: &str, rows: &[&Row], setting: fn(&Row) -> String) -> String {
    let head = [label, "light", "picture", "total", "rel. RMSE", "indirect", "bias", "repeat"];
    let body: String = rows
        .iter()
        .map(|row| {
            let cells = [
                time(row.light_ms),
                time(row.picture_ms),
                time(row.total_ms),
                figure(row.rel_rmse),
                figure(row.rel_rmse_indirect),
                format!("{:+.2} %", 100.0 * row.bias),
                again::command(&row.command),
            ];
            let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", escape(&setting(row)))
        })
        .collect();
    framed(label, &head, &body)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::row;

    #[test]
    fn budgets_show_the_best_that_fits() {
        let rows = [
            row("photon-streaming", 3.0, 0.1),
            row("photon-streaming", 50.0, 0.05),
            row("path-tracing", 3.5, 0.4),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let table = budgets(&rows);
        // Nothing within 1 ms; 4 ms: 0.1 is best, 0.4 is not; a quarter of path tracing; 100 ms: 0.05.
        assert!(table.contains("<td>–</td><td class=\"best\""), "{table}");
        for part in [">0.100</td>", ">0.400</td>", "<td>0.250</td>", ">0.0500</td>", "<td>0.125</td>"] {
            assert!(table.contains(part), "{part}: {table}");
        }
        assert!(
            !table.contains(
                "class=\"best\" title=\"100 lights, 4096 paths, kernel disc, visibility rays, 3.5 ms"
            )
        );
    }

    #[test]
    fn names_are_escaped() {
        let table = all(&[&row("x<y", 1.0, 0.1)]);
        assert!(table.contains("x&lt;y") && !table.contains("x<y"));
    }
}
