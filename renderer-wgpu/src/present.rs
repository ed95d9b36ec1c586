//! Turns the last drawn picture into the colours of a window.

use crate::{
    Renderer,
    layout::FrameUniform,
    pipelines::{self, texture, whole},
    shader,
};
use photonstream_film::Display;
use photonstream_shading::{tone::ToneMap, wgsl};

/// Shows pictures on targets of one format.
#[derive(Debug)]
pub(crate) struct Present {
    format: wgpu::TextureFormat,
    pipeline: wgpu::RenderPipeline,
    numbers: wgpu::Buffer,
}

impl Renderer {
    /// Encodes the last drawn picture onto `target` of `format`, one pixel to one, as `display` says; values that are
    /// to be scaled are scaled by the extent of the scene.
    pub fn show(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
        display: Display,
    ) {
        let Some(targets) = &self.targets else { return };
        if self.present.as_ref().is_none_or(|p| p.format != format) {
            let constants = [("TARGET_ENCODES", f64::from(format.is_srgb()))];
            let pipeline = pipelines::covering(&self.gpu, &shader::PRESENT, "display", format, &constants);
            let bytes = size_of::<FrameUniform>() as u64;
            let numbers = crate::geometry::buffer(&self.gpu, "shown as", bytes, wgpu::BufferUsages::UNIFORM);
            self.present = Some(Present { format, pipeline, numbers });
        }
        let Some(present) = &self.present else { return };
        let (exposure_ev, tone_map) = match display {
            Display::Radiance { exposure_ev, tone_map } => (exposure_ev, tone_map),
            Display::Data => (0.0, ToneMap::Linear),
            Display::Scaled => (-self.extent().log2(), ToneMap::Linear),
        };
        let numbers = FrameUniform { exposure_ev, tone_map: wgsl::tone_map_number(tone_map), ..self.frame };
        self.gpu.queue.write_buffer(&present.numbers, 0, bytemuck::bytes_of(&numbers));
        let resources = [whole(&present.numbers), texture(&targets.output.view)];
        let group = pipelines::bind(&self.gpu, &present.pipeline.get_bind_group_layout(0), &resources);
        let colours = [Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })];
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("show"),
            color_attachments: &colours,
            ..Default::default()
        });
        pass.set_pipeline(&present.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
