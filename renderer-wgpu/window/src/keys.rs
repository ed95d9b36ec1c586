//! Turns keys into what the window does, and held keys into motion of the camera.

use crate::{
    choices::{EXPOSURE_MOST, SHOWS},
    gizmos::Kind,
    navigation::Navigation,
    session::Session,
};
use glam::Vec3;
use photonstream_protocol::Request;
use std::time::Instant;
use winit::keyboard::KeyCode;

/// Radians per second that the arrow keys turn the head by.
const TURN: f32 = 1.2;
/// Stops by which one key press changes the exposure.
const EXPOSURE_STEP: f32 = 0.25;

/// What keys do, for the help text: key, effect.
pub(crate) const HELP: [(&str, &str); 22] = [
    ("drag left", "circle; on a thing or a light: move it"),
    ("shift + drag", "move it up and down"),
    ("ctrl + drag", "move walls too; gizmos along surfaces"),
    ("drag right", "circle"),
    ("drag middle", "shift the view"),
    ("wheel", "nearer, farther"),
    ("W A S D Q E", "fly; with shift faster"),
    ("arrows", "turn the head"),
    ("R", "camera back to the scene's own"),
    ("Esc", "put back what is dragged; deselect"),
    ("Space, N", "pause or resume; one step"),
    ("1 … 9", "full, direct, indirect, albedo, normal, owners, flux, depth, discs"),
    ("0, T", "age, tiles"),
    ("+ −", "exposure"),
    ("P, F12", "screenshot: EXR and PNG"),
    ("F11", "full screen"),
    ("G", "gizmos: VPLs, blockers, proxies, phantoms, second bounces"),
    ("V, B", "with gizmos: add a VPL, a blocker at the cursor"),
    ("Delete", "remove the selected gizmo"),
    ("Ctrl+S", "save VPLs, blockers and proxies in the file that is simulated"),
    ("Tab, F1", "overlay"),
    ("H; Ctrl+Q", "this help; quit"),
];

/// The keys that move the camera and are held down.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    held: Vec<KeyCode>,
    fast: bool,
}

impl Motion {
    /// All keys are up: the window has lost the keyboard.
    pub(crate) fn stop(&mut self) {
        self.held.clear();
        self.fast = false;
    }

    /// Whether shift is down.
    pub(crate) fn set_fast(&mut self, fast: bool) {
        self.fast = fast;
    }

    fn set(&mut self, key: KeyCode, is_down: bool) {
        self.held.retain(|&held| held != key);
        if is_down {
            self.held.push(key);
        }
    }

    /// Moves the camera for `seconds`; whether a key is held.
    pub(crate) fn advance(&self, navigation: &mut Navigation, seconds: f32) -> bool {
        let down = |key| f32::from(u8::from(self.held.contains(&key)));
        let axis = |plus, minus| down(plus) - down(minus);
        let motion = Vec3::new(
            axis(KeyCode::KeyD, KeyCode::KeyA),
            axis(KeyCode::KeyE, KeyCode::KeyQ),
            axis(KeyCode::KeyW, KeyCode::KeyS),
        );
        let (right, up) =
            (axis(KeyCode::ArrowRight, KeyCode::ArrowLeft), axis(KeyCode::ArrowUp, KeyCode::ArrowDown));
        if motion != Vec3::ZERO {
            navigation.fly(motion, seconds, self.fast);
        }
        if right != 0.0 || up != 0.0 {
            navigation.turn(right * TURN * seconds, up * TURN * seconds);
        }
        !self.held.is_empty()
    }
}

/// Whether a key moves the camera while it is held.
fn moves(key: KeyCode) -> bool {
    matches!(
        key,
        KeyCode::KeyW
            | KeyCode::KeyA
            | KeyCode::KeyS
            | KeyCode::KeyD
            | KeyCode::KeyQ
            | KeyCode::KeyE
            | KeyCode::ArrowLeft
            | KeyCode::ArrowRight
            | KeyCode::ArrowUp
            | KeyCode::ArrowDown
    )
}

