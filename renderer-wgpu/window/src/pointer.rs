//! Turns buttons, motion and wheel of the mouse into camera, selection and moved things.

use crate::{
    commands::{place_light, place_object},
    dragging::{Along, Hold},
    gizmos::Gizmo,
    picking::{ICON_POINTS, Pick, Target, is_wall},
    session::Session,
    standing::Standing,
};
use core::f32::consts::PI;
use photonstream_scene::{LightId, vpls::VplTables};
use std::time::Instant;

/// From this way on, in points, a press is a drag and not a click.
const CLICK_POINTS: f32 = 4.0;

/// A button of the mouse that does something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Button {
    /// Takes hold of things, and circles beside them.
    Left,
    /// Circles.
    Right,
    /// Shifts.
    Middle,
}

/// Where the cursor is and what it is doing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pointer {
    cursor: [f32; 2],
    gesture: Option<Gesture>,
    /// Shift: things move up and down.
    pub(crate) shift: bool,
    /// Control: walls are taken hold of too, and gizmos go along surfaces.
    pub(crate) control: bool,
}

#[derive(Clone, Debug)]
struct Gesture {
    button: Button,
    /// Where it began.
    from: [f32; 2],
    /// Whether the cursor has left the place of the press.
    is_drag: bool,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Orbit(Option<Pick>),
    Pan,
    Hold { hold: Hold, thing: Thing },
}

/// What is held, by its name for edits.
#[derive(Clone, Debug)]
enum Thing {
    Light(String),
    Object(String),
    /// A gizmo, and what all tables were before.
    Gizmo(Gizmo, Box<VplTables>),
}

impl Pointer {
    /// Forgets what is being done.
    pub(crate) fn let_go(&mut self) {
        self.gesture = None;
    }

    /// Where the cursor is, in pixels.
    pub(crate) fn cursor(&self) -> [f32; 2] {
        self.cursor
    }

    /// Whether a thing is being held.
    pub(crate) fn is_holding(&self) -> bool {
        matches!(&self.gesture, Some(Gesture { kind: Kind::Hold { .. }, .. }))
    }

    /// Whether a gizmo is being held.
    pub(crate) fn is_holding_gizmo(&self) -> bool {
        matches!(&self.gesture, Some(Gesture { kind: Kind::Hold { thing: Thing::Gizmo(..), .. }, .. }))
    }
}

impl Session {
    /// A button was pressed.
    pub(crate) fn press(&mut self, button: Button) {
        if self.pointer.gesture.is_some() {
            return;
        }
        let cursor = self.pointer.cursor;
        if let Some(kind) = self.placing.take_if(|_| button == Button::Left) {
            self.add_gizmo(kind, Instant::now());
            return;
        }
        let kind = match button {
            Button::Middle => Kind::Pan,
            Button::Right => Kind::Orbit(None),
            Button::Left => {
                let radius = self.shows_overlay.then_some(ICON_POINTS * self.scale);
                let gizmo = self
                    .gizmo_at(cursor)
                    .map(|(distance, gizmo, point)| (distance, Pick { target: Target::Gizmo(gizmo), point }));
                let pick = self
                    .eye()
                    .zip(self.scene())
                    .and_then(|(eye, scene)| eye.pick(scene, cursor, radius, gizmo));
                match pick.and_then(|pick| self.take_hold(&pick)) {
                    Some(kind) => {
                        self.select(pick.map(|p| p.target));
                        kind
                    }
                    None => Kind::Orbit(pick),
                }
            }
        };
        self.pointer.gesture = Some(Gesture { button, from: cursor, is_drag: false, kind });
    }

    fn take_hold(&self, pick: &Pick) -> Option<Kind> {
        let published = self.published.as_ref()?;
        let (scene, standing) = (&published.scene, &published.standing);
        let (thing, start_m) = match pick.target {
            Target::Object(id) if is_wall(scene, id) && !self.pointer.control => return None,
            Target::Object(id) => {
                let (name, start_m) = standing.object(scene, id)?;
                (Thing::Object(name), start_m)
            }
            Target::Light(id) => held_light(scene, standing, id)?,
            Target::Gizmo(gizmo) => {
                let (_, place) = self.gizmo_place(gizmo)?;
                (Thing::Gizmo(gizmo, Box::new(self.gizmos.tables().clone())), place)
            }
        };
        Some(Kind::Hold { hold: Hold::new(pick.point, self.pointer.cursor, start_m), thing })
    }

