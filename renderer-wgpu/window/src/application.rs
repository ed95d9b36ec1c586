//! Turns the events of a window into a running session: draws when something changed, and waits otherwise.

use crate::{
    Args, Fault, FaultKind, WindowError,
    commands::{Commands, Told},
    drawing::picture,
    error::is_failure,
    following::Following,
    graphics::{Graphics, Shown},
    overlay::{self, Machine},
    session::Session,
};
use photonstream_protocol::monotonic_ns;
use photonstream_renderer_wgpu::GpuError;
use std::{
    sync::{Arc, atomic::AtomicBool, mpsc},
    time::{Duration, Instant},
};
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::{StartCause, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop},
    window::{Window, WindowId},
};

/// A device that fails so often within [`FAILING`] is given up.
const FAILURES: usize = 3;
/// See [`FAILURES`].
const FAILING: Duration = Duration::from_secs(20);

/// What a window has done.
#[derive(Clone, Debug)]
pub struct Report {
    /// Published frames that were shown.
    pub frames: u64,
    /// Pictures that were handed to the display.
    pub presented: u64,
    /// How often the device was opened again after a failure.
    pub reopened: u64,
    /// Why it ended.
    pub ended: Ended,
}

/// Why a window has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The user closed it.
    Closed,
    /// All frames asked for were shown.
    Done,
    /// Somebody asked to stop.
    Cancelled,
}

/// News from another thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wake;

/// Connects to the display; a process may do so once.
///
/// # Errors
/// [`WindowError::NoDisplay`].
pub(crate) fn event_loop() -> Result<EventLoop<Wake>, WindowError> {
    let built = EventLoop::<Wake>::with_user_event().build();
    built.map_err(|error| WindowError::NoDisplay { reason: error.to_string() })
}

/// Opens a window on the channel that `args` name, also before there is one, until the user closes it, all frames asked
/// for are shown, or `cancelled` is set. Must be called from the main thread, once in a process.
///
/// # Errors
/// [`WindowError`]: no display, no adapter, a channel that is insecure or of another release.
pub fn run(args: &Args, cancelled: &Arc<AtomicBool>) -> Result<Report, WindowError> {
    let event_loop = event_loop()?;
    event_loop.set_control_flow(ControlFlow::Wait);
    let wake = || {
        let proxy = event_loop.create_proxy();
        move || {
            // Refused once the loop has ended: nobody waits for news then.
            let _ = proxy.send_event(Wake);
        }
    };
    let following = Following::start(args.channel.clone(), Arc::clone(cancelled), wake())?;
    let (tell, told) = mpsc::channel();
    let awaken = wake();
    let commands = Commands::start(args.channel.clone(), move |outcome| {
        // As above.
        let _ = tell.send(outcome);
        awaken();
    })?;
    let mut application = Application {
        session: Session::new(args.clone()),
        following,
        commands,
        told,
        window: None,
        graphics: None,
        machine: Machine::default(),
        is_occluded: false,
        last: None,
        look_again: None,
        failures: Vec::new(),
        report: Report { frames: 0, presented: 0, reopened: 0, ended: Ended::Closed },
        error: None,
    };
    event_loop
        .run_app(&mut application)
        .map_err(|error| WindowError::System { reason: error.to_string() })?;
    application.report.frames = application.session.shown_frames();
    application.error.map_or(Ok(application.report), Err)
}

/// The window and all that belongs to it.
pub(crate) struct Application {
    pub(crate) session: Session,
    following: Following,
    commands: Commands,
    told: mpsc::Receiver<Told>,
    pub(crate) window: Option<Arc<Window>>,
    pub(crate) graphics: Option<Graphics>,
    machine: Machine,
    pub(crate) is_occluded: bool,
    /// When the last picture was drawn, while the camera moves.
    last: Option<Instant>,
    /// When the interface wants to be laid out again.
    look_again: Option<Instant>,
    /// When the device failed.
    failures: Vec<Instant>,
    report: Report,
    error: Option<WindowError>,
}

