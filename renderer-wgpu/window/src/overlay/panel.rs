//! Turns the switches of the view into an interface.

use super::window;
use crate::{
    choices::{Choices, EXPOSURE_MOST, SHOWS, show_name},
    gizmos::Kind,
    session::Session,
};
use egui::{ComboBox, Context, Grid, Slider, SliderClamping, Ui, pos2};
use photonstream_protocol::Request;
use photonstream_renderer_wgpu::{Accumulation, Shadows};
use photonstream_scene::{SHADOW_MAP_EDGES, Scene, Visibility};
use photonstream_shading::{Kernel, tone::ToneMap};

pub(super) fn show(ctx: &Context, session: &mut Session) {
    window(ctx, "View", pos2(8.0, 8.0)).show(ctx, |ui| {
        ui.horizontal(|ui| {
            let is_paused = session.is_paused();
            if ui.button(if is_paused { "Resume" } else { "Pause" }).clicked() {
                session.toggle_pause();
            }
            if ui.add_enabled(is_paused, egui::Button::new("Step")).clicked() {
                session.outbox.push(Request::Step);
            }
            if ui.button("Screenshot").clicked() {
                session.wants_screenshot = true;
            }
            if ui.button("Keys").clicked() {
                session.shows_help = !session.shows_help;
            }
        });
        let published = session.published.clone();
        if let (Some(choices), Some(published)) = (&mut session.choices, published) {
            Grid::new("view").num_columns(2).show(ui, |ui| switches(ui, choices, &published.scene));
            if ui.button("Camera home").clicked()
                && let Some(navigation) = &mut session.navigation
            {
                navigation.reset();
            }
            gizmos(ui, session);
        }
    });
}

/// The switch of the gizmos, and what can be done with all of them.
fn gizmos(ui: &mut Ui, session: &mut Session) {
    let set = session.gizmos.set();
    let counts = [set.vpls.len(), set.blockers.len(), set.proxies.len()];
    if ui.checkbox(&mut session.shows_gizmos, "gizmos of VPLs").changed() {
        session.placing = None;
    }
    if !session.shows_gizmos {
        return;
    }
    for (kind, count) in Kind::ALL.into_iter().zip(counts) {
        ui.horizontal(|ui| {
            let is_next = session.placing == Some(kind);
            if ui.add(egui::Button::new("Add").selected(is_next)).clicked() {
                session.placing = (!is_next).then_some(kind);
            }
            let name = match kind {
                Kind::Vpl => "VPLs",
                Kind::Blocker => "blockers",
                Kind::Proxy => "proxies",
            };
            ui.label(if is_next { "click on a surface".into() } else { format!("{count} {name}") });
        });
    }
    if ui.button("Save in the scene's file").clicked() {
        session.save_gizmos();
    }
}

