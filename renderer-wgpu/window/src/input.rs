//! Turns window events into what the interface and the session make of them.

use crate::{
    application::{Application, Ended},
    pointer::Button,
};
use winit::{
    event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent},
    event_loop::ActiveEventLoop,
    keyboard::{KeyCode, PhysicalKey},
    window::Fullscreen,
};

impl Application {
    /// Hears of an event: the interface first, then the session.
    pub(crate) fn input(&mut self, event_loop: &ActiveEventLoop, event: &WindowEvent) {
        let (Some(window), Some(graphics)) = (&self.window, &mut self.graphics) else { return };
        let session = &mut self.session;
        // Tab is the overlay's own key, not a step to the next button.
        let is_tab = matches!(event, WindowEvent::KeyboardInput { event, .. }
            if event.physical_key == PhysicalKey::Code(KeyCode::Tab));
        let (mut repaint, consumed) = if is_tab && !graphics.interface.takes_keys() {
            (false, false)
        } else {
            graphics.interface.hear(window, event)
        };
        match event {
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => repaint = true,
            WindowEvent::Occluded(is_occluded) => {
                self.is_occluded = *is_occluded;
                repaint = true;
            }
            WindowEvent::Focused(false) => session.motion.stop(),
            WindowEvent::ModifiersChanged(modifiers) => {
                let state = modifiers.state();
                session.motion.set_fast(state.shift_key());
                let (shift, control) = (state.shift_key(), state.control_key());
                if (session.pointer.shift, session.pointer.control) != (shift, control) {
                    (session.pointer.shift, session.pointer.control) = (shift, control);
                    session.drag();
                }
            }
            WindowEvent::KeyboardInput { event, .. } => {
                let is_down = event.state == ElementState::Pressed;
                // A key that went down for the camera has to come up for it too.
                if let PhysicalKey::Code(key) = event.physical_key
                    && (!consumed || !is_down)
                {
                    let was_fullscreen = session.wants_fullscreen;
                    session.key(key, is_down, event.repeat);
                    if session.wants_fullscreen != was_fullscreen {
                        let fullscreen = session.wants_fullscreen.then_some(Fullscreen::Borderless(None));
                        window.set_fullscreen(fullscreen);
                    }
                    repaint = true;
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                repaint |= session.point([position.x as f32, position.y as f32]);
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let button = match button {
                    MouseButton::Left => Button::Left,
                    MouseButton::Right => Button::Right,
                    MouseButton::Middle => Button::Middle,
                    _ => return,
                };
                match state {
                    ElementState::Pressed if consumed => {}
                    ElementState::Pressed => session.press(button),
                    ElementState::Released => session.release(button),
                }
                repaint = true;
            }
            WindowEvent::MouseWheel { delta, .. } if !consumed => {
                session.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => *lines,
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / 40.0,
                });
                repaint = true;
            }
            _ => {}
        }
        if session.wants_end {
            self.end(event_loop, Ended::Closed);
        } else if repaint {
            self.request_redraw();
        }
    }
}
