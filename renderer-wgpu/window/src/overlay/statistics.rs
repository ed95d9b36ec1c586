//! Turns a frame's counters and what its picture took into lines of text.

use super::{Machine, alarm, right, window};
use crate::{
    flaws::approximation,
    session::{Effort, Session},
};
use egui::{Context, Grid, RichText, Ui, pos2};
use photonstream_protocol::StatisticsRecord;
use photonstream_renderer::telemetry::ChangeTimes;

pub(super) fn show(ctx: &Context, session: &Session, machine: &Machine) {
    window(ctx, "Figures", pos2(right(ctx) - 250.0, 8.0)).default_width(234.0).show(ctx, |ui| {
        ui.label(RichText::new(&machine.adapter).small());
        if machine.is_software {
            alarm(ui, "software rendering: slow");
        }
        Grid::new("figures").num_columns(2).show(ui, |ui| {
            for (label, value) in lines(session) {
                ui.label(label);
                ui.monospace(value);
                ui.end_row();
            }
        });
        if let Some(words) = session.view().as_ref().and_then(approximation) {
            ui.label(RichText::new(words).small());
        }
        for warning in session.flaws.warnings() {
            alarm(ui, warning);
        }
        passes(ui, &session.effort);
    });
}

fn lines(session: &Session) -> Vec<(&'static str, String)> {
    let (width, height) = session.size;
    let mut lines = vec![
        ("picture", format!("{width}×{height}")),
        ("frame time", format!("{:.1} ms", session.effort.frame_ms)),
    ];
    if let Some(published) = &session.published {
        let frame = &published.frame;
        let statistics = &frame.statistics;
        let state = if statistics.converged != 0 { "converged" } else { "settling" };
        let percent = |share: f64| format!("{:.*} %", if share < 0.1 { 2 } else { 0 }, 100.0 * share);
        let error = match statistics.target_error {
            target if target > 0.0 => {
                format!("{} of {}", percent(session.light.relative_error), percent(target))
            }
            _ => percent(session.light.relative_error),
        };
        lines.extend([
            ("VSLs", frame.vsls.len().to_string()),
            ("photons/s", short(statistics.paths_per_s)),
            ("rays/s", short(statistics.rays_per_s)),
            ("light", state.to_owned()),
            ("stale paths", percent(statistics.stale_share)),
            ("error of light", error),
            ("age of light", format!("{:.1} s, most {:.1}", session.light.mean_s, session.light.greatest_s)),
            ("published frame", frame.frame.to_string()),
        ]);
        lines.extend(changes(&session.changes, statistics));
    }
    if let Some(noise) = session.flaws.noise() {
        lines.push(("noise of rays", format!("{:.2} %", 100.0 * noise)));
    }
    if session.latency.is_known() {
        lines.push(("change to published", format!("{:.1} ms", session.latency.published_ms)));
        lines.push(("published to shown", format!("{:.1} ms", session.latency.shown_ms)));
    }
    lines
}

/// What the last change took, and what changes have cost so far.
fn changes(changes: &ChangeTimes, statistics: &StatisticsRecord) -> Vec<(&'static str, String)> {
    if !changes.is_known() {
        return Vec::new();
    }
    let target = match statistics.latency_target_ms {
        target if target > 0.0 => format!(" of {target:.0}"),
        _ => String::new(),
    };
    let traced = changes.traced_ms().map_or_else(|| "not yet".to_owned(), |ms| format!("{ms:.1}{target} ms"));
    let mut lines = vec![("change to traced", traced)];
    lines.extend(changes.settled_ms().map(|ms| ("… and published", format!("{ms:.1} ms"))));
    lines.extend([
        ("paths traced again", short(statistics.retraced_paths as f64)),
        ("rays saved", short(statistics.rays_saved as f64)),
    ]);
    lines
}

fn passes(ui: &mut Ui, effort: &Effort) {
    if effort.passes.is_empty() {
        return;
    }
    ui.separator();
    Grid::new("passes").num_columns(2).show(ui, |ui| {
        for pass in &effort.passes {
            ui.label(pass.name);
            ui.monospace(format!("{:.2} ms", pass.ms));
            ui.end_row();
        }
    });
}

/// Three digits and a unit: 1.23 M.
fn short(x: f64) -> String {
    for (unit, size) in [(" G", 1e9), (" M", 1e6), (" k", 1e3)] {
        if x >= size {
            return format!("{:.*}{unit}", if x / size < 10.0 { 2 } else { 1 }, x / size);
        }
    }
    format!("{x:.0}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_protocol::VslFrame;

    #[test]
    fn rates_are_short() {
        assert_eq!(
            [0.0, 999.0, 1234.0, 56_789.0, 1.5e6, 3e9].map(short),
            ["0", "999", "1.23 k", "56.8 k", "1.50 M", "3.00 G"]
        );
    }

    #[test]
    fn a_change_is_told_once_it_is_known() {
        let mut frame = VslFrame::default();
        let mut times = ChangeTimes::default();
        times.see(&frame);
        assert!(changes(&times, &frame.statistics).is_empty());
        let statistics = &mut frame.statistics;
        (statistics.edit_received_ns, statistics.published_ns) = (1_000_000, 4_000_000);
        (statistics.stale_share, statistics.latency_target_ms) = (0.5, 20.0);
        statistics.rays_saved = 12_345;
        times.see(&frame);
        let told = changes(&times, &frame.statistics);
        assert_eq!(told[0], ("change to traced", "not yet".to_owned()));
        (frame.statistics.traced_ns, frame.statistics.published_ns) = (7_500_000, 9_000_000);
        frame.statistics.stale_share = 0.0;
        times.see(&frame);
        let told = changes(&times, &frame.statistics);
        let expected = ["6.5 of 20 ms", "8.0 ms", "0", "12.3 k"];
        assert_eq!(told.iter().map(|(_, value)| value.as_str()).collect::<Vec<_>>(), expected);
    }
}