    /// The cursor has moved; whether anything changed but the cursor.
    pub(crate) fn point(&mut self, cursor: [f32; 2]) -> bool {
        let last = std::mem::replace(&mut self.pointer.cursor, cursor);
        let height = self.size.1.max(1) as f32;
        let far = CLICK_POINTS * self.scale;
        let Some(gesture) = &mut self.pointer.gesture else { return false };
        let way = (cursor[0] - gesture.from[0]).hypot(cursor[1] - gesture.from[1]);
        if !gesture.is_drag && way < far {
            return false;
        }
        // The first step makes up for what was waited.
        let last = if gesture.is_drag { last } else { gesture.from };
        gesture.is_drag = true;
        let (dx, dy) = ((cursor[0] - last[0]) / height, (cursor[1] - last[1]) / height);
        match (&gesture.kind, &mut self.navigation) {
            (Kind::Orbit(_), Some(navigation)) => navigation.orbit(dx * PI, dy * PI),
            (Kind::Pan, Some(navigation)) => navigation.pan(dx, dy),
            (Kind::Hold { .. }, _) => self.drag(),
            (_, None) => return false,
        }
        true
    }

    /// Moves what is held to the cursor.
    pub(crate) fn drag(&mut self) {
        let Some(Gesture { kind: Kind::Hold { hold, thing }, is_drag: true, .. }) = &self.pointer.gesture
        else {
            return;
        };
        let Some((eye, navigation)) = self.eye().zip(self.navigation.as_ref()) else { return };
        let along = if self.pointer.shift { Along::Vertical(navigation.vertical()) } else { Along::Screen };
        let (hold, cursor) = (*hold, self.pointer.cursor);
        let place = hold.position_m(&eye, cursor, along);
        let request = match (thing, place) {
            (Thing::Gizmo(gizmo, _), _) => {
                let (gizmo, along) = (*gizmo, (!self.pointer.control).then_some(along));
                return self.drag_gizmo(gizmo, &hold, cursor, along);
            }
            (Thing::Light(name), Some(position_m)) => place_light(name, position_m),
            (Thing::Object(name), Some(position_m)) => place_object(name, position_m),
            (_, None) => return,
        };
        self.outbox.push(request);
    }

    /// A button was released.
    pub(crate) fn release(&mut self, button: Button) {
        if self.pointer.gesture.as_ref().is_none_or(|gesture| gesture.button != button) {
            return;
        }
        if let Some(Gesture { is_drag: false, kind: Kind::Orbit(pick), button: Button::Left, .. }) =
            self.pointer.gesture.take()
        {
            self.select(pick.map(|p| p.target));
        }
    }

    /// Puts what is held back where it was; whether anything was.
    pub(crate) fn put_back(&mut self) -> bool {
        match self.pointer.gesture.take() {
            Some(Gesture { kind: Kind::Hold { hold, thing }, is_drag: true, .. }) => {
                match thing {
                    Thing::Light(name) => self.outbox.push(place_light(&name, hold.start_m())),
                    Thing::Object(name) => self.outbox.push(place_object(&name, hold.start_m())),
                    Thing::Gizmo(_, before) => self.change_gizmos(Instant::now(), |tables| *tables = *before),
                }
                true
            }
            other => {
                self.pointer.gesture = other;
                false
            }
        }
    }

    /// The wheel was turned by so many notches, towards the scene if positive.
    pub(crate) fn wheel(&mut self, notches: f32) {
        if let Some(navigation) = &mut self.navigation {
            navigation.dolly(notches);
        }
    }
}

