//! Turns display and adapters of this machine into the word whether a window could show pictures, or why not.

use crate::{WindowError, application::event_loop, graphics::open_surface};
use photonstream_renderer_wgpu::AdapterChoice;
use std::sync::Arc;
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::WindowEvent,
    event_loop::ActiveEventLoop,
    window::{Window, WindowId},
};

/// Whether a device that `choice` allows can show pictures on the display: opens both for a window that nobody sees,
/// and closes them. Must be called from the main thread, and not by a process that calls [`run`](crate::run): a process
/// may connect to its display once.
///
/// # Errors
/// What [`run`](crate::run) would fail with: [`WindowError::NoDisplay`], [`WindowError::Surface`],
/// [`WindowError::Gpu`], [`WindowError::System`].
pub fn probe(choice: &AdapterChoice) -> Result<(), WindowError> {
    let mut probe = Probe { choice, result: None };
    let system = |reason: String| WindowError::System { reason };
    event_loop()?.run_app(&mut probe).map_err(|error| system(error.to_string()))?;
    probe.result.unwrap_or_else(|| Err(system("it has ended before there was a window".into())))
}

struct Probe<'a> {
    choice: &'a AdapterChoice,
    result: Option<Result<(), WindowError>>,
}

impl ApplicationHandler<crate::application::Wake> for Probe<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        self.result = Some(open(event_loop, self.choice));
        event_loop.exit();
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, _: WindowEvent) {}
}

fn open(event_loop: &ActiveEventLoop, choice: &AdapterChoice) -> Result<(), WindowError> {
    let attributes =
        Window::default_attributes().with_visible(false).with_inner_size(PhysicalSize::new(64, 64));
    let window = event_loop.create_window(attributes);
    let window = window.map_err(|error| WindowError::System { reason: error.to_string() })?;
    let (gpu, ..) = open_surface(event_loop.owned_display_handle(), &Arc::new(window), choice)?;
    Ok(gpu.check()?)
}
