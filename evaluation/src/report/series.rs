//! Turns rows into the series of a chart: a name, a colour, a shape, and points.

use crate::{pareto, point::Method, results::Row};

/// Points of one kind.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    pub(super) name: String,
    pub(super) look: usize,
    pub(super) points: Vec<(f64, f64)>,
    /// Whether points are joined.
    pub(super) joined: bool,
}

/// Colours that are told apart on white and on near-black, and by most colour-blind people.
pub(super) const COLOURS: [[u8; 3]; 8] = [
    [43, 127, 212],
    [217, 115, 13],
    [31, 157, 107],
    [194, 85, 143],
    [128, 136, 148],
    [176, 138, 12],
    [126, 99, 214],
    [206, 66, 66],
];

/// The colour of a look as CSS has it.
pub(super) fn css(look: usize) -> String {
    let [r, g, b] = COLOURS[look % COLOURS.len()];
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// What a row is called among others: methods, and photon streaming by its shadows.
pub(super) fn kind(row: &Row) -> String {
    let method = row.method.as_str();
    match method {
        _ if method == Method::PhotonStreaming.name() || method == Method::PhotonStreamingGpu.name() => {
            let place = if method == Method::PhotonStreaming.name() { "" } else { " on the GPU" };
            let shadows = match row.visibility.as_deref() {
                Some("none") | None => "no indirect shadows".into(),
                Some("rays") => "shadow rays".into(),
                Some(other) => format!("{other} shadows"),
            };
            format!("Photon streaming{place}, {shadows}")
        }
        _ if method == Method::PathTracing.name() => "Path tracing".into(),
        _ if method == Method::PathTracingDenoised.name() => "Path tracing, denoised".into(),
        _ if method == Method::InstantRadiosity.name() => "Instant radiosity".into(),
        _ if method == Method::InstantRadiosityBounded.name() => "Instant radiosity, bounded".into(),
        _ if method == Method::StaticVpl.name() => "Static VPLs".into(),
        _ if method == Method::PhantomVpl.name() => "Phantom VPLs".into(),
        _ if method == Method::FixedPhotons.name() => "Photons of fixed directions".into(),
        _ if method == Method::PaperA.name() => "Paper A as written".into(),
        other => other.into(),
    }
}

/// The kinds of `rows`, in the order in which they come.
pub(super) fn kinds(rows: &[&Row]) -> Vec<String> {
    let mut kinds: Vec<String> = Vec::new();
    for kind in rows.iter().map(|row| kind(row)) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds.sort_by_key(|kind| !kind.starts_with("Photon"));
    kinds
}

/// Rows of a sweep.
pub(super) fn of_sweep<'a>(rows: &[&'a Row], sweep: &str) -> Vec<&'a Row> {
    rows.iter().copied().filter(|row| row.sweeps.split(' ').any(|s| s == sweep)).collect()
}

/// Time against error: a series for each kind, and the Pareto front of all.
pub(super) fn time_against_error(rows: &[&Row], error: fn(&Row) -> f64) -> Vec<Series> {
    let point = |row: &&Row| (row.total_ms, error(row));
    let mut series: Vec<Series> = kinds(rows)
        .into_iter()
        .enumerate()
        .map(|(look, name)| {
            let mut points: Vec<_> = rows.iter().filter(|row| kind(row) == name).map(point).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Series { name, look, points, joined: false }
        })
        .collect();
    let all: Vec<_> = rows.iter().map(point).collect();
    let front = pareto::front(&all).into_iter().map(|i| all[i]).collect();
    series.push(Series { name: FRONT.into(), look: usize::MAX, points: front, joined: true });
    series
}

/// The name of the Pareto front in legends.
pub(super) const FRONT: &str = "Best of all (Pareto front)";

/// One setting against the error of indirect light: a series for each value of `by`.
pub(super) fn setting_against_error(
    rows: &[&Row],
    setting: fn(&Row) -> Option<f64>,
    by: fn(&Row) -> String,
) -> Vec<Series> {
    let mut series: Vec<Series> = Vec::new();
    for row in rows {
        let Some(x) = setting(row) else { continue };
        let name = by(row);
        let at = series.iter().position(|s| s.name == name).unwrap_or_else(|| {
            series.push(Series { name, look: series.len(), points: vec![], joined: true });
            series.len() - 1
        });
        series[at].points.push((x, row.rel_rmse_indirect));
    }
    series.iter_mut().for_each(|s| s.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::row;

    #[test]
    fn kinds_are_apart_and_the_front_is_that_of_all() {
        let mut rows = [
            row("path-tracing", 1.0, 0.5),
            row("photon-streaming", 2.0, 0.1),
            row("photon-streaming", 3.0, 0.2),
            row("paper-a", 4.0, 0.05),
        ];
        rows[2].visibility = Some("none".into());
        let rows: Vec<&Row> = rows.iter().collect();
        let series = time_against_error(&rows, |row| row.rel_rmse);
        let names: Vec<&str> = series.iter().map(|s| s.name.as_str()).collect();
        let expected = [
            "Photon streaming, shadow rays",
            "Photon streaming, no indirect shadows",
            "Path tracing",
            "Paper A as written",
            FRONT,
        ];
        assert_eq!(names, expected);
        assert_eq!(series[4].points, [(1.0, 0.5), (2.0, 0.1), (4.0, 0.05)]);
    }
}
