//! Turns the window's state into an interface over the picture, and the user's hands on it into changes.

mod banner;
mod gizmo_values;
mod gizmos;
mod help;
mod icons;
mod panel;
mod selection;
mod statistics;

pub(crate) use selection::Draft;

use crate::session::Session;
use egui::{Context, Ui};
use std::time::Instant;

/// What the interface tells of the machine.
#[derive(Clone, Debug, Default)]
pub(crate) struct Machine {
    /// Name of the adapter with its driver.
    pub(crate) adapter: String,
    /// Whether it draws in software.
    pub(crate) is_software: bool,
}

/// Shows everything; what was asked for is in the session afterwards.
pub(crate) fn show(ui: &mut Ui, session: &mut Session, machine: &Machine, now: Instant) {
    let ctx = ui.ctx().clone();
    gizmos::show(&ctx, session);
    if session.shows_overlay {
        icons::show(&ctx, session);
        panel::show(&ctx, session);
        statistics::show(&ctx, session, machine);
        selection::show(&ctx, session, now);
    }
    if session.shows_help {
        help::show(&ctx, session);
    }
    banner::show(&ctx, session, now);
}

/// A text that stands out.
fn alarm(ui: &mut Ui, text: impl Into<String>) {
    ui.colored_label(egui::Color32::from_rgb(255, 150, 90), text.into());
}

/// A window of the overlay that stays where the user puts it.
fn window<'a>(ctx: &Context, title: &'a str, place: egui::Pos2) -> egui::Window<'a> {
    // On small pictures folded at first: they would hide what there is to see.
    let has_room = ctx.content_rect().width() > 900.0;
    egui::Window::new(title).default_pos(place).default_open(has_room).resizable(false)
}

/// The right edge of the picture, in points.
fn right(ctx: &Context) -> f32 {
    ctx.content_rect().right()
}
