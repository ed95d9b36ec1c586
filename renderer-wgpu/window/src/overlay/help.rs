//! Turns the list of keys into a window that tells them.

use crate::{keys::HELP, session::Session};
use egui::{Align2, Context, Grid};

pub(super) fn show(ctx: &Context, session: &mut Session) {
    let window = egui::Window::new("Keys").anchor(Align2::CENTER_CENTER, [0.0, 0.0]).resizable(false);
    window.collapsible(false).open(&mut session.shows_help).show(ctx, |ui| {
        Grid::new("keys").num_columns(2).show(ui, |ui| {
            for (key, effect) in HELP {
                ui.strong(key);
                ui.label(effect);
                ui.end_row();
            }
        });
    });
}
