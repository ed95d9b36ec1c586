//! Turns window events into the input of the interface, and its shapes into pixels.

use egui::{Context, FullOutput, TexturesDelta, Ui, ViewportId};
use egui_wgpu::{RendererOptions, ScreenDescriptor};
use photonstream_renderer_wgpu::Gpu;
use std::time::Duration;
use winit::{event::WindowEvent, window::Window};

/// The interface and what paints it.
pub(crate) struct Interface {
    state: egui_winit::State,
    painter: egui_wgpu::Renderer,
    shapes: Vec<egui::ClippedPrimitive>,
    pixels_per_point: f32,
    freed: Vec<egui::TextureId>,
}

impl std::fmt::Debug for Interface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Interface").field("pixels_per_point", &self.pixels_per_point).finish_non_exhaustive()
    }
}

impl Interface {
    /// An interface for `window`, painted by `gpu` on surfaces of `format`; what `memory` knows of an earlier one, such
    /// as where its windows are, is taken over.
    pub(crate) fn new(
        window: &Window,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        memory: Option<egui::Memory>,
    ) -> Self {
        let context = Context::default();
        context.set_theme(egui::Theme::Dark);
        if let Some(memory) = memory {
            context.memory_mut(|m| *m = memory);
        }
        let side = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = Some(window.scale_factor() as f32);
        let state =
            egui_winit::State::new(context, ViewportId::ROOT, window, scale, window.theme(), Some(side));
        let painter = egui_wgpu::Renderer::new(&gpu.device, format, RendererOptions::default());
        Self { state, painter, shapes: Vec::new(), pixels_per_point: 1.0, freed: Vec::new() }
    }

    /// What it knows, for the next one.
    pub(crate) fn memory(&self) -> egui::Memory {
        self.state.egui_ctx().memory(Clone::clone)
    }

    /// Whether a text field takes the keys.
    pub(crate) fn takes_keys(&self) -> bool {
        self.state.egui_ctx().egui_wants_keyboard_input()
    }

    /// Hears of an event first: whether it has to be painted again, and whether the event was meant for it.
    pub(crate) fn hear(&mut self, window: &Window, event: &WindowEvent) -> (bool, bool) {
        let response = self.state.on_window_event(window, event);
        (response.repaint, response.consumed)
    }

    /// Lays out what `show` adds; after which time it wants to be laid out again.
    pub(crate) fn lay_out(&mut self, window: &Window, gpu: &Gpu, show: impl FnMut(&mut Ui)) -> Duration {
        let input = self.state.take_egui_input(window);
        let FullOutput { platform_output, textures_delta, shapes, pixels_per_point, viewport_output } =
            self.state.egui_ctx().run_ui(input, show);
        self.state.handle_platform_output(window, platform_output);
        self.shapes = self.state.egui_ctx().tessellate(shapes, pixels_per_point);
        self.pixels_per_point = pixels_per_point;
        self.upload(gpu, textures_delta);
        viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |viewport| viewport.repaint_delay)
    }

    fn upload(&mut self, gpu: &Gpu, mut textures: TexturesDelta) {
        for id in self.freed.drain(..) {
            self.painter.free_texture(&id);
        }
        for (id, deltas) in &textures.set {
            for delta in deltas {
                self.painter.update_texture(&gpu.device, &gpu.queue, *id, delta);
            }
        }
        // They may still be in use by what is painted next.
        self.freed = textures.free.iter().copied().collect();
        textures.clear();
    }

    /// Paints what was laid out over `target`; what has to be submitted before `encoder`.
    pub(crate) fn paint(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        size: (u32, u32),
    ) -> Vec<wgpu::CommandBuffer> {
        let screen =
            ScreenDescriptor { size_in_pixels: [size.0, size.1], pixels_per_point: self.pixels_per_point };
        let before = self.painter.update_buffers(&gpu.device, &gpu.queue, encoder, &self.shapes, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("interface"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), &self.shapes, &screen);
        before
    }
}
