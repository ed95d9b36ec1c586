//! Turns the selected VPL, blocker or proxy into numbers that can be changed.

use super::selection::position;
use crate::{
    following::Published,
    gizmos::{Gizmo, Places, Roles, albedo},
    session::Session,
};
use egui::{ComboBox, DragValue, Ui};
use glam::{DVec3, Vec3};
use photonstream_scene::{
    ObjectId,
    config::{Vector, VplConfig},
    vpls::{VplTables, moved_normal},
};
use std::time::Instant;

pub(super) fn show(ui: &mut Ui, session: &mut Session, gizmo: Gizmo, published: &Published, now: Instant) {
    let Some((object, place)) = session.gizmo_place(gizmo) else { return };
    let mut tables = session.gizmos.tables().clone();
    let mut entry = Entry { ui, published, places: Places::of(published), object, place };
    match gizmo {
        Gizmo::Vpl(i) => {
            let weight = session.gizmos.set().vpls.get(i).and_then(|vpl| vpl.weight);
            let roles = Roles::of(published, session.gizmos.set());
            entry.light(if i < roles.statics { Some(i) } else { None });
            entry.vpl(&mut tables.vpl[i], weight);
        }
        Gizmo::Blocker(i) => entry.blocker(&mut tables, i),
        Gizmo::Proxy(i) => entry.proxy(&mut tables, i),
    }
    if ui.button("Remove").clicked() {
        session.remove_gizmo(now);
    } else if tables != *session.gizmos.tables() {
        session.change_gizmos(now, |t| *t = tables);
    }
}

struct Entry<'a, 'b> {
    ui: &'a mut Ui,
    published: &'b Published,
    places: Places<'b>,
    /// What it moves with.
    object: Option<ObjectId>,
    /// Where it is, in metres from the scene's origin.
    place: DVec3,
}

impl Entry<'_, '_> {
    /// The light of a VPL as it is published.
    fn light(&mut self, record: Option<usize>) {
        let flux = record.and_then(|i| self.published.frame.vsls.get(i)).map(|vsl| Vec3::from(vsl.flux));
        self.ui.label(match flux {
            Some(flux) if flux == Vec3::ZERO => "does not shine".into(),
            Some(flux) => format!("{:.3} W, {:.3} W, {:.3} W", flux.x, flux.y, flux.z),
            None => "not used by this method".into(),
        });
    }

    fn vpl(&mut self, vpl: &mut VplConfig, weight: Option<f32>) {
        self.position(&mut vpl.position_m);
        let mut normal = self.normal_of(vpl);
        let changed = self.row("normal", |ui| {
            let mut changed = false;
            for value in [&mut normal.x, &mut normal.y, &mut normal.z] {
                changed |= ui.add(DragValue::new(value).speed(0.01).max_decimals(3)).changed();
            }
            changed
        });
        if let Some(normal) = normal.try_normalize().filter(|_| changed) {
            vpl.normal = self.places.written_normal(self.object, normal);
        }
        let mut colour = vpl.albedo.to_dvec3().as_vec3().to_array();
        if self.row("albedo", |ui| ui.color_edit_button_rgb(&mut colour).changed()) {
            vpl.albedo = albedo(Vec3::from(colour));
        }
        self.row("weight", |ui| {
            let mut is_own = vpl.weight.is_some();
            if ui.checkbox(&mut is_own, "own").changed() {
                vpl.weight = is_own.then(|| f64::from(weight.unwrap_or(1.0)));
            }
            if let Some(weight) = &mut vpl.weight {
                ui.add(DragValue::new(weight).speed(0.02).range(0.0..=1e9).max_decimals(3));
            } else {
                ui.label("by its distances");
            }
        });
        let normal = self.normal_of(vpl);
        if let Some(object) = self.attachment(&mut vpl.object) {
            vpl.position_m = self.places.written_place(object, self.place);
            vpl.normal = self.places.written_normal(object, normal);
        }
    }

    /// The normal as it is in the scene now.
    fn normal_of(&self, vpl: &VplConfig) -> DVec3 {
        let written = vpl.normal.to_dvec3().normalize_or(DVec3::Y);
        moved_normal(&self.places.now_from_loaded(self.object).matrix3, written)
    }

    fn blocker(&mut self, tables: &mut VplTables, i: usize) {
        let blocker = &mut tables.blocker[i];
        self.position(&mut blocker.position_m);
        self.row("radius", |ui| length(ui, &mut blocker.radius_m));
        if let Some(object) = self.attachment(&mut blocker.object) {
            blocker.position_m = self.places.written_place(object, self.place);
        }
    }

    fn proxy(&mut self, tables: &mut VplTables, i: usize) {
        let proxy = &mut tables.proxy[i];
        self.position(proxy.position_m.get_or_insert_default());
        if let Some(cuboid) = &mut proxy.cuboid {
            self.row("size", |ui| cuboid.size_m.0.iter_mut().for_each(|edge| length(ui, edge)));
        }
        if let Some(sphere) = &mut proxy.sphere {
            self.row("radius", |ui| length(ui, &mut sphere.radius_m));
        }
        if let Some(hull) = &proxy.hull {
            self.ui.label(format!("hull of {} points", hull.points_m.len()));
        }
        let Vector(turn) = proxy.rotation_deg.get_or_insert_default();
        self.row("rotation", |ui| {
            for degrees in turn {
                ui.add(DragValue::new(degrees).speed(0.5).max_decimals(1).suffix("°"));
            }
        });
        if let Some(object) = &proxy.object {
            self.ui.label(format!("moves with {object}"));
        }
    }

    fn position(&mut self, written: &mut Vector) {
        let origin = self.published.scene.origin_m;
        let mut place = self.place + origin;
        if position(self.ui, &mut place) && place.is_finite() {
            self.place = place - origin;
            *written = self.places.written_place(self.object, self.place);
        }
    }

    /// What it moves with, by its name in the config; the object, if the user has chosen another.
    fn attachment(&mut self, name: &mut Option<String>) -> Option<Option<ObjectId>> {
        let before = name.clone();
        let objects = &self.published.scene.objects;
        self.row("moves with", |ui| {
            let now = name.clone().unwrap_or_else(|| "nothing".into());
            ComboBox::from_id_salt("moves with").selected_text(now).show_ui(ui, |ui| {
                ui.selectable_value(name, None, "nothing");
                for object in objects {
                    ui.selectable_value(name, Some(object.name.clone()), &object.name);
                }
            });
        });
        (*name != before).then(|| name.as_ref().and_then(|name| self.published.scene.object(name)))
    }

    fn row<R>(&mut self, label: &str, add: impl FnOnce(&mut Ui) -> R) -> R {
        self.ui
            .horizontal(|ui| {
                ui.label(label);
                add(ui)
            })
            .inner
    }
}

/// A length above 0.
fn length(ui: &mut Ui, metres: &mut f64) {
    let speed = (*metres * 0.01).clamp(1e-4, 1.0);
    ui.add(DragValue::new(metres).speed(speed).range(1e-4..=1e6).max_decimals(4).suffix(" m"));
}
