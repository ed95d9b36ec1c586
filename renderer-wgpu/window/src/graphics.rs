//! Turns a window into a surface, a device and a renderer, and a picture with its interface into what it shows.

use crate::{WindowError, interface::Interface};
use photonstream_film::Display;
use photonstream_renderer_wgpu::{AdapterChoice, Gpu, GpuError, Renderer, instance_flags};
use std::sync::Arc;
use winit::{event_loop::OwnedDisplayHandle, window::Window};

/// Device, surface and renderer of a window. Dropped and opened again when the device is lost.
#[derive(Debug)]
pub(crate) struct Graphics {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    /// What draws the picture.
    pub(crate) renderer: Renderer,
    /// What lies over it.
    pub(crate) interface: Interface,
    /// Size of the picture that it has drawn last; `None` where it has none to show.
    pub(crate) drawn: Option<(u32, u32)>,
    /// What the surface says next instead of the truth.
    pub(crate) fault: Option<wgpu::CurrentSurfaceTexture>,
}

/// What became of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// It is on its way to the screen.
    Yes,
    /// Nobody could see it.
    Hidden,
    /// The surface was not ready; try again.
    Again,
}

impl Graphics {
    /// Opens a device that can show pictures in `window`.
    ///
    /// # Errors
    /// [`WindowError::Surface`], [`WindowError::Gpu`].
    pub(crate) fn open(
        display: OwnedDisplayHandle,
        window: Arc<Window>,
        choice: &AdapterChoice,
        memory: Option<egui::Memory>,
    ) -> Result<Self, WindowError> {
        let (gpu, surface, configuration) = open_surface(display, &window, choice)?;
        for reason in &gpu.passed_over {
            tracing::info!("adapter passed over: {reason}");
        }
        let interface = Interface::new(&window, &gpu, configuration.format, memory);
        let renderer = Renderer::new(gpu)?;
        Ok(Self { window, surface, configuration, renderer, interface, drawn: None, fault: None })
    }

    /// The size of the surface in pixels.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.configuration.width, self.configuration.height)
    }

    /// Fits the surface to the window; whether there is anything to see.
    pub(crate) fn fit(&mut self) -> bool {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            return false;
        }
        let most = self.renderer.gpu().device.limits().max_texture_dimension_2d;
        let (width, height) = (size.width.min(most), size.height.min(most));
        if (width, height) != self.size() {
            (self.configuration.width, self.configuration.height) = (width, height);
            self.surface.configure(&self.renderer.gpu().device, &self.configuration);
        }
        true
    }

    /// Shows the last picture that the renderer has drawn, as `display` says, and the interface over it; where either
    /// is missing, the interface alone.
    ///
    /// # Errors
    /// [`GpuError`] of a device that has failed.
    pub(crate) fn present(&mut self, display: Option<Display>) -> Result<Shown, GpuError> {
        let target = match self.fault.take().unwrap_or_else(|| self.surface.get_current_texture()) {
            wgpu::CurrentSurfaceTexture::Success(target)
            | wgpu::CurrentSurfaceTexture::Suboptimal(target) => target,
            wgpu::CurrentSurfaceTexture::Occluded => return Ok(Shown::Hidden),
            // Of light that has converged there is no next picture.
            wgpu::CurrentSurfaceTexture::Timeout => return Ok(Shown::Again),
            wgpu::CurrentSurfaceTexture::Outdated => {
                self.surface.configure(&self.renderer.gpu().device, &self.configuration);
                self.renderer.gpu().check()?;
                return Ok(Shown::Again);
            }
            wgpu::CurrentSurfaceTexture::Lost => {
                self.renderer.gpu().check()?;
                return self.replace_surface();
            }
            wgpu::CurrentSurfaceTexture::Validation => {
                self.renderer.gpu().check()?;
                return Err(GpuError::Device { reason: "the window's surface gave no texture".into() });
            }
        };
        let view = target.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let size = (target.texture.width(), target.texture.height());
        let (device, queue) = (self.renderer.gpu().device.clone(), self.renderer.gpu().queue.clone());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        match display.filter(|_| self.drawn.is_some()) {
            Some(display) => self.renderer.show(&mut encoder, &view, self.configuration.format, display),
            None => clear(&mut encoder, &view),
        }
        let before = self.interface.paint(self.renderer.gpu(), &mut encoder, &view, size);
        queue.submit(before.into_iter().chain([encoder.finish()]));
        self.window.pre_present_notify();
        queue.present(target);
        self.renderer.gpu().check()?;
        Ok(Shown::Yes)
    }

    /// A new surface in the place of a lost one, for the same device.
    fn replace_surface(&mut self) -> Result<Shown, GpuError> {
        let gpu = self.renderer.gpu();
        self.surface = gpu
            .instance
            .create_surface(Arc::clone(&self.window))
            .map_err(|error| GpuError::Lost { reason: error.to_string() })?;
        self.surface.configure(&gpu.device, &self.configuration);
        gpu.check()?;
        tracing::info!("the window's surface was lost and made anew");
        Ok(Shown::Again)
    }
}

/// A device that can show pictures in `window`, and the window's surface set up for it.
///
/// # Errors
/// [`WindowError::Surface`], [`WindowError::Gpu`].
pub(crate) fn open_surface(
    display: OwnedDisplayHandle,
    window: &Arc<Window>,
    choice: &AdapterChoice,
) -> Result<(Gpu, wgpu::Surface<'static>, wgpu::SurfaceConfiguration), WindowError> {
    let mut descriptor = wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display));
    descriptor.flags = instance_flags();
    let instance = wgpu::Instance::new(descriptor);
    let surface = instance
        .create_surface(Arc::clone(window))
        .map_err(|error| WindowError::Surface { adapter: "any adapter".into(), reason: error.to_string() })?;
    let gpu = Gpu::for_surface(instance, &surface, choice)?;
    let size = window.inner_size();
    let configuration = configuration(&gpu, &surface, size.width, size.height)?;
    surface.configure(&gpu.device, &configuration);
    Ok((gpu, surface, configuration))
}

fn clear(encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView) {
    let load = wgpu::LoadOp::Clear(wgpu::Color { r: 0.02, g: 0.02, b: 0.025, a: 1.0 });
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("no picture"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    }));
}

fn configuration(
    gpu: &Gpu,
    surface: &wgpu::Surface<'_>,
    width: u32,
    height: u32,
) -> Result<wgpu::SurfaceConfiguration, WindowError> {
    let most = gpu.device.limits().max_texture_dimension_2d;
    let (width, height) = (width.clamp(1, most), height.clamp(1, most));
    let unfit = |reason: &str| WindowError::Surface { adapter: gpu.name(), reason: reason.into() };
    let mut configuration = surface
        .get_default_config(&gpu.adapter, width, height)
        .ok_or_else(|| unfit("it supports no format of this window"))?;
    let formats = surface.get_capabilities(&gpu.adapter).formats;
    // The shaders encode sRGB themselves, and so does the interface.
    let wanted = [wgpu::TextureFormat::Bgra8Unorm, wgpu::TextureFormat::Rgba8Unorm];
    let plain = wanted.into_iter().find(|format| formats.contains(format));
    configuration.format =
        plain.or_else(|| formats.first().copied()).ok_or_else(|| unfit("it offers no format"))?;
    configuration.present_mode = wgpu::PresentMode::AutoVsync;
    configuration.desired_maximum_frame_latency = 1;
    Ok(configuration)
}