impl Session {
    /// A key went down (`is_repeat` while it stays there) or up.
    pub(crate) fn key(&mut self, key: KeyCode, is_down: bool, is_repeat: bool) {
        // With Ctrl a key is a command, but one that was held before still comes up.
        if moves(key) && (!is_down || !self.pointer.control) {
            self.motion.set(key, is_down);
            return;
        }
        if !is_down {
            return;
        }
        let step = match key {
            KeyCode::Equal | KeyCode::NumpadAdd => EXPOSURE_STEP,
            KeyCode::Minus | KeyCode::NumpadSubtract => -EXPOSURE_STEP,
            _ => 0.0,
        };
        if let Some(choices) = &mut self.choices {
            choices.exposure_ev = (choices.exposure_ev + step).clamp(-EXPOSURE_MOST, EXPOSURE_MOST);
        }
        if is_repeat {
            return;
        }
        match key {
            KeyCode::Tab | KeyCode::F1 => self.shows_overlay = !self.shows_overlay,
            KeyCode::KeyH => self.shows_help = !self.shows_help,
            KeyCode::KeyR | KeyCode::Home => {
                if let Some(navigation) = &mut self.navigation {
                    navigation.reset();
                }
            }
            KeyCode::Space => self.toggle_pause(),
            KeyCode::KeyN => self.outbox.push(Request::Step),
            KeyCode::KeyP | KeyCode::F12 => self.wants_screenshot = true,
            KeyCode::F11 => self.wants_fullscreen = !self.wants_fullscreen,
            KeyCode::KeyQ if self.pointer.control => self.wants_end = true,
            KeyCode::KeyG => {
                self.shows_gizmos = !self.shows_gizmos;
                self.placing = None;
            }
            KeyCode::KeyV if self.shows_gizmos => self.add_gizmo(Kind::Vpl, Instant::now()),
            KeyCode::KeyB if self.shows_gizmos => self.add_gizmo(Kind::Blocker, Instant::now()),
            KeyCode::Delete | KeyCode::Backspace => self.remove_gizmo(Instant::now()),
            KeyCode::KeyS if self.pointer.control => self.save_gizmos(),
            KeyCode::Escape if self.placing.take().is_none() && !self.put_back() => {
                self.selected = None;
                self.shows_help = false;
            }
            _ => {}
        }
        if let (Some(index), Some(choices)) = (show_of(key), &mut self.choices) {
            choices.view.show = SHOWS[index].0;
        }
    }
}

/// Which of [`SHOWS`] a key stands for.
fn show_of(key: KeyCode) -> Option<usize> {
    use KeyCode::{Digit0, Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9, KeyT};
    [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7, Digit8, Digit9, Digit0, KeyT]
        .into_iter()
        .position(|k| k == key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_shading::Camera;

    #[test]
    fn held_keys_move_the_camera_until_they_are_released() {
        let home = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0).unwrap();
        let mut navigation = Navigation::new(home, 1.0, 1.0);
        let mut motion = Motion::default();
        assert!(!motion.advance(&mut navigation, 1.0));
        assert_eq!(*navigation.camera(), home);
        motion.set(KeyCode::KeyW, true);
        motion.set(KeyCode::KeyW, true);
        motion.set(KeyCode::KeyE, true);
        assert!(motion.advance(&mut navigation, 0.1));
        let place = navigation.camera().position;
        assert!(place.z < 1.0 && place.y > 0.0 && place.x == 0.0, "{place}");
        motion.set(KeyCode::KeyS, true);
        motion.set(KeyCode::KeyE, false);
        motion.advance(&mut navigation, 0.1);
        assert_eq!(navigation.camera().position, place, "forward and back cancel");
        motion.set(KeyCode::ArrowRight, true);
        motion.advance(&mut navigation, 0.1);
        assert!(navigation.camera().forward.x > 0.0);
        motion.stop();
        assert!(!motion.advance(&mut navigation, 1.0));
    }

    #[test]
    fn a_key_that_comes_up_with_ctrl_down_ends_the_flight() {
        #[derive(clap::Parser)]
        struct Command {
            #[command(flatten)]
            args: crate::Args,
        }
        let args = <Command as clap::Parser>::try_parse_from(["w"]).unwrap().args;
        let home = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0).unwrap();
        let mut navigation = Navigation::new(home, 1.0, 1.0);
        let mut session = Session::new(args);
        session.key(KeyCode::KeyW, true, false);
        session.pointer.control = true;
        assert!(session.motion.advance(&mut navigation, 0.1));
        session.key(KeyCode::KeyW, false, false);
        assert!(!session.motion.advance(&mut navigation, 0.1));
        session.key(KeyCode::KeyW, true, false);
        assert!(!session.motion.advance(&mut navigation, 0.1), "with Ctrl it is no flight");
    }

    #[test]
    fn every_view_has_a_key_of_its_own() {
        let keys = [
            KeyCode::Digit1,
            KeyCode::Digit2,
            KeyCode::Digit3,
            KeyCode::Digit4,
            KeyCode::Digit5,
            KeyCode::Digit6,
            KeyCode::Digit7,
            KeyCode::Digit8,
            KeyCode::Digit9,
            KeyCode::Digit0,
            KeyCode::KeyT,
        ];
        let mut indices: Vec<_> = keys.into_iter().filter_map(show_of).collect();
        indices.dedup();
        assert_eq!(indices, (0..SHOWS.len()).collect::<Vec<_>>());
    }
}
