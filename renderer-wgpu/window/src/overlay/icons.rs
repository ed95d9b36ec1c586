//! Turns the places of lights into icons over the picture, which can be taken hold of.

use crate::{
    navigation::project,
    picking::{ICON_POINTS, anchor},
    session::{Selected, Session},
};
use egui::{Align2, Color32, Context, FontId, Id, LayerId, Pos2, Stroke};
use photonstream_scene::bvh::Ray;

pub(super) fn show(ctx: &Context, session: &Session) {
    let (Some(scene), Some(navigation)) = (session.scene(), &session.navigation) else { return };
    let camera = navigation.camera();
    let (width, height) = session.size;
    let painter = ctx.layer_painter(LayerId::new(egui::Order::Background, Id::unique("icons")));
    for light in &scene.lights {
        let Some(point) = anchor(&light.light) else { continue };
        let Some([x, y]) = project(camera, point, width, height) else { continue };
        let at = Pos2::new(x, y) / session.scale;
        let way = point - camera.position;
        // Just short of the light, whose own surface does not hide it.
        let hidden = scene.bvh.occluded(&Ray { origin: camera.position, direction: way, t_max: 0.99 });
        let is_on = light.light.power.max_element() > 0.0;
        let is_selected = session.selected.as_ref() == Some(&Selected::Light(light.name.clone()));
        let alpha = if hidden { 0.35 } else { 0.9 };
        let core = if is_on { Color32::from_rgb(255, 220, 120) } else { Color32::from_gray(90) };
        let rim = if is_selected { Color32::WHITE } else { Color32::from_gray(20) };
        painter.circle(
            at,
            ICON_POINTS * 0.55,
            core.gamma_multiply(alpha),
            Stroke::new(if is_selected { 2.5 } else { 1.5 }, rim.gamma_multiply(alpha)),
        );
        if is_selected {
            let place = at + egui::vec2(0.0, -ICON_POINTS);
            painter.text(
                place,
                Align2::CENTER_BOTTOM,
                &light.name,
                FontId::proportional(13.0),
                Color32::WHITE,
            );
        }
    }
}
