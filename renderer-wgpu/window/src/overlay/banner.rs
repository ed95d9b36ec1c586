//! Turns what is wrong with the simulation, and messages of the last seconds, into a line over the picture.

use super::alarm;
use crate::{following::Connection, session::Session};
use egui::{Align2, Context, Frame};
use photonstream_protocol::Liveness;
use std::time::Instant;

pub(super) fn show(ctx: &Context, session: &mut Session, now: Instant) {
    let mut lines: Vec<(String, bool)> =
        banner(&session.connection, session.args.channel.as_str(), session.published.is_some())
            .into_iter()
            .collect();
    let published = session.published.as_ref().map(|published| &*published.frame.notice);
    lines.extend(published.filter(|notice| !notice.is_empty()).map(|notice| (notice.to_owned(), true)));
    lines.extend(session.problem.iter().map(|problem| (problem.clone(), true)));
    let (notices, next) = session.notices.now(now);
    lines.extend(notices.iter().map(|notice| (notice.text.clone(), notice.is_error)));
    if let Some(next) = next {
        ctx.request_repaint_after(next);
    }
    if lines.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("banner"))
        .anchor(Align2::CENTER_BOTTOM, [0.0, -12.0])
        .interactable(false);
    area.show(ctx, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(ctx.content_rect().width() * 0.8);
            for (text, is_alarm) in lines {
                if is_alarm {
                    alarm(ui, text);
                } else {
                    ui.label(text);
                }
            }
        });
    });
}

/// What has to be said of the simulator, and whether it is an alarm.
fn banner(connection: &Connection, channel: &str, has_picture: bool) -> Option<(String, bool)> {
    Some(match connection {
        Connection::Waiting => (format!("waiting for a simulation on channel \"{channel}\""), false),
        Connection::Attached(Liveness::Live) if has_picture => return None,
        Connection::Attached(Liveness::Live) => ("waiting for the first light".into(), false),
        Connection::Attached(Liveness::Paused) => {
            ("the simulation is paused; Space resumes, N makes one step".into(), false)
        }
        Connection::Attached(Liveness::Stalled { age }) => (
            format!("the simulator has not responded for {} s; this is its last light", age.as_secs().max(1)),
            true,
        ),
        Connection::Attached(Liveness::Gone { .. }) => {
            ("the simulator is gone; this is its last light, waiting for the next run".into(), true)
        }
        Connection::Attached(Liveness::Retired) => {
            ("the simulation has ended; this is its last light".into(), false)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn only_a_running_simulation_needs_no_words() {
        let say = |connection| banner(&connection, "demo", true);
        assert_eq!(say(Connection::Attached(Liveness::Live)), None);
        let stalled = say(Connection::Attached(Liveness::Stalled { age: Duration::from_secs(7) })).unwrap();
        assert!(stalled.0.contains("7 s") && stalled.1);
        assert!(say(Connection::Attached(Liveness::Gone { reason: String::new() })).unwrap().1);
        assert!(say(Connection::Waiting).unwrap().0.contains("\"demo\""));
        assert!(banner(&Connection::Attached(Liveness::Live), "demo", false).is_some());
    }
}
