//! Turns what the user does to gizmos into changes of the tables.

use super::{Gizmo, Kind, Places, Shape, Sight, nearest, shapes, surface::Surface};
use crate::{
    dragging::{Along, Hold},
    session::{Selected, Session},
};
use glam::{DVec3, Vec3};
use photonstream_protocol::Request;
use photonstream_scene::{
    ObjectId, Scene,
    config::{BlockerConfig, BoxConfig, OneOrThree, ProxyConfig, Vector, VplConfig},
    vpls::VplTables,
};
use std::time::Instant;

/// The radius of a new blocker is this share of the height of what is seen at its depth.
const NEW_SHARE: f32 = 0.06;

impl Session {
    /// From where gizmos are seen, where they are shown.
    pub(crate) fn sight(&self) -> Option<Sight<'_>> {
        let (published, eye) = (self.published.as_ref()?, self.eye()?);
        self.shows_gizmos.then_some(Sight { eye, scale: self.scale, published })
    }

    /// The gizmo at `cursor`: its distance in pixels, what it is, and its middle.
    pub(crate) fn gizmo_at(&self, cursor: [f32; 2]) -> Option<(f32, Gizmo, Vec3)> {
        let sight = self.sight()?;
        let shapes = shapes(&sight, self.gizmos.set(), self.selected_gizmo());
        nearest(&sight, &shapes, cursor)
            .map(|(distance, Shape { gizmo, point, .. })| (distance, *gizmo, *point))
    }

    /// The gizmo that is selected.
    pub(crate) fn selected_gizmo(&self) -> Option<Gizmo> {
        match self.selected {
            Some(Selected::Gizmo(gizmo)) => Some(gizmo),
            _ => None,
        }
    }

    /// The object with which a gizmo moves, and where it is in metres from the scene's origin.
    pub(crate) fn gizmo_place(&self, gizmo: Gizmo) -> Option<(Option<ObjectId>, DVec3)> {
        let (set, places) = (self.gizmos.set(), Places::of(self.published.as_ref()?));
        match gizmo {
            Gizmo::Vpl(i) => set.vpls.get(i).map(|vpl| (vpl.object, places.vpl(vpl).0)),
            Gizmo::Blocker(i) => set.blockers.get(i).map(|b| (b.object, places.blocker(b))),
            Gizmo::Proxy(i) => set.proxies.get(i).map(|p| (p.object, places.proxy(p).translation)),
        }
    }

    /// Changes the tables; what the scene cannot have is told and left.
    pub(crate) fn change_gizmos(&mut self, now: Instant, change: impl FnOnce(&mut VplTables)) {
        let Some(published) = self.published.clone() else { return };
        if let Err(error) = self.gizmos.change(&published.scene, change) {
            self.notices.warn(error.to_string(), now);
        }
    }

    /// Moves a gizmo to `place`, in metres from the scene's origin, and turns a VPL towards `normal`, if there is one.
    pub(crate) fn move_gizmo(&mut self, gizmo: Gizmo, place: DVec3, normal: Option<DVec3>, now: Instant) {
        let Some(published) = self.published.clone() else { return };
        let Some((object, _)) = self.gizmo_place(gizmo) else { return };
        let places = Places::of(&published);
        let written = places.written_place(object, place);
        let turned = normal.map(|normal| places.written_normal(object, normal));
        self.change_gizmos(now, |tables| match gizmo {
            Gizmo::Vpl(i) => {
                tables.vpl[i].position_m = written;
                tables.vpl[i].normal = turned.unwrap_or(tables.vpl[i].normal);
            }
            Gizmo::Blocker(i) => tables.blocker[i].position_m = written,
            Gizmo::Proxy(i) => tables.proxy[i].position_m = Some(written),
        });
    }

    /// Drags a gizmo that is held to the cursor: parallel to the screen, up and down, or along the surfaces of the scene.
    pub(crate) fn drag_gizmo(&mut self, gizmo: Gizmo, hold: &Hold, cursor: [f32; 2], along: Option<Along>) {
        let Some((eye, scene)) = self.eye().zip(self.scene()) else { return };
        let moved = match along {
            Some(along) => hold.position_m(&eye, cursor, along).map(|place| (place, None)),
            None => Surface::under(&eye, scene, cursor)
                .map(|surface| (surface.point.as_dvec3(), Some(surface.normal.as_dvec3()))),
        };
        if let Some((place, normal)) = moved {
            self.move_gizmo(gizmo, place, normal, Instant::now());
        }
    }

    /// Adds something where the cursor meets a surface, and selects it.
    pub(crate) fn add_gizmo(&mut self, kind: Kind, now: Instant) {
        let Some(published) = self.published.clone() else { return };
        let cursor = self.pointer.cursor();
        let Some((eye, surface)) =
            self.eye().and_then(|eye| Some((eye, Surface::under(&eye, &published.scene, cursor)?)))
        else {
            let what = kind.name();
            return self.notices.warn(format!("no {what} added: there is no surface under the cursor"), now);
        };
        let places = Places::of(&published);
        // With what has been moved it stays there; else it is free.
        let is_moved = published.standing.loaded(surface.object)
            != Some(published.scene.world_from_loaded(surface.object));
        let object = Some(surface.object).filter(|_| is_moved && kind != Kind::Proxy);
        let name = object.map(|object| published.scene.objects[object.0 as usize].name.clone());
        let position_m = places.written_place(object, surface.point.as_dvec3());
        let radius_m = new_radius(&published.scene, 2.0 * eye.camera.tan_half_fov * surface.depth);
        let tables = self.gizmos.tables();
        let gizmo = match kind {
            Kind::Vpl => Gizmo::Vpl(tables.vpl.len()),
            Kind::Blocker => Gizmo::Blocker(tables.blocker.len()),
            Kind::Proxy => Gizmo::Proxy(tables.proxy.len()),
        };
        let normal = places.written_normal(object, surface.normal.as_dvec3());
        self.change_gizmos(now, |tables| match kind {
            Kind::Vpl => tables.vpl.push(VplConfig {
                position_m,
                normal,
                albedo: albedo(surface.albedo),
                weight: None,
                placed: None,
                object: name,
            }),
            Kind::Blocker => tables.blocker.push(BlockerConfig { position_m, radius_m, object: name }),
            Kind::Proxy => tables.proxy.push(ProxyConfig {
                position_m: Some(position_m),
                cuboid: Some(BoxConfig { size_m: Vector([2.0 * radius_m; 3]), centre_m: None }),
                ..ProxyConfig::default()
            }),
        });
        if self.gizmos.has(gizmo) {
            self.selected = Some(Selected::Gizmo(gizmo));
        }
    }

    /// Removes what is selected, if it is a gizmo.
    pub(crate) fn remove_gizmo(&mut self, now: Instant) {
        let Some(gizmo) = self.selected_gizmo().filter(|&gizmo| self.gizmos.has(gizmo)) else { return };
        self.pointer.let_go();
        self.change_gizmos(now, |tables| match gizmo {
            Gizmo::Vpl(i) => drop(tables.vpl.remove(i)),
            Gizmo::Blocker(i) => drop(tables.blocker.remove(i)),
            Gizmo::Proxy(i) => drop(tables.proxy.remove(i)),
        });
        self.selected = None;
    }

    /// Queues the request for what has changed, at most one.
    pub(crate) fn send_gizmos(&mut self) {
        self.outbox.extend(self.gizmos.take_request());
    }

    /// Asks the simulator to write the tables into its config.
    pub(crate) fn save_gizmos(&mut self) {
        self.send_gizmos();
        self.outbox.push(Request::SaveVpls {});
    }
}

/// To three decimal digits.
pub(crate) fn albedo(albedo: Vec3) -> OneOrThree {
    let digits = (albedo.as_dvec3().clamp(DVec3::ZERO, DVec3::ONE) * 1e3).round() / 1e3;
    OneOrThree(digits.to_array())
}

/// The radius of something new where the picture is `height` metres high: two digits, no more than a quarter of the scene's.
fn new_radius(scene: &Scene, height: f32) -> f64 {
    let most = f64::from(scene.bounds.radius) * 0.25;
    let radius = f64::from(NEW_SHARE * height).clamp(most * 1e-3, most);
    format!("{radius:.1e}").parse().unwrap_or(most)
}