fn switches(ui: &mut Ui, choices: &mut Choices, scene: &Scene) {
    let view = &mut choices.view;
    row(ui, "show", |ui| {
        let names = SHOWS.iter().map(|&(show, name)| (show, name.to_owned())).collect();
        let now = show_name(view.show).to_owned();
        combo(ui, "show", &mut view.show, names, now);
    });
    row(ui, "exposure", |ui| {
        let slider = slider(&mut choices.exposure_ev, -8.0..=8.0).max_decimals(2).suffix(" EV");
        if ui.add(slider).changed() {
            let typed = Some(choices.exposure_ev).filter(|ev| ev.is_finite()).unwrap_or_default();
            choices.exposure_ev = typed.clamp(-EXPOSURE_MOST, EXPOSURE_MOST);
        }
    });
    row(ui, "tone map", |ui| named(ui, "tone map", &mut choices.tone_map, &ToneMap::ALL, ToneMap::name));
    row(ui, "kernel", |ui| named(ui, "kernel", &mut view.kernel, &Kernel::ALL, Kernel::name));
    row(ui, "visibility", |ui| {
        named(ui, "visibility", &mut view.visibility, Visibility::ALL, Visibility::name);
    });
    if view.visibility == Visibility::ShadowMaps {
        row(ui, "map texels", |ui| {
            ui.horizontal(|ui| {
                for n in SHADOW_MAP_EDGES {
                    ui.selectable_value(&mut view.shadow_map_px, n, n.to_string());
                }
            });
        });
    }
    if view.visibility == Visibility::Rays {
        row(ui, "rays per pixel", |ui| {
            let text = |n: f64, _: std::ops::RangeInclusive<usize>| match n {
                n if n < 1.0 => "one to each".to_owned(),
                n => format!("{n}"),
            };
            ui.add(slider(&mut view.rays_per_pixel, 0..=256).custom_formatter(text));
        });
    }
    row(ui, "accumulation", |ui| {
        named(ui, "accumulation", &mut view.accumulation, Accumulation::ALL, Accumulation::name);
    });
    if view.accumulation == Accumulation::Tiled {
        row(ui, "interleave", |ui| {
            ui.horizontal(|ui| {
                for n in [1, 2, 4] {
                    ui.selectable_value(&mut view.interleave, n, n.to_string());
                }
            });
        });
    }
    row(ui, "light range ε", |ui| {
        let slider = slider(&mut view.epsilon, 0.0..=1.0).logarithmic(true).smallest_positive(1e-8);
        ui.add(slider.custom_formatter(|e, _| if e > 0.0 { format!("{e:.1e}") } else { "unlimited".into() }));
    });
    row(ui, "shadows", |ui| named(ui, "shadows", &mut view.shadows, Shadows::ALL, Shadows::name));
    row(ui, "light samples", |ui| {
        ui.add(slider(&mut view.light_samples, 1..=64).logarithmic(true));
    });
    row(ui, "only light", |ui| {
        let named = (0u32..).zip(&scene.lights).map(|(id, light)| (Some(id), light.name.clone()));
        let names: Vec<_> = std::iter::once((None, "all".to_owned())).chain(named).collect();
        let now =
            names.iter().find(|(id, _)| *id == view.only_light).map_or("all".into(), |(_, n)| n.clone());
        combo(ui, "only light", &mut view.only_light, names, now);
    });
}

/// A slider for what is usual; a value beyond it stays, and can be typed. What the renderer refuses is put back.
fn slider<N: egui::emath::Numeric>(value: &mut N, usual: std::ops::RangeInclusive<N>) -> Slider<'_> {
    Slider::new(value, usual).clamping(SliderClamping::Never)
}

fn row(ui: &mut Ui, label: &str, add: impl FnOnce(&mut Ui)) {
    ui.label(label);
    add(ui);
    ui.end_row();
}

fn combo<T: PartialEq>(ui: &mut Ui, id: &str, value: &mut T, names: Vec<(T, String)>, now: String) {
    ComboBox::from_id_salt(id).selected_text(now).show_ui(ui, |ui| {
        for (candidate, name) in names {
            ui.selectable_value(value, candidate, name);
        }
    });
}

fn named<T: PartialEq + Copy>(ui: &mut Ui, id: &str, value: &mut T, all: &[T], name: fn(T) -> &'static str) {
    let now = name(*value).to_owned();
    combo(ui, id, value, all.iter().map(|&v| (v, name(v).to_owned())).collect(), now);
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use glam::Vec3;
    use photonstream_scene::{RenderSettings, SceneConfig};
    use photonstream_shading::Camera;
    use std::path::Path;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: crate::Args,
    }

    #[test]
    fn values_beyond_the_sliders_are_left_as_they_are() {
        let text = "
            [camera]
            position_m = [0, 0, 4]
            target_m = [0, 0, 0]
            vertical_fov_deg = 40
            [material.white]
            albedo = 0.5
            [object.box]
            material = \"white\"
            box = { size_m = [1, 1, 1] }
            [light.lamp]
            power_w = 10
            point = { position_m = [0, 2, 0] }
        ";
        let scene = SceneConfig::from_text(text, Path::new("s.toml")).unwrap().build().unwrap();
        let args = Command::try_parse_from(["w", "--visibility", "rays", "--rays", "1000"]).unwrap().args;
        let camera = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0).unwrap();
        let mut choices = Choices::new(&RenderSettings::default(), &camera, &args);
        choices.exposure_ev = -12.34;
        choices.view.epsilon = 5.0;
        choices.view.light_samples = 1000;
        let before = choices.clone();
        assert_eq!(before.view.rays_per_pixel, 1000);
        egui::__run_test_ui(|ui| {
            Grid::new("view").show(ui, |ui| switches(ui, &mut choices, &scene));
        });
        assert_eq!(choices, before);
    }
}