impl ApplicationHandler<Wake> for Application {
    fn new_events(&mut self, event_loop: &ActiveEventLoop, cause: StartCause) {
        if let StartCause::ResumeTimeReached { .. } = cause {
            self.look_again = None;
            event_loop.set_control_flow(ControlFlow::Wait);
            self.request_redraw();
        }
    }

    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let result = self.open(event_loop);
        self.end_on_error(event_loop, result);
    }

    fn suspended(&mut self, _: &ActiveEventLoop) {
        // The surface must not outlive the suspension; the session does.
        self.graphics = None;
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: Wake) {
        if let Some(result) = self.following.ended() {
            match result {
                Ok(()) => self.end(event_loop, Ended::Cancelled),
                Err(error) => self.end_on_error(event_loop, Err(error.into())),
            }
            return;
        }
        self.request_redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.end(event_loop, Ended::Closed),
            WindowEvent::RedrawRequested => {
                let result = self.redraw(event_loop);
                self.end_on_error(event_loop, result);
            }
            event => self.input(event_loop, &event),
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.session.send_gizmos();
        for request in self.session.outbox.drain(..) {
            self.commands.send(request);
        }
        event_loop.set_control_flow(self.look_again.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}

impl Application {
    pub(crate) fn end(&mut self, event_loop: &ActiveEventLoop, ended: Ended) {
        self.report.ended = ended;
        event_loop.exit();
    }

    fn end_on_error(&mut self, event_loop: &ActiveEventLoop, result: Result<(), WindowError>) {
        if let Err(error) = result {
            self.error.get_or_insert(error);
            event_loop.exit();
        }
    }

    pub(crate) fn request_redraw(&self) {
        if let Some(window) = &self.window
            && !self.is_occluded
        {
            window.request_redraw();
        }
    }

    /// Opens window, device and surface, as far as they are not there.
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), WindowError> {
        let window = match &self.window {
            Some(window) => Arc::clone(window),
            None => {
                let size = self.session.args.size.map_or((800, 600), |size| (size.width, size.height));
                let attributes = Window::default_attributes()
                    .with_title(format!("photonstream: {}", self.session.args.channel))
                    .with_inner_size(PhysicalSize::new(size.0, size.1));
                let window = event_loop
                    .create_window(attributes)
                    .map_err(|error| WindowError::System { reason: error.to_string() })?;
                Arc::clone(self.window.insert(Arc::new(window)))
            }
        };
        if self.graphics.is_none() {
            self.open_graphics(event_loop, window, None)?;
        }
        self.request_redraw();
        Ok(())
    }

    fn open_graphics(
        &mut self,
        event_loop: &ActiveEventLoop,
        window: Arc<Window>,
        memory: Option<egui::Memory>,
    ) -> Result<(), WindowError> {
        let choice = self.session.args.gpu.adapter();
        let graphics = Graphics::open(event_loop.owned_display_handle(), window, &choice, memory)?;
        let gpu = graphics.renderer.gpu();
        self.machine = Machine { adapter: gpu.name(), is_software: gpu.is_software() };
        tracing::info!("showing pictures of {}", self.machine.adapter);
        // Who asks for software gets the same picture as anywhere.
        self.session.eases = self.machine.is_software && !self.session.args.gpu.software;
        self.graphics = Some(graphics);
        Ok(())
    }

    /// Takes in the news, and shows what there is to see.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<(), WindowError> {
        let now = Instant::now();
        let (Some(window), Some(graphics)) = (self.window.clone(), &mut self.graphics) else { return Ok(()) };
        if self.is_occluded || !graphics.fit() {
            return Ok(());
        }
        let session = &mut self.session;
        session.accept(self.following.take());
        for outcome in self.told.try_iter() {
            session.hear(&outcome, now);
        }
        (session.size, session.scale) = (graphics.size(), window.scale_factor() as f32);
        let elapsed = self.last.map_or(Duration::from_millis(16), |last| now - last);
        let is_moving = session.advance(elapsed);
        self.last = is_moving.then_some(now);

        let machine = &self.machine;
        let mut delay = Duration::MAX;
        let result = picture(graphics, session, now).and_then(|display| {
            let gpu = graphics.renderer.gpu().clone();
            let drawn = session.view();
            delay = graphics.interface.lay_out(&window, &gpu, |ui| overlay::show(ui, session, machine, now));
            // What was just switched is drawn next.
            if session.view() != drawn || session.wants_screenshot {
                delay = Duration::ZERO;
            }
            graphics.present(display)
        });
        match result {
            Ok(Shown::Yes) => {
                self.report.presented += 1;
                tracing::debug!("presented {}", self.report.presented);
                if self.session.count_shown(monotonic_ns()) {
                    self.end(event_loop, Ended::Done);
                }
                self.inject_fault(event_loop, &window)?;
            }
            Ok(Shown::Hidden) => {}
            Ok(Shown::Again) => window.request_redraw(),
            Err(error) if !is_failure(&error) => return Err(error.into()),
            Err(error) => self.reopen(event_loop, window.clone(), error)?,
        }
        if is_moving || delay.is_zero() {
            window.request_redraw();
        }
        self.look_again =
            now.checked_add(delay).filter(|_| !delay.is_zero() && delay < Duration::from_secs(3600));
        Ok(())
    }

    /// Opens the device again after it has failed.
    fn reopen(
        &mut self,
        event_loop: &ActiveEventLoop,
        window: Arc<Window>,
        error: GpuError,
    ) -> Result<(), WindowError> {
        let now = Instant::now();
        self.failures.retain(|&failure| now - failure < FAILING);
        self.failures.push(now);
        if self.failures.len() > FAILURES {
            let times = self.failures.len();
            return Err(WindowError::KeepsFailing { times, seconds: FAILING.as_secs(), last: error });
        }
        let memory = self.graphics.take().map(|graphics| graphics.interface.memory());
        self.session.notices.warn(format!("{error}; it was opened again"), now);
        self.report.reopened += 1;
        self.open_graphics(event_loop, Arc::clone(&window), memory)?;
        window.request_redraw();
        Ok(())
    }

    /// Lets happen once what the arguments ask for.
    fn inject_fault(
        &mut self,
        event_loop: &ActiveEventLoop,
        window: &Arc<Window>,
    ) -> Result<(), WindowError> {
        let is_due = |fault: &mut Fault| self.report.presented >= fault.after;
        let Some(fault) = self.session.args.fault.take_if(is_due) else { return Ok(()) };
        tracing::warn!("fault injection: {:?}", fault.kind);
        let Some(graphics) = &mut self.graphics else { return Ok(()) };
        match fault.kind {
            FaultKind::Device => {
                graphics.renderer.gpu().device.destroy();
                // Its owner has destroyed it: the driver does not report that as a loss.
                let reason = "fault injection".into();
                return self.reopen(event_loop, Arc::clone(window), GpuError::Lost { reason });
            }
            FaultKind::Surface => graphics.fault = Some(wgpu::CurrentSurfaceTexture::Lost),
            FaultKind::Outdated => graphics.fault = Some(wgpu::CurrentSurfaceTexture::Outdated),
            FaultKind::Timeout => graphics.fault = Some(wgpu::CurrentSurfaceTexture::Timeout),
            FaultKind::Suspend => {
                self.suspended(event_loop);
                self.resumed(event_loop);
            }
        }
        window.request_redraw();
        Ok(())
    }
}
