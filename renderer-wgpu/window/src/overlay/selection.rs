//! Turns the selected light or object into sliders, and their motion into requests.

use super::{gizmo_values, window};
use crate::{
    commands::{place_light, place_object, power_light, switch_light},
    following::Published,
    session::{Selected, Session},
    standing::Standing,
};
use egui::{Align2, Context, DragValue, Slider, SliderClamping, Ui, pos2};
use glam::{DVec3, Vec3};
use photonstream_protocol::Request;
use photonstream_scene::{LightId, ObjectId};
use photonstream_shading::LightShape;
use std::time::{Duration, Instant};

/// How long the user's values are kept after the last change, before those of the simulator are shown again.
const KEPT: Duration = Duration::from_millis(1500);

/// The values in the interface, which run ahead of the simulator's while the user changes them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draft {
    of: Option<Selected>,
    touched: Option<Instant>,
    power: f32,
    colour: [f32; 3],
    enabled: bool,
    position_m: Option<DVec3>,
}

pub(super) fn show(ctx: &Context, session: &mut Session, now: Instant) {
    let (Some(selected), Some(published)) = (session.selected.clone(), session.published.clone()) else {
        return;
    };
    let is_moved = session.pointer.is_holding();
    let draft = &mut session.draft;
    let is_fresh = draft.touched.is_some_and(|touched| now - touched < KEPT) && !is_moved;
    if draft.of.as_ref() != Some(&selected) || !is_fresh {
        draft.load(&selected, &published);
    }
    let title = match &selected {
        Selected::Light(name) => format!("Light {name}"),
        Selected::Object(name) => format!("Object {name}"),
        Selected::Gizmo(gizmo) => gizmo.to_string(),
    };
    let place = pos2(8.0, ctx.content_rect().bottom() - 8.0);
    let mut requests = Vec::new();
    let frame = window(ctx, "selection", place)
        .pivot(Align2::LEFT_BOTTOM)
        .title_bar(false)
        .default_open(true)
        .default_width(234.0);
    frame.show(ctx, |ui| {
        ui.strong(title);
        match &selected {
            Selected::Light(name) => light(ui, name, &published, &mut session.draft, &mut requests),
            Selected::Object(name) => object(ui, name, &published, &mut session.draft, &mut requests),
            Selected::Gizmo(gizmo) => gizmo_values::show(ui, session, *gizmo, &published, now),
        }
    });
    if !requests.is_empty() {
        session.draft.touched = Some(now);
        ctx.request_repaint_after(KEPT);
    }
    session.outbox.extend(requests);
}

impl Draft {
    fn load(&mut self, selected: &Selected, published: &Published) {
        *self = Self { of: Some(selected.clone()), ..Self::default() };
        let Published { frame, scene, standing } = published;
        match selected {
            Selected::Light(name) => {
                let Some(id) = scene.light(name) else { return };
                let Some(record) = frame.lights.get(id.0 as usize) else { return };
                let power = Vec3::from(record.power);
                self.power = power.max_element();
                let colour = if self.power > 0.0 { power / self.power } else { Vec3::ONE };
                self.colour = colour.to_array();
                self.enabled = record.enabled != 0;
                self.position_m = Standing::light(scene, id).or_else(|| {
                    scene.lights[id.0 as usize].object.and_then(|o| Some(standing.object(scene, o)?.1))
                });
            }
            Selected::Object(name) => {
                let id = scene.object(name);
                self.position_m = id.and_then(|id| Some(standing.object(scene, id)?.1));
            }
            // Its values are those of the tables.
            Selected::Gizmo(_) => {}
        }
    }
}

fn light(ui: &mut Ui, name: &str, published: &Published, draft: &mut Draft, requests: &mut Vec<Request>) {
    let scene = &published.scene;
    let Some(LightId(id)) = scene.light(name) else { return };
    let light = &scene.lights[id as usize];
    ui.label(match light.light.shape {
        LightShape::Point { .. } => "point",
        LightShape::Spot { .. } => "spot",
        LightShape::Directional { .. } => "directional",
        LightShape::Parallelogram { .. } => "rectangle",
        LightShape::Triangle { .. } => "triangle",
        LightShape::Mesh { .. } => "emitting mesh",
        LightShape::Sky { .. } => "sky",
    });
    if ui.checkbox(&mut draft.enabled, "on").changed() {
        requests.push(switch_light(name, draft.enabled));
    }
    let unit = match light.light.shape {
        LightShape::Directional { .. } => " W/m²",
        LightShape::Sky { .. } => " W/(m² sr)",
        _ => " W",
    };
    let power = power(ui, &mut draft.power, unit);
    let colour = ui.horizontal(|ui| {
        ui.label("colour");
        ui.color_edit_button_rgb(&mut draft.colour).changed()
    });
    if power || colour.inner {
        requests.push(power_light(name, Vec3::from(draft.colour) * draft.power, &light.light.shape));
    }
    match light.object {
        Some(object) => place(ui, published, object, draft, requests),
        None => {
            if let Some(position_m) = &mut draft.position_m
                && position(ui, position_m)
            {
                requests.push(place_light(name, *position_m));
            }
        }
    }
}

/// A slider for what lamps have; what is beyond it stays, and can be typed. Whether it was changed.
fn power(ui: &mut Ui, power: &mut f32, unit: &str) -> bool {
    let slider = Slider::new(power, 0.0..=1000.0).logarithmic(true).smallest_positive(0.01);
    let changed = ui.add(slider.clamping(SliderClamping::Never).suffix(unit)).changed();
    if changed {
        // A number that was typed.
        *power = if power.is_finite() { power.max(0.0) } else { 0.0 };
    }
    changed
}

fn object(ui: &mut Ui, name: &str, published: &Published, draft: &mut Draft, requests: &mut Vec<Request>) {
    let scene = &published.scene;
    let Some(id) = scene.object(name) else { return };
    let object = &scene.objects[id.0 as usize];
    ui.label(format!("{} triangles", object.triangles.len()));
    let owned = published.frame.vsls.iter().filter(|vsl| vsl.object == id.0).count();
    ui.label(format!("{owned} virtual surface lights"));
    place(ui, published, id, draft, requests);
}

fn place(ui: &mut Ui, published: &Published, id: ObjectId, draft: &mut Draft, requests: &mut Vec<Request>) {
    if let Some(position_m) = &mut draft.position_m
        && position(ui, position_m)
        && let Some((name, _)) = published.standing.object(&published.scene, id)
    {
        requests.push(place_object(&name, *position_m));
    }
}

/// Three numbers that can be dragged; whether one has changed.
pub(super) fn position(ui: &mut Ui, position_m: &mut DVec3) -> bool {
    let changed = ui.horizontal(|ui| {
        let mut changed = false;
        for value in [&mut position_m.x, &mut position_m.y, &mut position_m.z] {
            changed |= ui.add(DragValue::new(value).speed(0.01).max_decimals(3).suffix(" m")).changed();
        }
        changed
    });
    changed.inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strong_lamps_are_left_as_they_are() {
        egui::__run_test_ui(|ui| {
            let mut value = 5000.0;
            assert!(!power(ui, &mut value, " W"), "nobody touched it");
            assert_eq!(value, 5000.0);
        });
    }
}