fn held_light(
    scene: &photonstream_scene::Scene,
    standing: &Standing,
    id: LightId,
) -> Option<(Thing, glam::DVec3)> {
    let light = scene.lights.get(id.0 as usize)?;
    match light.object {
        Some(object) => standing.object(scene, object).map(|(name, start_m)| (Thing::Object(name), start_m)),
        None => Some((Thing::Light(light.name.clone()), Standing::light(scene, id)?)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        following::{Connection, News, Published},
        navigation::project,
        picking::anchor,
        session::Selected,
    };
    use clap::Parser;
    use photonstream_protocol::{Liveness, Request, VslFrame};
    use photonstream_scene::Scene;
    use std::sync::Arc;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: crate::Args,
    }

    fn session() -> Session {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/cornell-box.toml");
        let scene = Scene::load(std::path::Path::new(path)).unwrap();
        let published = Published {
            standing: Arc::new(Standing::of(&scene)),
            scene: Arc::new(scene),
            frame: Arc::new(VslFrame::default()),
        };
        let mut session = Session::new(Command::parse_from(["w"]).args);
        session.size = (600, 600);
        let connection = Connection::Attached(Liveness::Live);
        session.accept(News { published: Some(published), connection, ..News::default() });
        session
    }

    fn on_screen(session: &Session, point: glam::Vec3) -> [f32; 2] {
        project(session.navigation.as_ref().unwrap().camera(), point, 600, 600).unwrap()
    }

    fn centre(session: &Session, name: &str) -> [f32; 2] {
        let scene = session.scene().unwrap();
        let object = &scene.objects[scene.object(name).unwrap().0 as usize];
        on_screen(session, object.world_from_rest.translation.as_vec3())
    }

    #[test]
    fn dragging_a_thing_moves_it_parallel_to_the_screen_and_back_on_demand() {
        let mut session = session();
        let [x, y] = centre(&session, "sphere");
        session.point([x, y]);
        session.press(Button::Left);
        assert_eq!(session.selected, Some(Selected::Object("sphere".into())));
        assert!(!session.point([x + 2.0, y]), "a click does not move it");
        assert!(session.outbox.is_empty());
        assert!(session.point([x + 30.0, y]));
        assert!(session.point([x + 60.0, y]));
        let Request::MoveObject { name, values } = session.outbox.last().unwrap() else { panic!() };
        let [px, py, pz]: [f64; 3] = serde_json::from_value(values["position_m"].clone()).unwrap();
        assert_eq!(name, "sphere");
        // The config puts it at (0.42, 0.36, 0.3); the view is along -z, so that y and z stay, to f32 rounding.
        assert!(px > 0.5 && (py - 0.36).abs() < 1e-5 && (pz - 0.3).abs() < 1e-5, "{px} {py} {pz}");
        session.pointer.shift = true;
        session.point([x + 60.0, y - 50.0]);
        let Request::MoveObject { values, .. } = session.outbox.last().unwrap() else { panic!() };
        let [px, py, _]: [f64; 3] = serde_json::from_value(values["position_m"].clone()).unwrap();
        assert!((px - 0.42).abs() < 1e-5 && py > 0.4, "with shift it rises only: {px} {py}");
        assert!(session.put_back());
        let Request::MoveObject { values, .. } = session.outbox.last().unwrap() else { panic!() };
        let back: [f64; 3] = serde_json::from_value(values["position_m"].clone()).unwrap();
        assert!(back.iter().zip([0.42, 0.36, 0.3]).all(|(a, b)| (a - b).abs() < 1e-7), "{back:?}");
        assert!(!session.put_back());
    }

    #[test]
    fn dragging_a_light_by_its_icon_moves_it() {
        let mut session = session();
        let lamp = anchor(&session.scene().unwrap().lights[0].light).unwrap();
        let [x, y] = on_screen(&session, lamp);
        session.point([x, y]);
        session.press(Button::Left);
        session.point([x - 20.0, y + 40.0]);
        let Request::SetLight { name, values } = session.outbox.last().unwrap() else { panic!() };
        assert!(name == "lamp" && values.len() == 1 && values.contains_key("position_m"));
        session.release(Button::Left);
        let sent = session.outbox.len();
        session.point([x, y]);
        assert_eq!(session.outbox.len(), sent, "let go");
        // Without the overlay there are no icons to take hold of.
        session.shows_overlay = false;
        session.press(Button::Left);
        session.point([x - 20.0, y + 40.0]);
        assert_eq!(session.outbox.len(), sent);
    }

    #[test]
    fn dragging_beside_things_turns_the_camera_and_a_click_selects_the_wall() {
        let mut session = session();
        let home = *session.navigation.as_ref().unwrap().camera();
        session.point([30.0, 300.0]);
        session.press(Button::Left);
        session.release(Button::Left);
        assert_eq!(session.selected, Some(Selected::Object("left-wall".into())));
        assert_eq!(*session.navigation.as_ref().unwrap().camera(), home);
        for button in [Button::Left, Button::Right, Button::Middle] {
            let before = *session.navigation.as_ref().unwrap().camera();
            session.point([30.0, 300.0]);
            session.press(button);
            session.point([60.0, 310.0]);
            session.release(button);
            assert_ne!(*session.navigation.as_ref().unwrap().camera(), before, "{button:?}");
        }
        assert!(session.outbox.is_empty());
        // Control takes hold of walls too.
        session.navigation.as_mut().unwrap().reset();
        session.pointer.control = true;
        session.point([30.0, 300.0]);
        session.press(Button::Left);
        session.point([60.0, 310.0]);
        assert!(
            matches!(session.outbox.last(), Some(Request::MoveObject { name, .. }) if name == "left-wall")
        );
    }
}
